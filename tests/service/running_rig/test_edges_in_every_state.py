"""Every edge in every state has an answer, and the force and the state of the next five seconds are what the answer says.

Taken means done; an exception means that nothing of the write was taken: the seconds after it are, sample for sample, those
of a rig that nobody has written to.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.registers.words import CalibrationPhase, State
from tests.control.bench import settings
from tests.service.running_rig.simulated_rig import (
    CALIBRATE,
    ENABLE,
    RESET,
    SELF_TEST,
    TAKE,
    TARE,
    VALVE,
    SmallRig,
    with_limits,
)

WATCHED_S = 5.0
LEASE_S = 0.35
R = RefusalReason
HELD, FAULTY, BUSY, GOING, FIT = R.CALIBRATION_REFUSED, R.FAULT_LATCHED, R.CALIBRATING, R.STOPPING, R.FITTING


def rig(leased: bool) -> SmallRig:
    return SmallRig(settings(lease_s=LEASE_S if leased else None))


def local(leased: bool) -> SmallRig:
    begun = rig(leased)
    begun.controller.active_run.ask(CalibrationPlan())
    return begun.until(State.CALIBRATING).run(2.5)


def slow(leased: bool) -> SmallRig:
    """A force that takes seconds to get anywhere."""
    begun = SmallRig(
        replace(
            settings(lease_s=LEASE_S if leased else None), defaults=replace(settings().defaults, force_ramp_n_per_s=5.0)
        )
    )
    begun.write(0, ENABLE, 3000)
    return begun.until(State.RAMPING).run(1.0)


def ending(leased: bool) -> SmallRig:
    """Bit 5 has been cleared, and the ramp takes a while."""
    control = with_limits(settings(lease_s=LEASE_S if leased else None), force_max_n=50.0)
    begun = SmallRig(replace(control, defaults=replace(control.defaults, force_ramp_n_per_s=1.0))).calibrating()
    begun.write(0, 0)
    assert begun.state is State.CALIBRATING
    return begun


def stopping(leased: bool) -> SmallRig:
    begun = slow(leased)
    begun.run(2.0)
    begun.controller.stop()
    return begun.run(0.1)


def fitting(leased: bool) -> SmallRig:
    begun = rig(leased)
    begun.controller.active_run.phase = CalibrationPhase.FITTING
    return begun


def ready(leased: bool) -> SmallRig:
    begun = rig(leased)
    begun.write(0, ENABLE)
    return begun.run(0.3)


STATES: dict[str, Callable[[bool], SmallRig]] = {
    "off": rig,
    "ready": ready,
    "ramping": slow,
    "holding": lambda leased: rig(leased).holding(),
    "fault": lambda leased: rig(leased).faulted(),
    "calibrating": lambda leased: rig(leased).calibrating(),
    "enabled and calibrating": lambda leased: rig(leased).calibrating(ENABLE | CALIBRATE),
    "calibrating here": local,
    "run ended": ending,
    "stopping": stopping,
    "fitting": fitting,
}

EDGES: dict[str, Callable[[SmallRig], tuple[int, ...]]] = {
    # address and words; `stands` is the control word as it reads
    "enable": lambda rig: (0, stands(rig) | ENABLE),
    "enable and force": lambda rig: (0, stands(rig) | ENABLE, 1500),
    "reset": lambda rig: (0, RESET),
    "reset too": lambda rig: (0, stands(rig) | RESET),
    "reset and enable": lambda rig: (0, RESET | ENABLE),
    "tare": lambda rig: (0, TARE),
    "tare too": lambda rig: (0, stands(rig) | TARE),
    "tare and force": lambda rig: (0, stands(rig) | TARE, 1400),
    "enable and tare": lambda rig: (0, ENABLE | TARE),
    "calibrate": lambda rig: (0, CALIBRATE),
    "calibrate too": lambda rig: (0, stands(rig) | CALIBRATE),
    "calibrate and enable": lambda rig: (0, ENABLE | CALIBRATE),
    "calibrate and force": lambda rig: (0, ENABLE | CALIBRATE, 1100),
    "valve": lambda rig: (0, stands(rig) | VALVE),
    "self-test": lambda rig: (0, stands(rig) | SELF_TEST),
    "take over": lambda rig: (0, stands(rig) | TAKE),
    "heartbeat": lambda rig: (0, *rig.block(stands(rig), beat=4711)),
    "force": lambda rig: (1, 1300),
    "ramp": lambda rig: (2, 77),
    "tilt": lambda rig: (6, 10),
}


def stands(rig: SmallRig) -> int:
    return rig.word("control_word")


SAME = "same"
"""Taken, and what the rig does stays what it was."""

ANYWHERE = {"valve": R.UNSUPPORTED_BIT, "self-test": R.UNSUPPORTED_BIT, "take over": SAME, "heartbeat": SAME}
PRESSING = {
    "enable": SAME, "enable and force": State.HOLDING,
    "reset": R.NOTHING_TO_RESET, "reset too": R.NOTHING_TO_RESET, "reset and enable": R.NOTHING_TO_RESET,
    "tare": R.TARE_REFUSED, "tare too": R.TARE_REFUSED, "tare and force": R.TARE_REFUSED, "enable and tare": R.TARE_REFUSED,
    "calibrate": HELD, "calibrate too": HELD, "calibrate and enable": HELD, "calibrate and force": HELD,
    "force": State.HOLDING, "ramp": SAME, "tilt": SAME,
}  # fmt: skip
AT_REST = {
    "calibrate": State.CALIBRATING, "calibrate too": State.CALIBRATING, "calibrate and enable": State.CALIBRATING,
    "calibrate and force": HELD, "ramp": SAME, "tilt": SAME,
}  # fmt: skip
OFF = AT_REST | {
    "enable": State.READY, "enable and force": State.HOLDING, "tare": State.OFF, "tare too": State.OFF,
    "tare and force": State.OFF, "enable and tare": State.READY, "force": State.OFF,
    "reset": SAME, "reset too": SAME, "reset and enable": R.RESET_NEEDS_ZERO,
}  # fmt: skip
READY = AT_REST | {
    "enable": SAME, "enable and force": State.HOLDING, "tare": State.OFF, "tare too": State.READY,
    "tare and force": State.HOLDING, "enable and tare": State.READY, "force": State.HOLDING,
    "reset": R.NOTHING_TO_RESET, "reset too": R.NOTHING_TO_RESET, "reset and enable": R.NOTHING_TO_RESET,
}  # fmt: skip
FAULT = {
    "enable": FAULTY, "enable and force": FAULTY, "reset": State.OFF, "reset too": State.OFF,
    "reset and enable": R.RESET_NEEDS_ZERO, "tare": R.TARE_REFUSED, "tare too": R.TARE_REFUSED,
    "tare and force": R.TARE_REFUSED, "enable and tare": R.TARE_REFUSED, "calibrate": HELD, "calibrate too": HELD,
    "calibrate and enable": FAULTY, "calibrate and force": FAULTY, "force": State.FAULT, "ramp": SAME, "tilt": SAME,
}  # fmt: skip
RUNNING = {name: BUSY for name in EDGES if name not in ANYWHERE} | {"calibrate": SAME, "calibrate too": SAME}
EXPECTED: dict[str, dict[str, object]] = {
    "off": OFF,
    "ready": READY,
    "ramping": PRESSING | {"enable and force": State.HOLDING, "ramp": State.HOLDING, "tilt": SAME},
    "holding": PRESSING,
    "fault": FAULT,
    "calibrating": RUNNING,
    "enabled and calibrating": RUNNING | {"enable": SAME, "calibrate": State.OFF, "calibrate and enable": SAME,
                                          "reset": R.NOTHING_TO_RESET, "tare": R.TARE_REFUSED},
    "calibrating here": RUNNING | {"calibrate": BUSY, "calibrate too": BUSY},
    "run ended": RUNNING | {"calibrate": BUSY, "calibrate too": BUSY},
    "stopping": {name: GOING for name in EDGES if name not in ANYWHERE} | {
        "enable": SAME, "reset": R.NOTHING_TO_RESET, "tare": R.TARE_REFUSED},
    "fitting": OFF | dict.fromkeys(("calibrate", "calibrate too", "calibrate and enable", "calibrate and force"), FIT),
}  # fmt: skip


@dataclass(frozen=True)
class Watched:
    """What a rig does when nobody writes."""

    trace: list[object]
    state: State


_WATCHED: dict[tuple[str, bool], Watched] = {}


def untouched(name: str, leased: bool) -> Watched:
    if (name, leased) not in _WATCHED:
        alone = STATES[name](leased)
        before = len(alone.trace)
        alone.run(WATCHED_S)
        _WATCHED[name, leased] = Watched(alone.trace[before:], alone.state)
    return _WATCHED[name, leased]


def expected(name: str, edge: str, leased: bool) -> object:
    answer = (ANYWHERE | EXPECTED[name])[edge]
    is_stale = leased and name == "fault" and answer is State.OFF
    return R.HEARTBEAT_STALE if is_stale else answer


PLACES = [(name, False) for name in STATES] + [
    (name, True) for name in ("holding", "fault", "calibrating", "run ended")
]


@pytest.mark.parametrize(("name", "leased"), PLACES)
def test_a_refused_edge_is_an_exception_and_the_next_five_seconds_are_as_if_nobody_had_written(
    name: str, leased: bool
) -> None:
    asked = STATES[name](leased)
    before, registers = len(asked.trace), asked.words(0, 13)
    for edge, frame in EDGES.items():
        reason = expected(name, edge, leased)
        if isinstance(reason, RefusalReason):
            refusal = asked.answer(*frame(asked))
            assert refusal is not None, f"{edge} in {name} was taken"
            at = frame(asked)[0] if reason in (BUSY, GOING) else 0
            assert (refusal.reason, refusal.address) == (reason, at), edge
            assert refusal.code in (3, 4, 6)
            assert asked.words(118, 2) == (at, reason)
            assert asked.words(0, 13) == registers
    asked.run(WATCHED_S)
    assert asked.trace[before:] == untouched(name, leased).trace


@pytest.mark.parametrize(("name", "leased"), PLACES)
def test_what_is_taken_and_changes_nothing_of_the_force_changes_nothing(name: str, leased: bool) -> None:
    asked = STATES[name](leased)
    before = len(asked.trace)
    for edge, frame in EDGES.items():
        if expected(name, edge, leased) == SAME:
            assert asked.answer(*frame(asked)) is None, f"{edge} in {name}"
    asked.run(WATCHED_S)
    assert rounded(asked.trace[before:]) == rounded(untouched(name, leased).trace)


def rounded(trace: list[tuple[State, float, float]]) -> list[tuple[State, float, float]]:
    """A decision more in between splits a step of time in two: the same voltage but for the last bit."""
    return [(state, round(voltage_v, 9), round(force_n, 9)) for state, voltage_v, force_n in trace]


@pytest.mark.parametrize(("name", "leased"), PLACES)
def test_a_taken_edge_does_what_it_says(name: str, leased: bool) -> None:
    for edge, frame in EDGES.items():
        answer = expected(name, edge, leased)
        if isinstance(answer, State):
            asked = STATES[name](leased)
            assert asked.answer(*frame(asked)) is None, f"{edge} in {name}"
            asked.until(answer, WATCHED_S)
