"""What the regulator's physics allows: the fastest that any command within 0 .. 10 V brings the force into a band.

Two numbers per target, on the paper's rig with the pad lifted, by simulation of the twin:
- `entered_s`, a bound that nothing beats: 10 V from the first moment, until the force enters the band. More command is
  more pressure and more force at every later moment (but for the pad's damped ringing), so no other command within
  range enters earlier. The supply cuts it at 0.85 MPa.
- `settled_s`, what the best bang-bang command reaches: 10 V for t1, 0 V for t2, then the voltage that holds the force.
  Two lags in series need one switch down (bang-bang principle), so the grid of t1 and t2 is the whole family. No pulse is
  shorter than 10 ms: that is a SET command and its answer at 9600 baud. The 10-bit steps are the twin's own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from gateway.twin import STEP_S, Drive, Plant
from gateway.twin.experiment import Floats, settling_time_s
from gateway.twin.replay.drive import AT_REST
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.loops import march_slide
from gateway.twin.replay.regulator import Pressures
from gateway.twin.slide import SlideState, slide_of, without_motion
from paper.experiments.rigs import lift_pad

HIGH_V: Final = 10.0
DURATION_S: Final = 0.6
UP_MS: Final = tuple(range(10, 181, 4))
DOWN_MS: Final = (0, *range(10, 101, 6))


@dataclass(frozen=True, slots=True)
class Fastest:
    """Seconds after the command for one target and band; nan where no command of the family settles."""

    target_n: float
    band_n: float
    entered_s: float
    settled_s: float
    up_ms: int
    down_ms: int


def responses(plant: Plant, commands_v: Floats) -> Floats:
    """Return the force every millisecond for commands every millisecond, both (steps, lanes): the twin's steps, compiled."""
    slide = slide_of(lift_pad(plant))
    time_s = np.arange(len(commands_v) + 1) * STEP_S
    force_n = np.empty_like(commands_v)
    for lane, command_v in enumerate(commands_v.T):
        drive = Drive(time_s=time_s, command_v=np.append(command_v, command_v[-1]))
        grid = Grid(drive, STEP_S)
        (pressure_pa,), _ = Pressures(drive, grid).of([plant.regulator], [AT_REST])
        moved_n = np.empty(grid.points)
        start = (slide, without_motion(slide))
        nothing_n = np.zeros(grid.points)
        march_slide(start, SlideState(), (slide.area_m2 * pressure_pa, nothing_n, nothing_n), grid.steps_s, moved_n)
        force_n[:, lane] = moved_n[1:]
    return force_n


def bang_bang_v(pulses: Sequence[tuple[int, int]], hold_v: float) -> Floats:
    """Return 10 V, 0 V, hold: one lane per (up ms, down ms)."""
    ms = np.arange(round(DURATION_S * 1000))[:, None]
    up, down = (np.array(column) for column in zip(*pulses, strict=True))
    return np.where(ms < up, HIGH_V, np.where(ms < up + down, 0.0, hold_v))


def useful_pulses(plant: Plant, target_n: float, full_n: Floats) -> list[tuple[int, int]]:
    """Return the part of the grid that may be fast: 10 V for no longer than until the force stands at the target."""
    delay_ms = plant.regulator.delay_s * 1000
    reached_ms = float(np.argmax(full_n >= target_n)) - delay_ms
    return [(up, down) for up in UP_MS if 0.2 * reached_ms <= up <= reached_ms + 8 for down in DOWN_MS]


def holding_v(plant: Plant, target_n: ArrayLike) -> Floats:
    """Return the voltage whose steady force on a rising approach is the target, of one or of many: the twin's own statics,
    not a model's."""
    trial_v = np.linspace(0.5, 6.0, 240)
    settled_n = responses(plant, np.tile(trial_v, (1500, 1)))[-1]
    return np.asarray(np.interp(target_n, settled_n, trial_v))


def fastest(plant: Plant, target_n: float, bands_n: Sequence[float], hold_v: float, full_n: Floats) -> list[Fastest]:
    """Search the fastest command for one target in every band. full_n: the response to 10 V."""
    pulses = useful_pulses(plant, target_n, full_n)
    force_n = responses(plant, bang_bang_v(pulses, hold_v))
    rows = []
    for band_n in bands_n:
        times_s = np.array([settling_time_s(column, target_n, band_n) for column in force_n.T])
        best = int(np.argmin(np.where(np.isnan(times_s), np.inf, times_s)))
        entered_s = int(np.argmax(full_n >= target_n - band_n)) * 1.0e-3
        rows.append(Fastest(target_n, band_n, entered_s, float(times_s[best]), *pulses[best]))
    return rows


def limits(plant: Plant, targets_n: Sequence[float], bands_n: Sequence[float]) -> list[Fastest]:
    """Search the fastest command for every target and band."""
    full_n = responses(plant, np.full((round(DURATION_S * 1000), 1), HIGH_V))[:, 0]
    holds_v = holding_v(plant, targets_n).tolist()
    rows = [
        fastest(plant, target_n, bands_n, hold_v, full_n) for target_n, hold_v in zip(targets_n, holds_v, strict=True)
    ]
    return [row for group in rows for row in group]
