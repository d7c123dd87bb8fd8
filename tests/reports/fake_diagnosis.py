"""A diagnosis as the engine would answer one, made by hand: friction that grows with load found, warmth left over."""

from dataclasses import replace
from typing import Any

import numpy as np

from gateway.diagnosis.measurement import Floats, Measurement
from gateway.diagnosis.result import (
    Baseline,
    Cause,
    Diagnosis,
    Estimate,
    Extended,
    Gain,
    Leftover,
    NotIdentifiable,
    Rejected,
    Trace,
    Verdict,
)
from gateway.profiles import load_plant
from gateway.twin.plant import with_value


def command_v(time_s: Floats) -> Floats:
    """Stairs and a slow swing, 0 .. 6 V."""
    swing = 3.0 + 2.2 * np.sin(2 * np.pi * time_s / 13.0) + 0.8 * np.sin(2 * np.pi * time_s / 3.1)
    return np.asarray(np.where(time_s % 20.0 < 8.0, np.round(swing * 2) / 2, swing))


def trace(name: str = "press-07.csv", rows: int = 12_000, seed: int = 7, **more: Floats) -> Trace:
    rng = np.random.default_rng(seed)
    time_s = np.arange(rows) / 200.0
    volts = command_v(time_s)
    pressure = np.convolve(np.concatenate([np.full(40, volts[0]), volts]), np.ones(41) / 41, "valid")[:rows]
    way = np.sign(np.gradient(pressure))
    ideal = 8.5 * pressure - 1.0 * way
    temperature = 21.0 + 4.0 * (1 - np.exp(-time_s / 30.0)) + rng.normal(0, 0.02, rows)
    measured = ideal - 0.05 * ideal * way + 0.12 * (temperature - 23.0) + rng.normal(0, 0.12, rows)
    extended = ideal - 0.05 * ideal * way
    usable = np.ones(rows, dtype=bool)
    usable[rows // 3 : rows // 3 + rows // 40] = False
    covariates = {"temperature_c": temperature, "supply_kpa": 600 + 3 * rng.normal(size=rows), **more}
    measurement = Measurement(
        name=name, time_s=time_s, force_n=measured, usable=usable, repeated=~usable & False, command_v=volts,
        covariates=covariates, notes=("line 812, force_n: '--' is no number",),
    )  # fmt: skip
    return Trace(measurement, ideal, extended)


FRICTION = Cause(
    "load-dependent-friction",
    ("load-dependent-friction",),
    0.985,
    {"load_dependent_n_per_n": Estimate("friction", 0.0497, "N/N", (0.0482, 0.0511))},
    Gain(1.186, 0.257, (0.871, 0.986), 0.962),
)
WARMTH = Cause(
    "thermal-zero-drift",
    ("thermal-zero-drift", "warm-up", "linear-drift"),
    0.71,
    {"zero_n_per_k": Estimate("cell", 0.118, "N/K", (0.101, 0.136))},
    Gain(0.257, 0.121, (0.11, 0.16), 0.03),
)


def diagnosis(**changes: Any) -> Diagnosis:
    """Partial by default. changes: fields of Diagnosis."""
    start = load_plant("paper-slide").plant
    base = with_value(with_value(start, "cylinder", "area_m2", 9.44e-5), "cell", "zero_n", -0.31)
    fake = Diagnosis(
        verdict=Verdict.PARTIAL,
        baseline=Baseline(1.186, 0.12, 11_700, 59.995),
        causes=(FRICTION,),
        leftover=(Leftover("temperature_c", "rises in a straight line, 0.12 N/K", 0.031),),
        not_identifiable=(
            NotIdentifiable("supply-droop", "supply_kpa moves by 3 kPa only", "let the supply fall by 100 kPa in a dwell"),
            NotIdentifiable("spindle-vibration", "no spindle_rpm column", "record spindle_rpm at three speeds"),
            NotIdentifiable("feed-drag", "no feed_mm_s column", "record feed_mm_s over three feeds, both directions"),
            NotIdentifiable("tilt-gravity", "no tilt_deg column", "tilt the tool through 0, 45 and 90 degrees at 20 N"),
        ),
        rejected=(Rejected("viscous-friction", 0.212), Rejected("presliding", 0.094), Rejected("creep", 0.003)),
        extended=Extended(0.257, False),
        base=base,
        plant=with_value(base, "friction", "load_dependent_n_per_n", 0.0497),
        base_parameters={
            "area_m2": Estimate("cylinder", 9.44e-5, "m2", (9.41e-5, 9.47e-5)),
            "zero_n": Estimate("cell", -0.31, "N", (-0.34, -0.28)),
            "lag_s": Estimate("regulator", 0.072, "s", (0.070, 0.074)),
            "coulomb_n": Estimate("friction", 1.0, "N", (0.97, 1.04)),
        },
        traces=(trace(),),
        experiments=("dwell 60 s at 20 N while the room warms by 5 K, to tell the drifts apart",),
        notes=("the noise is coloured: a line of 3 Hz width was whitened", "line 812, force_n: '--' is no number"),
    )  # fmt: skip
    return replace(fake, **changes)
