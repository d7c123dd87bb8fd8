"""A machine that shares nothing with the twin: LuGre friction in steps of 0.1 ms, a second-order underdamped regulator, a pad
that hardens, and noise of its own. Fourteen effects can be switched on, each by one number that is zero where it is off.

Sources: Canudas de Wit et al., A new model for control of systems with friction, IEEE TAC 40 (1995), for the friction.
"""

from dataclasses import dataclass, field
from typing import Final

import numba
import numpy as np
from numpy.typing import NDArray

from gateway.diagnosis.measurement import Measurement

Floats = NDArray[np.float64]
ROW_S: Final = 5.0e-3
NOISE_N: Final = 0.1
EFFECTS: Final = (
    "transport-delay",
    "slew-limit",
    "regulator-hysteresis",
    "dead-band",
    "leak",
    "supply-droop",
    "presliding",
    "dwell-stiction",
    "position-friction",
    "creep",
    "sensor-quadratic",
    "thermal-zero-drift",
    "outliers",
    "sensor-quantisation",
)
_MARCHED: Final = EFFECTS[:9]  # the rest is in the readings


@numba.njit(cache=True)
def _march(command_v: Floats, path_mm: Floats, supply_kpa: Floats, sizes: Floats) -> Floats:
    """Contact force at each row, N. sizes: of the marched effects, in the order of EFFECTS."""
    delay_s, slew, play, band, leak, droop, presliding, stiction, place = sizes
    sub, rows = 50, command_v.size
    dt, wn, zeta = 1.0e-4, 17.0, 0.72
    fc, fs, vs, sig1, sig2 = 1.6, 2.0, 2.0e-3, 60.0, 25.0
    sig0 = 3.0e4 / (1.0 + presliding)
    mass, kc, cc, back = 0.6, 3.5e4, 150.0, 0.6
    late = int((0.05 + delay_s) / dt)
    x = v = z = p = pd = rest_s = 0.0
    held = noticed = before = command_v[0] * 0.9e5
    since_s = 0.0
    force = np.empty(rows)
    for row in range(rows):
        force_now = 0.0
        for k in range(sub):
            at = row * sub + k - late
            asked = command_v[max(at, 0) // sub] * 0.9e5
            if abs(asked - noticed) > band:
                noticed = asked
            held = min(max(held, noticed - 0.5 * play), noticed + 0.5 * play)
            if noticed != before:
                before, since_s = noticed, 0.0
            since_s += dt
            want = held * np.exp(-leak * since_s) + droop * (supply_kpa[row] - 600.0) * 1.0e3
            acc_p = wn * wn * (want - p) - 2.0 * zeta * wn * pd
            pd += acc_p * dt
            rate = pd if slew == 0.0 else min(max(pd, -1.0e6 / slew), 1.0e6 / slew)
            p += rate * dt
            rest_s += (dt if abs(v) < 1.0e-4 else 0.0) - rest_s * abs(v) * dt / 2.0e-4
            scale = 1.0 + place * path_mm[row]
            limit = scale * (fc + (fs + stiction * (1.0 - np.exp(-rest_s / 2.0)) - fc) * np.exp(-((v / vs) ** 2)))
            zd = v - abs(v) * z * sig0 / limit
            friction = sig0 * z + sig1 * zd + sig2 * v
            contact = max(kc * x * (1.0 + 40.0 * x) + cc * v, 0.0) if x > 0.0 else 0.0
            v += (p * 1.0e-4 - back - friction - contact) / mass * dt
            x += v * dt
            z += zd * dt
            if x < -2.0e-3:
                x, v = -2.0e-3, max(v, 0.0)
            force_now = contact
        force[row] = force_now
    return force


def commands(duration_s: float, rng: np.random.Generator) -> Floats:
    """A working day in a minute: steps, ramps, small reversals around a level, rests of different length; V."""
    parts: list[Floats] = [np.full(200, 0.6)]
    level, rows = 0.6, round(duration_s / ROW_S)
    while sum(part.size for part in parts) < rows:
        kind, target = rng.integers(0, 5), float(rng.uniform(0.5, 5.0))
        if kind == 0:
            parts.append(np.full(int(rng.uniform(0.3, 1.2) / ROW_S), target))
        elif kind == 1:
            ramp = np.linspace(level, target, max(int(abs(target - level) / rng.uniform(0.4, 4.0) / ROW_S), 2))
            parts.append(ramp)
        elif kind == 2:
            swing = float(rng.uniform(0.1, 0.8))
            for turn in range(int(rng.integers(2, 5))):
                end = target + swing * (0.7**turn) * (-1.0) ** turn
                parts.append(np.linspace(level, end, max(int(abs(end - level) / 1.0 / ROW_S), 2)))
                level = end
            target = level
        elif kind == 3:
            stairs = level + (target - level) * np.arange(1, 7) / 6.0
            parts.append(np.repeat(stairs, int(rng.uniform(0.15, 0.4) / ROW_S)))
        else:
            parts.append(np.full(int(rng.uniform(1.0, 4.0) / ROW_S), level))
            target = level
        level = target
    return np.concatenate(parts)[:rows]


def slow_wave(rows: int, rng: np.random.Generator, period_s: tuple[float, float]) -> Floats:
    """Two slow sines of random phase, amplitude 1 together."""
    seconds = np.arange(rows) * ROW_S
    waves = [np.sin(2.0 * np.pi * (seconds / rng.uniform(*period_s) + rng.random())) for _ in range(2)]
    return np.asarray(0.6 * waves[0] + 0.4 * waves[1])


@dataclass(frozen=True)
class Wish:
    """What to record. effect: empty for a quiet recording; size: over the noise, RMS of what it does to the readings that gain,
    offset, time and friction cannot take."""

    seed: int
    effect: str = ""
    size: float = 1.0
    duration_s: float = 60.0
    noise_n: float = NOISE_N
    columns: tuple[str, ...] = field(default=())


@dataclass(frozen=True)
class Day:
    """What goes in: commands and surroundings."""

    command_v: Floats
    path_mm: Floats
    supply_kpa: Floats
    temperature_c: Floats


def record(wish: Wish) -> tuple[Measurement, float]:
    """Return a recording, and the amount of the effect that has the size."""
    rng = np.random.default_rng([812, wish.seed])
    command_v = commands(wish.duration_s, rng)
    rows = command_v.size
    day = Day(
        command_v,
        30.0 * slow_wave(rows, rng, (7.0, 15.0)),
        600.0 + 40.0 * slow_wave(rows, rng, (8.0, 25.0)),
        22.0 + 4.0 * slow_wave(rows, rng, (25.0, 60.0)),
    )
    noise = _noise(rows, rng, wish.noise_n)
    amount = _amount(day, wish, noise) if wish.effect else 0.0
    force_n = readings(day, wish.effect, amount, noise)
    columns = {"temperature_c": day.temperature_c, "supply_kpa": day.supply_kpa}
    has_path = "position_mm" in wish.columns
    return (
        Measurement(
            name=f"{wish.effect or 'quiet'}-{wish.seed}",
            time_s=np.arange(rows) * ROW_S,
            force_n=force_n,
            usable=np.ones(rows, dtype=bool),
            repeated=np.zeros(rows, dtype=bool),
            command_v=command_v,
            position_m=day.path_mm * 1.0e-3 if has_path else None,
            covariates={name: values for name, values in columns.items() if name in wish.columns},
        ),
        amount,
    )


def readings(day: Day, effect: str, amount: float, noise_n: Floats) -> Floats:
    """What the load cell says, N, with one effect switched on."""
    sizes = np.zeros(len(_MARCHED))
    if effect in _MARCHED:
        sizes[_MARCHED.index(effect)] = amount
    force = _march(day.command_v, day.path_mm, day.supply_kpa, sizes) + 0.4
    if effect == "sensor-quadratic":
        force = force + amount * force**2
    elif effect == "creep":
        force = force + amount * _follow(force, 6.0)  # a cell under load: at once what it was, and more with time
    elif effect == "thermal-zero-drift":
        force = force + amount * (day.temperature_c - 22.0)
    reading = force + noise_n
    if effect == "outliers":
        rng = np.random.default_rng(5)
        spikes = rng.random(force.size) < 0.004
        reading = reading + spikes * amount * np.where(rng.random(force.size) < 0.5, -1.0, 1.0)
    elif effect == "sensor-quantisation" and amount > 0.0:
        reading = np.round(reading / amount) * amount
    return np.asarray(reading)


def _follow(series: Floats, lag_s: float) -> Floats:
    """Behind a first-order lag."""
    keep, state, late = float(np.exp(-ROW_S / lag_s)), float(series[0]), np.empty_like(series)
    for row, value in enumerate(series.tolist()):
        state = value + keep * (state - value)
        late[row] = state
    return late


def _noise(rows: int, rng: np.random.Generator, noise_n: float) -> Floats:
    """White, and a tenth of its power from a wander of 0.2 s."""
    keep = float(np.exp(-ROW_S / 0.2))
    white = rng.standard_normal(rows)
    wander = _follow(rng.standard_normal(rows), 0.2) * np.sqrt((1.0 + keep) / (1.0 - keep))
    return np.asarray(noise_n * (np.sqrt(0.9) * white + np.sqrt(0.1) * wander))


def _amount(day: Day, wish: Wish, noise: Floats) -> float:
    """The amount that leaves the size asked for, by bisection on its logarithm."""
    quiet = readings(day, "", 0.0, np.zeros_like(noise))
    low, high = 1.0e-7, 1.0e6
    high = {
        "leak": 3.0,
        "creep": 0.9,
        "transport-delay": 0.3,
        "position-friction": 0.03,
        "presliding": 50.0,
        "dwell-stiction": 10.0,
        "sensor-quantisation": 5.0,
    }.get(wish.effect, high)
    for _ in range(40):
        amount = float(np.sqrt(low * high))
        with np.errstate(all="ignore"):
            change = readings(day, wish.effect, amount, np.zeros_like(noise)) - quiet
        is_more = not np.all(np.isfinite(change)) or _what_is_left(change, quiet) > wish.size * wish.noise_n
        low, high = (low, amount) if is_more else (amount, high)
        if high < 1.02 * low:
            break
    return float(np.sqrt(low * high))


def _what_is_left(change: Floats, quiet: Floats) -> float:
    """RMS without what a refit of gain, offset, lag and friction would take."""
    rate = np.gradient(quiet)
    columns = np.vstack([np.ones_like(quiet), quiet, rate, np.gradient(rate), np.sign(rate)])
    taken = np.linalg.lstsq(columns.T, change, rcond=None)[0]
    return float(np.sqrt(np.mean((change - taken @ columns) ** 2)))
