"""Replay and the running twin are one physics: the same plant and commands give the same readings.

The slides here have no mass, so both are quasi-static; rows lie 5 ms apart. Where the two compute alike, they agree to 0.1 mN
(the rigid friction of the running twin gives by 1 nm). Elsewhere the reason for more stands with the number; the RMS counts,
for a step of 5 ms rounds the corners of a jump differently than one of 1 ms does.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from gateway.twin import Contact, Drive, Friction, Plant, Regulator, Replay, Surroundings, Twin
from gateway.twin.experiment import Floats
from gateway.twin.surroundings import COLUMNS

ROWS, STEP_S = 800, 0.005
TIME_S = np.arange(ROWS) * STEP_S
COMMAND_V = np.where(
    TIME_S % 2.0 < 1.0,
    np.repeat(np.random.default_rng(3).uniform(0.5, 7.0, ROWS // 40), 40),
    3.5 + 2.0 * np.sin(3.0 * TIME_S) + np.sin(7.0 * TIME_S),
)
AROUND = Surroundings(
    temperature_c=20.0 + 5.0 * np.sin(TIME_S),
    supply_kpa=600.0 + 50.0 * np.sin(TIME_S),
    spindle_rpm=np.full(ROWS, 180.0),
    feed_mm_s=30.0 * np.sin(2.0 * TIME_S),
    tilt_deg=40.0 * np.sin(TIME_S),
    position_mm=50.0 * np.sin(2.0 * np.pi * TIME_S / (ROWS * STEP_S)),
    distance_m=0.03 * TIME_S,
)
BASE = Plant(regulator=Regulator(lag_s=0.05), friction=Friction(coulomb_n=1.0))
TIGHT_N = 2.0e-4

HELD = "the running twin holds the surroundings from row to row, replay draws a line"
GRID = "its step is 1 ms, replay's 5 ms"
EFFECTS: list[tuple[str, dict[str, float], float, str]] = [
    ("regulator", {"command_bow": 0.05}, TIGHT_N, ""),
    ("regulator", {"command_s": 0.05}, TIGHT_N, ""),
    ("regulator", {"command_step_v": 0.1}, TIGHT_N, ""),
    ("regulator", {"dead_band_pa": 2.0e4}, TIGHT_N, ""),
    ("regulator", {"hysteresis_pa": 2.0e4}, TIGHT_N, ""),
    ("regulator", {"supply_pa": 4.0e5}, TIGHT_N, ""),
    ("regulator", {"delay_s": 0.02}, TIGHT_N, ""),
    ("regulator", {"delay_s": 0.0123}, 0.02, GRID),
    ("regulator", {"fill_slowdown": 0.5}, TIGHT_N, ""),
    ("regulator", {"slew_pa_per_s": 2.0e6}, TIGHT_N, ""),
    ("regulator", {"second_lag_s": 0.03}, 2.0e-3, GRID),
    ("regulator", {"ceiling_pa": 4.0e5}, TIGHT_N, ""),
    ("regulator", {"leak_flow_pa": 2.0e4}, TIGHT_N, ""),
    ("regulator", {"ceiling_pa": 4.0e5, "leak_flow_pa": 2.0e4}, TIGHT_N, ""),  # the hole is behind the valve
    ("regulator", {"leak_per_s": 0.2}, 1.0e-3, GRID),
    ("regulator", {"droop_pa_per_pa": 0.1}, TIGHT_N, ""),
    ("regulator", {"droop_share_per_pa": 2.0e-6}, TIGHT_N, ""),
    ("regulator", {"hunting_pa": 1.0e4}, 2.0e-3, GRID),
    ("cylinder", {"stroke_m": 8.0e-4}, TIGHT_N, ""),
    ("cylinder", {"area_m2": 1.1e-4}, TIGHT_N, ""),
    ("cylinder", {"chamber_lag_s": 0.03}, 5.0e-3, GRID),
    ("friction", {"coulomb_n": 2.0}, TIGHT_N, ""),
    ("friction", {"load_dependent_n_per_n": 0.05}, TIGHT_N, ""),
    ("friction", {"asymmetry_n": 0.5}, TIGHT_N, ""),
    ("friction", {"asymmetry_n_s_per_m": 400.0}, 0.05, GRID),
    ("friction", {"asymmetry_n_s_per_m": -400.0, "viscous_n_s_per_m": 300.0}, 0.05, GRID),
    ("friction", {"asymmetry_n_s_per_m": 400.0, "presliding_m": 1.0e-4}, 0.05, GRID),
    ("friction", {"presliding_m": 2.0e-4}, TIGHT_N, ""),
    ("friction", {"presliding_m": 2.0e-4, "load_dependent_n_per_n": 0.03, "asymmetry_n": -0.3}, TIGHT_N, ""),
    ("friction", {"presliding_m": 2.0e-4, "viscous_n_s_per_m": 50.0}, 0.01, GRID),
    ("friction", {"viscous_n_s_per_m": 300.0}, 0.08, GRID),
    ("friction", {"stribeck_n": 1.0}, 0.15, GRID),
    ("friction", {"dwell_stiction_n": 2.0, "dwell_stiction_s": 0.5}, 0.06, GRID),
    ("friction", {"dwell_stiction_n": 2.0, "dwell_stiction_s": 0.5, "presliding_m": 1.0e-4}, 0.05, GRID),
    ("friction", {"side_load_n_s_per_mm": 0.03}, 0.02, HELD),
    ("friction", {"side_load_n_per_n": 0.05}, 0.05, HELD),
    ("friction", {"side_load_n_per_n": 0.05, "stribeck_n": 0.3}, 0.1, GRID),
    ("friction", {"side_load_tilt_n": 1.0}, 0.02, HELD),
    ("friction", {"side_load_n_per_mm": 0.02}, 0.02, HELD),
    ("friction", {"side_load_n_per_mm": 0.02, "stribeck_n": 0.3}, 0.1, GRID),
    ("friction", {"place_n_per_mm": 0.02, "place_n_per_mm2": 5.0e-4}, 0.03, HELD),
    ("friction", {"place_asymmetry_n_per_mm": 0.02, "place_asymmetry_n_per_mm2": 5.0e-4}, 0.03, HELD),
    ("contact", {"gap_m": 1.0e-4}, TIGHT_N, ""),
    ("contact", {"lost_n": 1.0}, TIGHT_N, ""),
    ("contact", {"backlash_n": 1.0}, TIGHT_N, ""),
    ("contact", {"creep_share": 0.1, "creep_s": 2.0}, TIGHT_N, ""),
    ("contact", {"hardening": 0.05}, TIGHT_N, ""),
    ("contact", {"wear_per_m": 0.2}, 0.01, HELD),
    ("contact", {"wear_n_per_m": 2.0}, 0.01, HELD),
    ("contact", {"tilt_n": 2.0, "tilt_zero_deg": 10.0}, 0.02, HELD),
    ("contact", {"feed_drag_n": 1.0}, 0.2, HELD),  # the sign turns a row later
    ("contact", {"feed_drag_n_s_per_mm": 0.03}, 0.02, HELD),
    ("contact", {"feed_drag_abs_n_s_per_mm": 0.03}, 0.02, HELD),
    ("contact", {"spindle_n": 1.0}, TIGHT_N, ""),
    ("contact", {"spindle_n_per_krpm2": 20.0, "spindle_order": 2.0, "spindle_phase_rad": 1.0}, TIGHT_N, ""),
    ("contact", {"position_n_per_mm": 0.05}, 0.03, HELD),
    ("contact", {"position_n_per_mm2": 0.001}, 0.03, HELD),
    ("contact", {"ripple_n": 1.0, "ripple_pitch_mm": 40.0}, 0.1, HELD),
    ("contact", {"stop_stiffness_n_per_mm": 0.1, "stop_mm": 20.0}, 0.03, HELD),
    ("cell", {"filter_s": 0.01}, 8.0e-3, GRID),
    ("cell", {"zero_n": 1.0}, TIGHT_N, ""),
    ("cell", {"zero_n_per_k": 0.1}, TIGHT_N, ""),
    ("cell", {"span_per_k": 0.01}, TIGHT_N, ""),
    ("cell", {"warm_up_n": 1.0, "warm_up_s": 3.0}, TIGHT_N, ""),
    ("cell", {"drift_n_per_s": 0.1}, TIGHT_N, ""),
    ("cell", {"quadratic_per_n": 1.0e-3}, TIGHT_N, ""),
    ("cell", {"cubic_per_n2": 1.0e-4}, 5.0e-4, "the slope of the cubic multiplies the 0.1 mN"),
    ("cell", {"hum_n": 0.5}, TIGHT_N, ""),
    ("cell", {"crosstalk_n_per_v": 0.1}, TIGHT_N, ""),
    ("cell", {"clock_offset_s": 0.01}, TIGHT_N, ""),
    ("cell", {"clock_offset_s": 0.013}, 0.06, GRID),
    ("cell", {"clock_skew": 0.01}, 0.06, GRID),
    ("cell", {"zero_n": -20.0, "sign_lost": 0.8}, TIGHT_N, ""),
    ("cell", {"quantum_n": 0.5}, TIGHT_N, ""),
    ("cell", {"range_n": 30.0}, TIGHT_N, ""),
]
NAMES = ["-".join(change) + f"={next(iter(change.values()))}" for _, change, _, _ in EFFECTS]


def changed(section: str, change: dict[str, float]) -> Plant:
    part: dict[str, Any] = {section: replace(getattr(BASE, section), **change)}
    return replace(BASE, **part)


def lived(plant: Plant) -> Floats:
    """Readings of the running twin, each before the command of its row."""
    twin, readings = Twin(plant, 1), []
    for row, voltage_v in enumerate(COMMAND_V):
        around: dict[str, Any] = {name: float(getattr(AROUND, name)[row]) for name in COLUMNS}
        twin.set_surroundings(Surroundings(**around))
        readings.append(twin.read())
        twin.command(float(voltage_v))
        twin.advance(STEP_S)
    return np.array(readings)


def drive(**changes: Any) -> Drive:
    columns: dict[str, Any] = {"time_s": TIME_S, "command_v": COMMAND_V, "surroundings": AROUND}
    return Drive(**(columns | changes))


@cache
def replayed() -> Floats:
    return Replay(drive()).run([changed(section, change) for section, change, _, _ in EFFECTS]).reading_n


@cache
def without() -> Floats:
    return lived(BASE)


@pytest.mark.sampled
@pytest.mark.parametrize("case", range(len(EFFECTS)), ids=NAMES)
def test_replay_reads_what_the_running_twin_reads(case: int) -> None:
    section, change, tolerance_n, _ = EFFECTS[case]
    running = lived(changed(section, change))
    apart_n = (replayed()[case] - running)[1:]  # the twin's first reading is older than its surroundings
    effect_n = float(np.sqrt(np.mean((running - without()) ** 2)))
    assert float(np.sqrt(np.mean(apart_n**2))) < tolerance_n
    if tolerance_n == TIGHT_N:
        assert float(np.abs(apart_n).max()) < TIGHT_N
    assert change == {"gap_m": 1.0e-4} or effect_n > max(2.0 * tolerance_n, 0.01)


def test_plants_together_are_single_runs() -> None:
    for case, (section, change, _, _) in enumerate(EFFECTS):
        alone = Replay(drive()).run([changed(section, change)]).reading_n[0]
        np.testing.assert_allclose(alone, replayed()[case], rtol=0.0, atol=1.0e-9)


def test_mass_and_pad_damping_are_left_out_and_the_weight_stays() -> None:
    heavy = replace(BASE, contact=Contact(mass_kg=0.6, tilt_deg=60.0, pad_damping_n_s_per_m=400.0))
    apart_n = Replay(drive()).run([heavy]).reading_n[0] - lived(heavy)
    assert float(np.sqrt(np.mean(apart_n[1:] ** 2))) < 0.3
    assert abs(float(np.mean(apart_n[1:]))) < 0.05
