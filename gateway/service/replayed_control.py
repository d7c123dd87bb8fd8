"""Plays a recording's commands and readings through the control code again, in virtual time, and tells what differs.

Open loop: the readings are the recorded ones, whatever voltage is decided on now. What a recording does not hold is known
only roughly: when between two rows a command came, and how long the wire was busy.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import ceil, isfinite, nan
from typing import TYPE_CHECKING, Final

import numpy as np

from gateway.bsfm.model import Calibration
from gateway.control import Controller
from gateway.control.inputs import LineStatus, Output
from gateway.control.limits import TICK_S
from gateway.devices.messages import ForceSample, Quality
from gateway.profiles import Rig
from gateway.progress import report
from gateway.recording import Recording, RecordingError
from gateway.recording.calibrations_used import numbers_by_row
from gateway.recording.tables.row_validity import pulled_rows
from gateway.recording.tables.time_axis import check_time_axis, gaps_of
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, State

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BEGIN_S: Final = 1000.0  # of virtual time
_REPORTED_ROWS: Final = 500
_PHASE: Final = 0.5  # of a tick, behind a row: nobody knows it. One within a period leaves the decision to the row
_LONGEST_GAP_S: Final = 5.0  # between two rows: behind it nothing new is decided
_AT_ROW: Final = 0.05  # of a tick: one that is so near to the next row is that row's
_SENT_DIGITS: Final = 4  # of the time of a setting, s: by each row that tells it
_LEAST_SENT: Final = 10
_ENABLED: Final = frozenset([State.READY, State.RAMPING, State.HOLDING])
_NEEDED: Final = ("time_s", "force_n", "setpoint_n", "state", "command_v")
_QUALITY: Final = {0: Quality.OK, 1: Quality.UNSTABLE, 2: Quality.OVERLOAD}
SIGNALS: Final = {"command_v": "V", "feedforward_v": "V", "trim_v": "V", "applied_n": "N", "model_residual_n": "N"}
"""Numbers that are compared, with their unit."""
WORDS: Final = ("state", "fault_code", "limited_by")
"""What is equal or not."""
Columns = dict[str, "NDArray[np.float64]"]


@dataclass(frozen=True, slots=True)
class ReplaySetup:
    """What decides. name: as it is told; later: what the recording itself went over to, by number."""

    name: str
    rig: Rig
    calibration: Calibration
    later: Mapping[int, Calibration] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SignalDifference:
    """How one signal differs. rms, largest: of a number, nan of a word; rows: that differ; at_s: of the largest, of a word the
    first; nan where nothing does."""

    signal: str
    unit: str
    rms: float
    largest: float
    rows: int
    at_s: float


def replay_control(recording: Recording, setup: ReplaySetup) -> Columns:
    """Return what control decides at each row with this set-up. RecordingError for what cannot be replayed."""
    _check(recording)
    supervision = replace(setup.rig.control.supervision, lease_s=None)
    controller = Controller(
        replace(setup.rig.control, supervision=supervision, valve=None),  # whose readback no recording holds
        setup.rig.calibration_in_use(setup.calibration),
        compensation=replace(setup.rig.compensation, cell=None),  # the recorded force is the corrected one
    )
    rows: list[tuple[float, ...]] = []
    for done, output in enumerate(_decide_all(recording, controller, setup)):
        if done % _REPORTED_ROWS == 0:
            report(f"control with {setup.name}", done, recording.rows)
        rows.append(_row_of(output))
    table = np.array(rows)
    return {name: table[:, at] for at, name in enumerate((*SIGNALS, *WORDS))}


def tell_missing_rows(recording: Recording) -> str:
    """Return where rows are missing and what is decided there, as a sentence; empty where none are."""
    _rows, told = gaps_of(recording.columns["time_s"])
    until_s = f"for at most {_LONGEST_GAP_S:.0f} s"
    return (
        told
        and f"{told}: control is replayed there with the reading before, {until_s}, and what it decides differs by that"
    )


def _check(recording: Recording) -> None:
    missing = [name for name in _NEEDED if name not in recording.columns]
    if missing or recording.rows < 2:
        what = f"has no column {', '.join(missing)}" if missing else f"has {recording.rows} rows"
        raise RecordingError(f"{recording.path} {what}: only a recording of a gateway's own work can be replayed")
    for name in ("time_s", "state"):
        if len(unknown := np.flatnonzero(~np.isfinite(recording.columns[name]))):
            raise RecordingError(
                f"{recording.place(int(unknown[0]))} has no {name}: nobody knows what control was asked for"
            )
    check_time_axis(recording)
    if np.any(recording.columns["state"] == State.CALIBRATING):
        raise RecordingError(
            f"{recording.path} holds a ladder, a plan or a self-test: its commands came from a run and not from a master, "
            "and are not in it"
        )
    if pulled := int(pulled_rows(recording.columns).sum()):
        raise RecordingError(
            f"{recording.path} holds {pulled} rows in which the tool pulled: when its valve switched is not in it, and control"
            " is replayed pushing"
        )


def _decide_all(recording: Recording, controller: Controller, setup: ReplaySetup) -> Iterator[Output]:
    columns = recording.columns
    lists = {name: columns[name].tolist() for name in _NEEDED}
    qualities = columns["quality"].tolist() if "quality" in columns else [0.0] * recording.rows
    sent, wire_s, since_command = _sent_before(columns, recording.rows), _wire_s(columns), _since_command_s(columns)
    first_s, command, changes = lists["time_s"][0], Command(), _changes(recording, setup)
    period_s = 1.0 / setup.rig.loop_hz
    rows = zip(lists["time_s"], lists["force_n"], lists["setpoint_n"], lists["state"], qualities, sent, strict=True)
    for at, (time_s, force_n, setpoint_n, state, quality, sent_v) in enumerate(rows):
        if at in changes:
            controller.use(setup.rig.calibration_in_use(changes[at]))
        now_s = _BEGIN_S + time_s - first_s
        sample = ForceSample(force_n, force_n, _QUALITY.get(quality, Quality.OK), now_s)
        line = LineStatus(acknowledged_v=sent_v or 0.0, sent_v=sent_v, wire_s=wire_s)
        if at == 0:  # as before an enable: a reading is there
            before_s = now_s - 0.01
            controller.step(before_s, command, replace(sample, time_s=before_s), line)
            last = sample, line
        came_s = now_s - since_command[at]
        following = _next_command(command, setpoint_n, int(state) in _ENABLED, controller, came_s)
        if following is not command and at and came_s < now_s:
            _tick(controller, (before_s, came_s, period_s), command, last)
            controller.step(came_s, following, *last)  # on arrival, with what was known then
            before_s = came_s
        _tick(controller, (before_s, now_s, period_s), following, last)
        command, last, before_s = following, (sample, line), now_s
        yield controller.step(now_s, command, *last)


def _tick(
    controller: Controller, span_s: tuple[float, float, float], command: Command, known: tuple[ForceSample, LineStatus]
) -> None:
    """Decide at the ticks between two rows of a slow cell, as the loop does (service/running_rig/control_loop.py): a ramp goes
    on meanwhile. span_s: from and to when, and the period; known: the reading and the line, as far as they are."""
    (from_s, until_s, period_s), (sample, line) = span_s, known
    gap_s = min(until_s - from_s, _LONGEST_GAP_S)
    for tick in range(1, ceil(gap_s / period_s - _PHASE - _AT_ROW)):
        controller.step(from_s + (tick + _PHASE) * period_s, command, sample, line._replace(sent_v=None))


def _changes(recording: Recording, setup: ReplaySetup) -> dict[int, Calibration]:
    """Return, by row, the calibration that is in use from there on."""
    numbers = numbers_by_row(recording)
    if numbers is None or not setup.later:
        return {}
    changed = (np.flatnonzero(np.diff(numbers)) + 1).tolist()
    return {row: setup.later[number] for row in changed if (number := numbers[row]) in setup.later}


def _next_command(command: Command, setpoint_n: float, enabled: bool, controller: Controller, now_s: float) -> Command:
    """Return the command that the master had written by then, by what the row shows."""
    if enabled and command.control_word and controller.state is State.FAULT:
        return command  # which the recording has not seen: nothing more is done until it is enabled anew there
    word, force_n = (ControlBit.ENABLE, setpoint_n) if enabled else (ControlBit(0), 0.0)
    if enabled and not command.control_word and controller.state is State.FAULT:
        word |= ControlBit.RESET_FAULT
    is_same = (word, force_n) == (command.control_word & ~ControlBit.RESET_FAULT, command.force_setpoint_n)
    if is_same or not isfinite(force_n):
        return command
    return Command(
        control_word=word, force_setpoint_n=force_n, number=command.number + 1, received_s=now_s, peer="recording"
    )


def _since_command_s(columns: Columns) -> list[float]:
    """Return how long before each row a command came, if one came since the row before: the ramp has gone on as long, and a
    tick of it was gone at once."""
    time_s, applied_n = columns["time_s"], columns.get("applied_n", columns["setpoint_n"])
    dt_s, moved_n = np.diff(time_s, prepend=time_s[:1]), np.abs(np.diff(applied_n, prepend=applied_n[:1]))
    rate = np.append(moved_n[1:] / np.maximum(dt_s[1:], 1e-6), 0.0)  # of the row after it
    ramped_s = np.divide(moved_n, rate, out=dt_s + TICK_S, where=rate > 0.0)
    since_s: list[float] = np.clip(ramped_s - TICK_S, 0.0, dt_s).tolist()
    return since_s


def _wire_s(columns: Columns) -> float:
    """Return how long one setting keeps the wire: the shortest time between two; nan where too few were sent."""
    if "sent_age_s" not in columns:
        return nan
    sent_s = columns["time_s"] - columns["sent_age_s"]
    gaps_s = np.diff(np.unique(np.round(sent_s[np.isfinite(sent_s)], _SENT_DIGITS)))
    return float(gaps_s.min()) if len(gaps_s) >= _LEAST_SENT else nan


def _sent_before(columns: Columns, rows: int) -> list[float | None]:
    """Return, of each row, the last voltage that the wire had taken when control decided; None where nobody knows."""
    if not {"sent_v", "sent_age_s"} <= set(columns):
        return [None] * rows
    sent_v = columns["sent_v"]
    before_v = np.where(columns["sent_age_s"] > 0.0, sent_v, np.concatenate([sent_v[:1], sent_v[:-1]]))
    return [value if isfinite(value) else None for value in before_v.tolist()]


def _row_of(output: Output) -> tuple[float, ...]:
    numbers = (output.voltage_v, output.feedforward_v, output.trim_v, output.force_applied_n, output.model_residual_n)
    return (*numbers, float(output.state), float(output.fault), float(output.limited_by))


def compare_decisions(time_s: "NDArray[np.float64]", one: Columns, other: Columns) -> list[SignalDifference]:
    """Return how the second differs from the first, by signal; of signals that both have."""
    both = [name for name in (*SIGNALS, *WORDS) if name in one and name in other]
    return [_difference(name, time_s, other[name] - one[name]) for name in both]


def _difference(name: str, time_s: "NDArray[np.float64]", by: "NDArray[np.float64]") -> SignalDifference:
    by = np.where(np.isfinite(by), by, 0.0)  # a residual that only one of them knows
    differing = np.flatnonzero(by)
    unit, seconds = SIGNALS.get(name, ""), time_s - time_s[0]
    if name in WORDS:
        first_s = float(seconds[differing[0]]) if len(differing) else nan
        return SignalDifference(name, unit, nan, nan, len(differing), first_s)
    at = int(np.abs(by).argmax())
    rms, at_s = float(np.sqrt(np.mean(by**2))), float(seconds[at]) if len(differing) else nan
    return SignalDifference(name, unit, rms, float(by[at]), len(differing), at_s)
