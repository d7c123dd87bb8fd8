"""A change of state by itself, its parts played: what it starts, what it lets go of, and what of it is kept."""

from types import SimpleNamespace
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.control import CalibrationInUse, Controller
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.settings import LeaseAction
from gateway.control.supervision.fault_detection import StopCause
from gateway.control.transitions import ControllerParts, StepOutcome, Transitions
from gateway.registers.words import ControlBit, Mode, State
from tests.control.bench import Bench, bsfm, settings

STALE = StopCause(FaultCode.SAMPLE_STALE, "A311 stale")


class Parts:
    """Everything that a change acts on, and what it was told."""

    def __init__(self, *, is_running: bool = False, has_moved: bool = True, is_restarted: bool = True) -> None:
        self.did: list[str] = []
        note = self.did.append
        run = SimpleNamespace(
            running=is_running, kind="calibration", rest=lambda fault: note("run.rest"), take_report=lambda: ("report",),
            leave=lambda loop, given_n: note("run.leave"), begin=lambda plan, is_local: note("run.begin"),
        )  # fmt: skip
        commands = SimpleNamespace(
            who="10.0.0.1", start_lease=lambda now_s: note("lease"), expect_clearing=lambda: note("clearing"),
            has_moved=has_moved, let_no_beat_count=lambda: note("no beat counts"),
        )  # fmt: skip
        parts: Any = ControllerParts(
            commands,  # type: ignore[arg-type]
            SimpleNamespace(start=lambda: note("faults")),  # type: ignore[arg-type]
            SimpleNamespace(start=lambda: note("one_shot")),  # type: ignore[arg-type]
            SimpleNamespace(rest=lambda: note("loop.rest")),  # type: ignore[arg-type]
            run,  # type: ignore[arg-type]
        )
        self.machine = Transitions(parts, is_restarted=is_restarted)


def enabled(**running: bool) -> Parts:
    parts = Parts(**running)
    parts.machine.enable(1.0)
    parts.did.clear()
    return parts


def test_whatever_begins_begins_anew_and_acknowledges_a_restart() -> None:
    for begin in ("enable", "run"):
        parts = Parts()
        if begin == "enable":
            parts.machine.enable(1.0)
        else:
            parts.machine.begin_run(1.0, CalibrationPlan(), "10.0.0.1")
        assert parts.did == ["run.begin"] * (begin == "run") + ["faults", "one_shot", "lease"]
        assert parts.machine.is_enabled and not parts.machine.is_restarted


def test_the_first_fault_stays_whatever_breaks_behind_it() -> None:
    parts = enabled()
    parts.machine.fail(2.0, STALE)
    parts.did.clear()
    parts.machine.fail_internally(3.0)
    assert (parts.machine.fault, parts.machine.faulted_s) == (FaultCode.SAMPLE_STALE, 2.0)
    assert parts.did == ["loop.rest", "run.rest", "clearing"], "the safe voltage all the same"
    parts = enabled()
    parts.machine.fail_internally(3.0)
    assert (parts.machine.state, parts.machine.fault, parts.machine.faulted_s) == (State.FAULT, FaultCode.INTERNAL, 3.0)


def test_a_reset_of_a_fault_acknowledges_a_restart() -> None:
    parts = Parts()
    parts.machine.fail(2.0, STALE)
    assert parts.machine.is_restarted, "by itself it does not"
    parts.machine.reset()
    assert (parts.machine.state, parts.machine.fault) == (State.OFF, FaultCode.NONE)
    assert not parts.machine.is_restarted


def test_at_the_end_of_a_way_to_0_no_beat_of_before_counts_any_more() -> None:
    """What was written on that way with enable at 1 would be a rise behind it."""
    parts = enabled()
    parts.machine.end_ramp()
    assert parts.did == ["no beat counts", "loop.rest", "run.rest", "clearing"]


def test_a_reset_in_off_is_the_device_s_alone_and_acknowledges_no_restart() -> None:
    machine = Parts().machine
    machine.reset()
    assert machine.outcome.resets_device and machine.is_restarted and machine.state is State.OFF
    parts = enabled()
    parts.machine.fail(2.0, STALE)
    parts.machine.reset()
    assert (parts.machine.state, parts.machine.fault) == (State.OFF, FaultCode.NONE)


@pytest.mark.parametrize(
    ("was_ramping", "action", "is_running", "ramps"),
    [
        (False, LeaseAction.HOLD, False, False),
        (True, LeaseAction.HOLD, False, True),
        (False, LeaseAction.RAMP, False, True),
        (False, LeaseAction.HOLD, True, True),
    ],
)
def test_a_lost_master_ends_no_way_to_0_and_leaves_no_run_alone(
    was_ramping: bool, action: LeaseAction, is_running: bool, ramps: bool
) -> None:
    parts = enabled(is_running=is_running)
    parts.machine.is_ramping_down = was_ramping
    parts.machine.lose_master(2.0, "no heartbeat", action)
    assert parts.machine.is_master_lost and parts.machine.is_ramping_down is ramps
    assert parts.machine.outcome.release_owner
    assert ("ramping to 0 N" if ramps else "holding") in parts.machine.outcome.events[-1]


@pytest.mark.parametrize(
    ("is_restarted", "has_moved", "ramps"), [(True, False, True), (True, True, False), (False, False, False)]
)
def test_behind_a_restart_nothing_is_held_for_who_may_have_hung_before(
    is_restarted: bool, has_moved: bool, ramps: bool
) -> None:
    parts = enabled(is_restarted=is_restarted, has_moved=has_moved)
    parts.machine.lose_master(2.0, "no heartbeat", LeaseAction.HOLD)
    assert parts.machine.is_master_lost and parts.machine.is_ramping_down is ramps


def test_what_lets_go_of_the_force_forgets_where_it_was_going_and_has_the_command_cleared() -> None:
    for end in ("disable", "fail"):
        parts = enabled()
        parts.machine.is_ramping_down = parts.machine.is_master_lost = True
        parts.machine.disable("off") if end == "disable" else parts.machine.fail(2.0, STALE)
        assert not parts.machine.is_ramping_down and not parts.machine.is_master_lost
        assert parts.machine.outcome.clear_command and parts.did[-3:] == ["loop.rest", "run.rest", "clearing"]
        assert ("no beat counts" in parts.did) is (end == "fail"), "a stop has its own rule: whose counts"
        assert parts.machine.outcome.events[-1] == "report"


@pytest.mark.parametrize("wish", ["events", "clear_command", "release_owner", "resets_device"])
def test_each_wish_of_a_step_is_one_and_is_gone_with_the_next_step(wish: str) -> None:
    machine = Parts().machine
    setattr(machine.outcome, wish, ["told"] if wish == "events" else True)
    assert not machine.outcome.is_empty
    machine.begin_step()
    assert machine.outcome.is_empty and machine.outcome == StepOutcome()


def test_a_beat_behind_a_fault_in_off_where_nothing_was_left_to_clear_lets_a_reset_through() -> None:
    bench = Bench(settings(lease_s=0.5))
    bench.run(0.5)
    bench.enable(10.0, heartbeat=1)
    bench.run(0.3)
    bench.line = bench.line._replace(sent_v=0.0, unanswered_since_s=bench.now_s)
    bench.disable()
    bench.ignores_clearing = True
    assert bench.run(0.2).fault is FaultCode.OUTPUT_SILENT
    bench.heal()
    bench.write(control_word=ControlBit(0), heartbeat=7)
    bench.write(control_word=ControlBit.RESET_FAULT, heartbeat=7)
    assert (bench.refused, bench.last.state) == (None, State.OFF)


def test_a_run_beside_which_the_gateway_stops_ends_and_says_so() -> None:
    bench = Bench()
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1))
    bench.run(0.5)
    bench.controller.active_run.ask(CalibrationPlan())
    bench.run(1.0)
    assert bench.controller.active_run.running
    bench.controller.stop()
    bench.run(0.1)
    assert not bench.controller.active_run.running
    assert "calibration stopped: ramping down" in bench.events
    assert bench.controller.state in (State.CALIBRATING, State.OFF)


def test_an_internal_error_lets_go_like_any_fault_and_a_run_is_told_of_it() -> None:
    """A way to 0 that outlived it would switch the next enable off."""
    parts, told = enabled(), []
    parts.machine.is_ramping_down = parts.machine.is_master_lost = True
    parts.machine.parts.run.rest = told.append  # type: ignore[method-assign]
    parts.machine.fail_internally(3.0)
    assert not parts.machine.is_ramping_down and not parts.machine.is_master_lost
    assert told == [FaultCode.INTERNAL]


def test_behind_an_internal_error_on_the_way_to_0_an_enable_stays() -> None:
    bench = Bench(settings(lease_s=0.2, lease_action=LeaseAction.RAMP))
    bench.run(0.5)
    bench.enable(40.0, heartbeat=1)
    bench.heartbeat_every_ms = 50
    bench.run(1.0)
    bench.heartbeat_every_ms = 0
    bench.seconds_until(lambda output: bool(output.warnings & WarningBit.MASTER_LOST), 0.3)
    assert bench.last.state is State.RAMPING
    bench.line, line = None, bench.line  # type: ignore[assignment]
    with pytest.raises(AttributeError):
        bench.controller.step(bench.now_s, bench.command, bench.sample, bench.line)
    bench.line, bench.voltage_v = line, 0.0
    bench.run(0.5)
    assert bench.last.fault is FaultCode.INTERNAL and not bench.last.warnings
    bench.heartbeat_every_ms = 50
    bench.write(control_word=ControlBit(0), force_setpoint_n=0.0)
    bench.reset()
    bench.enable(20.0)
    assert bench.run(0.5).force_accepted_n == 20.0


def test_what_is_held_for_a_lost_master_is_the_least_of_what_was_there_is_applied_and_is_asked_for() -> None:
    """Once lowered, by whomever, it does not rise again without a beat."""
    parts = enabled()
    everything, line = parts.machine.parts, SimpleNamespace(owner_connected=False)
    everything.commands.command = SimpleNamespace(number=1)
    everything.commands.lost_sentence = lambda now_s, line: "no heartbeat"
    held = []
    for applied_n, asked_n, mode in ((10.0, 12.0, Mode.FORCE), (8.0, 12.0, Mode.FORCE), (8.0, 5.0, Mode.FORCE),
                                     (8.0, 9.0, Mode.FORCE), (8.0, 1.0, Mode.VOLTAGE)):  # fmt: skip
        everything.loop.applied_n = applied_n
        everything.commands.demand = SimpleNamespace(force_n=asked_n, mode=mode)
        parts.machine.miss_master(2.0, line, LeaseAction.HOLD)  # type: ignore[arg-type]
        held.append(parts.machine.held_n)
    assert held == [10.0, 8.0, 5.0, 5.0, 5.0]
