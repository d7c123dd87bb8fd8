"""A machine to diagnose: a minute of rich commands, what is logged beside them, and readings that the twin gives for them.

The twin makes the readings here, so these tests ask whether the search finds what the model can say; whether it finds what
another machine does is asked by tests/hidden_effects, whose generator shares no code with the twin.
"""

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.diagnosis import Measurement
from gateway.recording.tables.row_validity import flag_repeated
from gateway.twin.plant import Contact, Cylinder, Friction, LoadCell, Plant, Regulator, with_value
from gateway.twin.replay.replay import Drive, Replay, ReplayResult
from gateway.twin.surroundings import Surroundings

Floats = NDArray[np.float64]

NOISE_N: Final = 0.1
NOISE_KPA: Final = 0.3
GAUGE: Final = "pressure_kpa"
MACHINE: Final = Plant(
    regulator=Regulator(lag_s=0.055),
    cylinder=Cylinder(area_m2=88.0e-6),
    friction=Friction(coulomb_n=0.7),
    contact=Contact(pad_stiffness_n_per_m=4.1e4),
    cell=LoadCell(zero_n=0.4),
)
"""Not where the base fit begins: area, lag, friction and offset have to be found."""


def times_s(duration_s: float = 60.0, rate_hz: float = 200.0) -> Floats:
    return np.arange(round(duration_s * rate_hz)) / rate_hz


def _ramps() -> list[tuple[float, float, float]]:
    """(duration s, from V, to V): half a second at rest, then everything that some effect needs."""
    pieces = [(0.5, 0.0, 0.0)]
    for dwell_s, level_v in zip(
        (0.4, 0.8, 1.2, 0.5, 1.0, 0.4, 0.9, 0.7), (1.5, 4.0, 2.5, 5.5, 0.8, 3.2, 4.6, 1.9), strict=True
    ):
        pieces.append((dwell_s, level_v, level_v))
    pieces += [(3.0, 0.5, 5.0), (1.5, 5.0, 1.0), (2.0, 1.0, 3.0)]
    pieces += [(0.4, 3.0, 3.5), (0.4, 3.5, 3.0), (0.3, 3.0, 3.2), (0.3, 3.2, 2.6), (0.6, 2.6, 3.4), (0.6, 3.4, 3.0)]
    pieces += [(6.0, 3.0, 3.0), (2.5, 3.0, 3.8), (1.0, 3.8, 3.8), (2.0, 3.8, 3.0), (3.0, 3.0, 3.0), (1.5, 3.0, 2.4)]
    level_v = 2.4
    for step_v in (0.02, 0.05, -0.03, -0.08, 0.12, 0.03, -0.06, 0.015, -0.04, 0.09, -0.1, -0.02):
        level_v += step_v
        pieces.append((0.25, level_v, level_v))
    pieces += [(3.0, 0.0, 0.0)]
    for level in (*range(1, 15), *range(13, 0, -1)):
        pieces.append((0.35, 0.4 * level, 0.4 * level))
    pieces += [(2.0, 0.0, 0.0), (0.8, 5.0, 5.0), (0.8, 0.5, 0.5), (1.0, 0.5, 4.5), (1.0, 4.5, 0.2), (2.0, 2.0, 2.0)]
    pieces += [(0.5, 4.4, 4.4), (0.5, 3.1, 3.1), (0.7, 1.2, 1.2), (4.0, 1.2, 2.2), (1.0, 5.2, 5.2)]
    return pieces


def command_v(time_s: Floats) -> Floats:
    """About a minute of pieces, again and again; the last second at rest. Millivolts, as a controller sends them."""
    edges, levels, begin_s = [], [], 0.0
    while begin_s < time_s[-1]:
        for duration_s, first_v, last_v in _ramps():
            edges += [begin_s, begin_s + duration_s - 1.0e-6]
            levels += [first_v, last_v]
            begin_s += duration_s
    volts = np.interp(time_s, edges, levels)
    volts[time_s > time_s[-1] - 1.0] = 0.0
    return np.asarray(np.round(volts, 3))


def _stretches(time_s: Floats, length_s: float, levels: tuple[float, ...]) -> Floats:
    return np.array(levels)[(time_s / length_s).astype(int) % len(levels)]


def _feed(time_s: Floats) -> Floats:
    return _stretches(time_s, 1.7, (6.0, 0.0, -6.0, 15.0, -15.0, 0.0, 10.0, -10.0, 0.0))


def _way_mm(time_s: Floats) -> Floats:
    return np.asarray(np.cumsum(_feed(time_s)) * time_s[1])


LOGGED: Final[Mapping[str, Callable[[Floats], Floats]]] = {
    "temperature_c": lambda time_s: 23.0 + 4.0 * np.sin(0.19 * time_s + 0.4),
    "supply_kpa": lambda time_s: 650.0 + 60.0 * ((time_s / 7.3) % 1.0) * np.where((time_s / 2.0) % 1.0 < 0.9, 1.0, 0.4),
    "spindle_rpm": lambda time_s: _stretches(time_s, 4.1, (0.0, 3900.0, 0.0, 2500.0, 4700.0)),
    "feed_mm_s": _feed,
    "position_mm": lambda time_s: np.round(_way_mm(time_s), 3),
    "distance_m": lambda time_s: np.cumsum(np.abs(_feed(time_s)) * (np.sin(0.7 * time_s) > -0.3)) * time_s[1] * 1.0e-3,
    "tilt_deg": lambda time_s: np.interp(
        time_s % 20.0, (0, 3, 4, 8, 9, 13, 14, 20), (40, 40, 75, 75, 120, 120, 60, 60)
    ),
}
"""What a column holds; each goes up and down, so that it is told from mere time."""


def plant(changes: Mapping[str, float], start: Plant = MACHINE) -> Plant:
    """The machine with fields changed by path: {"regulator.delay_s": 0.04}."""
    for path, value in changes.items():
        section, name = path.split(".")
        start = with_value(start, section, name, value)
    return start


def replayed(machine: Plant, time_s: Floats, volts: Floats, columns: Mapping[str, Floats]) -> ReplayResult:
    """What the twin does, without noise."""
    drive = Drive(time_s=time_s, command_v=volts, surroundings=Surroundings(**columns))
    return Replay(drive, most_steps=2 * time_s.size).run([machine])


def readings_n(machine: Plant, time_s: Floats, volts: Floats, columns: Mapping[str, Floats]) -> Floats:
    """What the twin reads, without noise."""
    return replayed(machine, time_s, volts, columns).reading_n[0]


def measurement(time_s: Floats, volts: Floats | None, force_n: Floats, columns: Mapping[str, Floats]) -> Measurement:
    """As the reader hands it on."""
    others = {name: values for name, values in columns.items() if name not in ("position_mm", GAUGE)}
    position_mm, gauge_kpa = columns.get("position_mm"), columns.get(GAUGE)
    return Measurement(
        name="machine",
        time_s=time_s,
        force_n=force_n,
        usable=np.isfinite(force_n),
        repeated=flag_repeated(force_n)[0],
        command_v=volts,
        pressure_pa=None if gauge_kpa is None else gauge_kpa * 1.0e3,
        position_m=None if position_mm is None else position_mm * 1.0e-3,
        covariates=others,
    )


def recorded(
    changes: Mapping[str, float] | None = None,
    columns: tuple[str, ...] = (),
    *,
    seed: int = 1,
    noise_n: float = NOISE_N,
    time_s: Floats | None = None,
    spoil: Callable[[Floats, np.random.Generator], Floats] | None = None,
) -> Measurement:
    """A recording of the machine with these fields changed, white noise on top, and what `spoil` makes of the readings."""
    time_s = times_s() if time_s is None else time_s
    rng = np.random.default_rng(seed)
    logged = {name: LOGGED[name](time_s) for name in columns if name != GAUGE}
    volts = command_v(time_s)
    found = replayed(plant(changes or {}), time_s, volts, logged)
    force_n = found.reading_n[0] + rng.normal(0.0, noise_n, time_s.size)
    if GAUGE in columns:
        logged[GAUGE] = found.pressure_pa[0] * 1.0e-3 + rng.normal(0.0, NOISE_KPA, time_s.size)
    return measurement(time_s, volts, spoil(force_n, rng) if spoil else force_n, logged)
