"""A plan on a rig: voltages over time, within the limits of that rig, or a sentence why not."""

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Final

from gateway.bsfm import RISING, Bsfm, InverseStatus
from gateway.control.runs.experiment_plan import ExperimentPlan, Move, MoveKind, plan_faults
from gateway.control.runs.ladder_stairs import highest_voltage_v
from gateway.control.settings import Limits

_SLACK_V: Final = 1.0e-9  # shares that add up to one do so but for rounding


@dataclass(frozen=True, slots=True)
class Segment:
    """Evenly to a voltage in over_s (0: at once), then hold_s there. part: index of the plan's."""

    to_v: float
    over_s: float
    hold_s: float
    part: int

    @property
    def duration_s(self) -> float:
        """Duration of the ramp and what is held after it, s."""
        return self.over_s + self.hold_s


@dataclass(frozen=True, slots=True)
class _Range:
    """What the rig may use, and why no more. given_n: contact force that presses besides the slide."""

    limits: Limits
    model: Bsfm
    low_v: float
    top_v: float
    given_n: float

    def level_v(self, move: Move) -> float:
        """ValueError outside the range."""
        if move.to_share is not None:
            return self.low_v + move.to_share * (self.top_v - self.low_v)
        volts, level_text = (
            (move.to_v, f"{move.to_v:g} V") if move.to_v is not None else self._of_force(move.to_n or 0.0)
        )
        return self.check_level_v(float(volts or 0.0), level_text)

    def _of_force(self, force_n: float) -> tuple[float, str]:
        volts, status = self.model.voltage_v(force_n, RISING)
        if status is InverseStatus.HIGH:
            raise ValueError(
                f"{force_n:g} N, allowed up to {self.model.force_n(self.top_v, RISING):.1f} N (calibration in use)"
            )
        return max(volts, self.low_v), f"{force_n:g} N"

    def check_level_v(self, volts: float, level_text: str) -> float:
        """Return a voltage of the plan; ValueError where it is outside the rig's range. level_text: how the plan names it."""
        if not self.low_v - _SLACK_V <= volts <= self.top_v + _SLACK_V:  # nor is nan
            low_n, high_n = (self.model.force_n(end_v, RISING) for end_v in (self.low_v, self.top_v))
            payload = f", of which the payload presses {self.given_n:.1f} N" if self.given_n > 0.0 else ""
            raise ValueError(
                f"{level_text}, allowed {self.low_v:g} .. {self.top_v:g} V (about {max(0.0, low_n):.0f} .. {high_n:.0f} N): "
                f"beyond lie the rig's limits (force_max_n = {self.limits.force_max_n:g} N{payload}), the end of the "
                f"calibration in use, or the over-force trip at {self.limits.over_force_n:g} N"
            )
        return min(max(volts, self.low_v), self.top_v)


def segments_of(plan: ExperimentPlan, limits: Limits, model: Bsfm, given_n: float = 0.0) -> tuple[Segment, ...]:
    """Return the whole plan in volts. given_n: what presses besides the slide. ValueError with a sentence for a plan that the
    rig does not allow, or that is none."""
    for _, sentence in plan_faults(plan):
        raise ValueError(f"plan {plan.name}: {sentence}")
    usable = _Range(limits, model, limits.voltage_min_v, highest_voltage_v(limits, model, given_n), given_n)
    segments: list[Segment] = []
    at_v = usable.low_v
    for p, part in enumerate(plan.parts):
        for m, move in enumerate(part.moves):
            try:
                candidates = list(_segments_of_move(move, at_v, usable, p))
            except ValueError as error:
                raise ValueError(f"plan {plan.name}, part {part.name}, move {m + 1} ({move.do}): {error}") from None
            segments += candidates
            at_v = segments[-1].to_v
    return tuple(segments)


def _segments_of_move(move: Move, at_v: float, usable: _Range, part: int) -> Iterator[Segment]:
    over_s, hold_s = move.over_s or 0.0, move.hold_s or 0.0
    if move.do is MoveKind.DWELL:
        yield Segment(at_v, 0.0, hold_s, part)
    elif move.do is MoveKind.REVERSALS:
        yield from _swings(move, at_v, usable, part)
    elif move.do is MoveKind.LADDER:
        goal_v, stairs = usable.level_v(move), move.stairs or 1
        for k in range(1, stairs + 1):
            yield Segment(at_v + (goal_v - at_v) * k / stairs, 0.0, hold_s, part)
    else:
        yield Segment(usable.level_v(move), over_s, hold_s, part)


def _swings(move: Move, at_v: float, usable: _Range, part: int) -> Iterator[Segment]:
    """Up first; from level to turn takes half of over_s, so that the speed is the same throughout."""
    size_v = move.size_v if move.size_v is not None else (move.size_share or 0.0) * (usable.top_v - usable.low_v)
    over_s, hold_s = move.over_s or 0.0, move.hold_s or 0.0
    turns = [
        usable.check_level_v(turn_v, f"{size_v:.3g} V around {at_v:.3g} V")
        for turn_v in (at_v + size_v / 2.0, at_v - size_v / 2.0)
    ]
    for k in range(2 * (move.times or 0)):
        yield Segment(turns[k % 2], over_s if k else over_s / 2.0, hold_s, part)
    yield Segment(at_v, over_s / 2.0, 0.0, part)


class Schedule:
    """Voltage over time, from the first segment's start on."""

    def __init__(self, segments: tuple[Segment, ...], from_v: float) -> None:
        self.segments = segments
        self._starts_s = [0.0, *accumulate(segment.duration_s for segment in segments)]
        self._from_v = [from_v, *(segment.to_v for segment in segments)]
        self._ways: list[int] = []
        for before_v, after_v in pairwise(self._from_v):
            last = self._ways[-1] if self._ways else 1
            self._ways.append((after_v > before_v) - (after_v < before_v) or last)

    @property
    def duration_s(self) -> float:
        """Duration of all segments, s."""
        return self._starts_s[-1]

    @property
    def top_v(self) -> float:
        """Highest voltage of the schedule, V."""
        return max(segment.to_v for segment in self.segments)

    def index(self, elapsed_s: float) -> int:
        """Return the index of the segment that runs at this time; the last one's after the end."""
        return min(bisect_right(self._starts_s, elapsed_s) - 1, len(self.segments) - 1)

    def voltage_v(self, elapsed_s: float) -> float:
        """Return the voltage, V, so long after the start."""
        k = self.index(elapsed_s)
        segment, since_s = self.segments[k], elapsed_s - self._starts_s[k]
        if since_s >= segment.over_s:
            return segment.to_v
        return self._from_v[k] + (segment.to_v - self._from_v[k]) * since_s / segment.over_s

    def direction(self, elapsed_s: float) -> int:
        """Return +1 when the voltage last rose, -1 when it last fell."""
        return self._ways[self.index(elapsed_s)]


@lru_cache(maxsize=4)
def schedule_of(plan: ExperimentPlan, limits: Limits, model: Bsfm, given_n: float) -> Schedule:
    """Return the voltage over time of a plan on a rig. ValueError as `segments_of`. Kept: from the request to its begin a run
    is made four times, and all of them within one turn of the loop."""
    return Schedule(segments_of(plan, limits, model, given_n), limits.safe_voltage_v)
