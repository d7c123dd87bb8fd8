"""Quiet recordings that begin anywhere: a long run of a machine without any effect, cut where it is in the middle of something.

The twin makes the run (another machine for each seed, with mass and damping, which a replay leaves out), and nobody who reads
the recording knows what was before its first row: no rig, no rest at its beginning, cell noise of 0.1 N.
"""

from typing import Final

import numpy as np

from gateway.diagnosis import Measurement
from gateway.twin.plant import Contact, Cylinder, Friction, LoadCell, Plant, Regulator
from gateway.twin.simulation import Twin
from tests.diagnosis.machine import Floats, measurement

NOISE_N: Final = 0.1
BEGINNINGS: Final = ("in a stroke", "in a dwell", "after a wiggle", "falling", "in a step", "anywhere")
COLOURS: Final = ("white", "lorentzian")
_ROW_S: Final = 0.01
_TOP_V: Final = 6.0
_BEFORE_S: Final = 20.0


def begun(beginning: str, seed: int, colour: str = "white", lasts_s: float = 30.0) -> Measurement:
    """Return a recording of a quiet machine. beginning: of BEGINNINGS; colour: of the noise, of COLOURS."""
    rng = np.random.default_rng([seed, BEGINNINGS.index(beginning)])
    before_v = _before(rng, beginning)
    volts = np.concatenate([before_v, _work(rng, float(before_v[-1]), lasts_s)])
    rows = round(lasts_s / _ROW_S)
    first = int(rng.integers(0, before_v.size)) if beginning == "anywhere" else before_v.size
    force_n = _run(_machine(rng), volts[: first + rows])[first:]
    noise_n = NOISE_N * _noise(rng, rows, colour)
    time_s = np.arange(rows) * _ROW_S
    return measurement(time_s, volts[first : first + rows], np.round(force_n + noise_n, 5), {})


def _machine(rng: np.random.Generator) -> Plant:
    return Plant(
        regulator=Regulator(lag_s=rng.uniform(0.03, 0.12)),
        cylinder=Cylinder(area_m2=rng.uniform(85.0e-6, 110.0e-6)),
        friction=Friction(coulomb_n=rng.uniform(0.4, 2.0)),
        contact=Contact(
            pad_stiffness_n_per_m=rng.uniform(2.0e4, 8.0e4),
            mass_kg=rng.uniform(0.05, 0.25),
            pad_damping_n_s_per_m=60.0,
            tilt_deg=90.0,
        ),
        cell=LoadCell(zero_n=rng.uniform(-0.5, 0.5)),
    )


def _run(plant: Plant, volts: Floats) -> Floats:
    """What the cell reads in each row, before the row's command acts; without noise."""
    twin, force_n = Twin(plant, 1), np.empty(volts.size)
    for row, volt in enumerate(volts.tolist()):
        force_n[row] = twin.read()
        twin.command(volt)
        twin.advance(_ROW_S)
    return force_n


def _before(rng: np.random.Generator, beginning: str) -> Floats:
    """What was commanded before the first row, V; its last piece is in the middle of what the beginning says."""
    work_v = _work(rng, 0.0, rng.uniform(3.0, _BEFORE_S))
    level = float(rng.uniform(1.5, 5.5))
    if beginning == "in a stroke":
        piece = np.linspace(work_v[-1], level, _rows(rng.uniform(0.5, 3.0)))
    elif beginning == "falling":
        piece = np.linspace(level, rng.uniform(0.0, 0.6) * level, _rows(rng.uniform(0.3, 2.0)))
    elif beginning == "in a dwell":
        piece = np.full(_rows(rng.uniform(1.0, 5.0)), level)
    elif beginning == "in a step":
        piece = np.concatenate([np.full(_rows(1.0), work_v[-1]), np.full(_rows(rng.uniform(0.01, 0.15)), level)])
    elif beginning == "after a wiggle":
        walk = level + np.cumsum(rng.normal(0.0, 0.06, int(rng.integers(3, 12))))
        piece = np.repeat(walk, _rows(rng.uniform(0.1, 0.5)))
    else:
        return np.asarray(np.round(np.clip(work_v, 0.0, _TOP_V), 3))
    return np.asarray(np.round(np.clip(np.concatenate([work_v, piece]), 0.0, _TOP_V), 3))


def _work(rng: np.random.Generator, level: float, lasts_s: float) -> Floats:
    """Steps, ramps, waves, small steps and dwells from `level` on, in an order of chance."""
    pieces, rows = [np.full(1, level)], 0
    while rows < _rows(lasts_s):
        pieces.append(_piece(rng, int(rng.integers(0, 5)), level))
        level, rows = float(pieces[-1][-1]), rows + pieces[-1].size
    return np.asarray(np.round(np.clip(np.concatenate(pieces)[: _rows(lasts_s) + 1], 0.0, _TOP_V), 3))


def _piece(rng: np.random.Generator, kind: int, level: float) -> Floats:
    seconds = rng.uniform(2.0, 5.0)
    time_s = np.arange(_rows(seconds)) * _ROW_S
    if kind == 0:
        targets = rng.uniform(0.0, _TOP_V, 6)
        return np.concatenate(
            [np.full(_rows(dwell_s), v) for dwell_s, v in zip(rng.uniform(0.15, 1.2, 6), targets, strict=True)]
        )
    if kind == 1:
        return np.interp(time_s, (0.0, 0.4 * seconds, seconds), (level, *rng.uniform(0.0, _TOP_V, 2)))
    if kind == 2:
        wave = np.sin(2.0 * np.pi * rng.uniform(0.1, 2.0) * time_s)
        return np.asarray(level + rng.uniform(0.2, 1.5) * wave)
    if kind == 3:
        return np.repeat(level + np.cumsum(rng.normal(0.0, 0.08, 12)), _rows(0.25))
    return np.full(_rows(seconds), level)


def _noise(rng: np.random.Generator, rows: int, colour: str) -> Floats:
    """Unit variance, the corner at 0.3 to 6 Hz where it is coloured."""
    if colour == "white":
        return rng.normal(size=rows)
    return coloured(rng, rows, float(np.exp(rng.uniform(np.log(0.3), np.log(6.0)))), _ROW_S)


def coloured(rng: np.random.Generator, rows: int, corner_hz: float, row_s: float) -> Floats:
    """Return noise of unit variance, half of it white and half behind a lag with this corner."""
    keep = float(np.exp(-2.0 * np.pi * corner_hz * row_s))
    drive, slow = rng.normal(size=rows) * np.sqrt(1.0 - keep**2), np.empty(rows)
    state = float(rng.normal())
    for row, push in enumerate(drive.tolist()):
        state = keep * state + push
        slow[row] = state
    return np.asarray(np.sqrt(0.5) * (rng.normal(size=rows) + slow))


def _rows(seconds: float) -> int:
    return max(round(seconds / _ROW_S), 1)
