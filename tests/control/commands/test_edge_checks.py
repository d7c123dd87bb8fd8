"""What a tare and a run are asked for, at the bounds that no walk through the states reaches."""

from dataclasses import replace
from math import inf

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.control.command_edges import CommandTracker
from gateway.control.edge_checks import EdgeCheck
from gateway.control.readiness import Situation
from gateway.control.runs.active_run import ActiveRun, AnyPlan
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.sample_conditioning import Reading, SampleConditioner
from gateway.control.self_test.items import SelfTestPlan
from gateway.devices.messages import ForceSample, Quality
from gateway.registers.command import Command
from gateway.registers.words import CalibrationPhase, ControlBit, Mode, State
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite
from tests.control.bench import bsfm, settings

TARE, ENABLE = ControlBit.TARE, ControlBit.ENABLE
REST = Situation(
    now_s=1.0, state=State.OFF, faulted_s=-inf, lost_s=-inf, reading=Reading(0.0, 0.0, 0.0, 0.01, True, True, True),
    block=RefusalReason.NONE, excuse="", line_fault="", is_output_known=True, is_output_heard=True, voltage_v=0.0,
    is_lowest=True, applied_n=0.0, leaving_n=0.0, repeats="", held_n=None, ramps_down=False,
    stall_words="",
)  # fmt: skip


def checked_behind(before: Command) -> EdgeCheck:
    """A command that stands, whose master beat last with it."""
    rig = replace(settings(), supervision=replace(settings().supervision, lease_s=0.3))
    tracker = CommandTracker(rig)
    tracker.take(0.5, before)
    return EdgeCheck(tracker, SampleConditioner(rig.supervision), ActiveRun(rig, bsfm()))


def check(rest_n: float = 0.0, phase: CalibrationPhase = CalibrationPhase.IDLE) -> EdgeCheck:
    """A cell that has read rest_n, steadily."""
    rig = settings()
    conditioner = SampleConditioner(rig.supervision)
    for k in range(20):
        conditioner.read(0.01 * k, ForceSample(rest_n, rest_n, Quality.OK, 0.01 * k), 0.0)
    run = ActiveRun(rig, bsfm())
    run.phase = phase
    return EdgeCheck(CommandTracker(rig), conditioner, run)


def refusal(at: Situation, word: ControlBit, rest_n: float = 0.0, **command: float) -> EdgeRefusal | None:
    written = Command(control_word=word, number=1, **command)  # type: ignore[arg-type]
    return check(rest_n).refusal(ProposedWrite(written), at)


@pytest.mark.parametrize(("expected_n", "is_taken"), [(0.5, True), (0.51, False)])
def test_a_tare_waits_until_what_still_presses_is_within_what_a_zero_may_spread(
    expected_n: float, is_taken: bool
) -> None:
    assert (refusal(replace(REST, leaving_n=expected_n), TARE) is None) is is_taken


@pytest.mark.parametrize(("state", "is_taken"), [(State.OFF, True), (State.READY, False)])
def test_a_tare_is_refused_under_a_voltage_that_presses_and_not_for_the_safe_one(state: State, is_taken: bool) -> None:
    assert (refusal(replace(REST, state=state, voltage_v=0.1, is_lowest=False), TARE) is None) is is_taken


def test_a_zero_is_judged_with_the_payload_of_its_own_write() -> None:
    assert refusal(REST, TARE, rest_n=46.0) is None
    refused = refusal(REST, TARE, rest_n=46.0, payload_kg=0.5)
    assert refused and refused.reason is RefusalReason.TARE_REFUSED and "at rest" in refused.text


def test_a_run_that_tares_first_is_refused_where_the_tare_would_be() -> None:
    cold = replace(REST, leaving_n=3.0)
    assert check().of_run(CalibrationPlan(), cold) is None
    refused = check().of_run(CalibrationPlan(tare=True), cold)
    assert refused and refused.reason is RefusalReason.TARE_REFUSED


@pytest.mark.parametrize(("applied_n", "is_taken"), [(0.0, True), (0.1, False)])
def test_a_run_begins_from_ready_only_where_no_force_is_applied(applied_n: float, is_taken: bool) -> None:
    at = replace(REST, state=State.READY, applied_n=applied_n)
    assert (check().of_run(CalibrationPlan(), at) is None) is is_taken


@pytest.mark.parametrize("force_n", [12.0, -12.0])
def test_no_setpoint_of_either_sign_stands_at_a_reset_or_where_a_run_begins(force_n: float) -> None:
    for word, at in (
        (ControlBit.RESET_FAULT, replace(REST, state=State.FAULT)),
        (ControlBit.START_CALIBRATION, REST),
    ):
        for setpoint in ({"force_setpoint_n": force_n}, {"voltage_setpoint_v": 0.01}):
            refused = refusal(at, word, **setpoint)
            assert refused and "setpoint is" in refused.text
        assert refusal(at, word, heartbeat=1) is None


def test_each_refusal_of_an_enable_names_its_own_cause_and_no_other() -> None:
    at = replace(REST, excuse="the loop stood still", line_fault="A320 refused")

    def words(reason: RefusalReason, state: State = State.OFF, **changes: str) -> str:
        refused = refusal(replace(at, state=state, block=reason, **changes), ENABLE)  # type: ignore[arg-type]
        assert refused
        return refused.text.removeprefix("enable refused: ")

    latched = RefusalReason.FAULT_LATCHED
    assert words(RefusalReason.NOT_READY, State.FAULT) == latched.explanation.sentence
    assert words(RefusalReason.NOT_READY) == "the loop stood still"
    assert words(RefusalReason.OUTPUT_FAULT, excuse="") == "A320 refused"
    assert words(RefusalReason.CELL_SILENT, excuse="") == RefusalReason.CELL_SILENT.explanation.sentence


def test_a_stop_is_taken_from_a_run_and_on_the_way_to_0_whatever_else_it_writes() -> None:
    for at in (replace(REST, state=State.CALIBRATING), replace(REST, state=State.HOLDING, ramps_down=True)):
        for stops, is_taken in ((True, True), (False, False)):
            command = Command(force_setpoint_n=5.0, number=1, stops=stops)
            refused = check().refusal(ProposedWrite(command, lambda: ("force_setpoint",)), at)
            assert (refused is None) is is_taken


@pytest.mark.parametrize(
    "at", [replace(REST, state=State.CALIBRATING), replace(REST, state=State.HOLDING, ramps_down=True)]
)
def test_a_takeover_is_taken_from_a_run_and_on_the_way_to_0_and_a_tare_beside_it_is_not(at: Situation) -> None:
    assert refusal(at, ControlBit.TAKE_OWNERSHIP) is None
    refused = refusal(at, ControlBit.TAKE_OWNERSHIP | TARE)
    assert refused and refused.text.startswith("tare refused")


@pytest.mark.parametrize(
    ("line_fault", "words"), [("", "the output device does not answer"), ("A322 its port went away", "A322 its port")]
)
def test_a_fault_is_not_reset_behind_an_output_that_is_not_heard(line_fault: str, words: str) -> None:
    deaf = replace(REST, state=State.FAULT, is_output_heard=False, line_fault=line_fault)
    refused = refusal(deaf, ControlBit.RESET_FAULT, heartbeat=1)
    assert refused and (refused.reason, refused.bit) == (RefusalReason.OUTPUT_FAULT, ControlBit.RESET_FAULT)
    assert words in refused.text and "whether air still presses is not known" in refused.text
    assert refusal(replace(deaf, state=State.OFF), ControlBit.RESET_FAULT) is None, "there is no fault latched"


def test_a_reset_needs_a_beat_that_came_behind_the_fault_where_there_is_a_lease() -> None:
    commands = CommandTracker(settings(lease_s=1.0))
    commands.take(0.0, Command(heartbeat=7, number=1))
    asked = EdgeCheck(commands, SampleConditioner(settings().supervision), ActiveRun(settings(), bsfm()))
    at = replace(REST, state=State.FAULT, faulted_s=0.5)
    for heartbeat, is_taken in ((7, False), (8, True)):
        command = Command(control_word=ControlBit.RESET_FAULT, heartbeat=heartbeat, number=2)
        refused = asked.refusal(ProposedWrite(command), at)
        assert (refused is None) is is_taken
        assert refused is None or refused.reason is RefusalReason.HEARTBEAT_STALE


def test_the_frame_that_a_master_was_lost_with_enables_nothing_anew_and_its_next_beat_does() -> None:
    commands, bit = CommandTracker(settings(lease_s=1.0)), ControlBit.ENABLE
    commands = CommandTracker(settings(lease_s=1.0))
    commands.take(0.0, Command(heartbeat=7, number=1))
    asked = EdgeCheck(commands, SampleConditioner(settings().supervision), ActiveRun(settings(), bsfm()))
    at = replace(REST, lost_s=0.5)
    repeated = asked.refusal(ProposedWrite(Command(control_word=bit, heartbeat=7, number=2)), at)
    assert repeated and (repeated.reason, repeated.bit) == (RefusalReason.HEARTBEAT_STALE, bit)
    assert "heartbeat = 7 as when the master was lost" in repeated.text
    beating = asked.refusal(ProposedWrite(Command(control_word=bit, heartbeat=8, number=2)), at)
    assert beating is None
    commands.take(0.6, Command(heartbeat=8, number=2))
    later = asked.refusal(ProposedWrite(Command(control_word=bit, heartbeat=8, number=3)), replace(at, now_s=99.0))
    assert later is None


@pytest.mark.parametrize(("plan", "name"), [(CalibrationPlan(), "calibration"), (SelfTestPlan(), "self-test")])
def test_while_a_ladder_is_fitted_no_run_begins_and_the_refusal_names_which(plan: AnyPlan, name: str) -> None:
    refused = check(phase=CalibrationPhase.FITTING).of_run(plan, REST)
    assert refused is not None and refused.reason is RefusalReason.FITTING
    assert refused.text.startswith(f"{name} refused: the last ladder is being fitted")
    behind = check().of_run(plan, REST)
    assert behind is None or behind.reason is not RefusalReason.FITTING


@pytest.mark.parametrize(
    ("at", "word", "reason"),
    [
        (replace(REST, repeats="repeated for 9 s"), TARE, RefusalReason.TARE_REFUSED),
        (replace(REST, state=State.FAULT), TARE, RefusalReason.TARE_REFUSED),
        (replace(REST, is_output_known=False), TARE, RefusalReason.TARE_REFUSED),
        (replace(REST, state=State.READY), ControlBit.RESET_FAULT, RefusalReason.NOTHING_TO_RESET),
        (replace(REST, state=State.CALIBRATING), TARE, RefusalReason.CALIBRATING),
        (replace(REST, state=State.CALIBRATING), ENABLE, RefusalReason.CALIBRATING),
        (replace(REST, state=State.HOLDING, ramps_down=True), TARE, RefusalReason.STOPPING),
    ],
)
def test_an_edge_that_cannot_be_taken_now_is_refused_and_taken_otherwise(
    at: Situation, word: ControlBit, reason: RefusalReason
) -> None:
    refused = refusal(at, word)
    assert refused is not None and refused.reason is reason
    assert refusal(REST, word) is None


def test_a_reset_in_the_same_write_lets_a_tare_follow_it() -> None:
    """Each edge is judged in the state that the one before it leaves."""
    assert refusal(replace(REST, state=State.FAULT), ControlBit.RESET_FAULT | TARE) is None


HELD = replace(REST, state=State.HOLDING, applied_n=10.0, held_n=10.0, lost_s=0.9)


@pytest.mark.parametrize(
    ("before", "asked", "is_taken"),
    [
        ({"force_setpoint_n": 8.0}, {"force_setpoint_n": 10.0}, True),
        ({"force_setpoint_n": 8.0}, {"force_setpoint_n": 10.1}, False),
        ({"force_setpoint_n": 10.1}, {"force_setpoint_n": 10.1}, True),  # what stands is lowered by control
        ({"voltage_setpoint_v": 2.0, "mode": Mode.VOLTAGE}, {"voltage_setpoint_v": 2.0, "mode": Mode.VOLTAGE}, True),
        ({"voltage_setpoint_v": 2.0, "mode": Mode.VOLTAGE}, {"voltage_setpoint_v": 2.1, "mode": Mode.VOLTAGE}, False),
        ({"voltage_setpoint_v": 2.0}, {"voltage_setpoint_v": 2.0, "mode": Mode.VOLTAGE}, False),  # it begins to act now
        ({"voltage_setpoint_v": 2.0}, {"voltage_setpoint_v": 2.5}, True),  # in force mode it does nothing
    ],
)
def test_what_is_held_for_a_lost_master_rises_with_a_beat_alone(before: dict, asked: dict, is_taken: bool) -> None:
    """Not by a tenth of a newton, nor by a voltage that stood without a meaning."""
    checked = checked_behind(Command(control_word=ENABLE, number=1, heartbeat=5, **before))
    command = Command(control_word=ENABLE, number=2, heartbeat=5, **asked)
    refused = checked.refusal(ProposedWrite(command, lambda: ("force_setpoint",)), HELD)
    assert (refused is None) is is_taken
    assert refused is None or (refused.reason, refused.bit) == (RefusalReason.HEARTBEAT_STALE, ControlBit(0))


@pytest.mark.parametrize("repeats", [False, True])
def test_another_heartbeat_is_no_beat_where_its_frame_was_refused_before(repeats: bool) -> None:
    checked = checked_behind(Command(control_word=ENABLE, number=1, heartbeat=5, force_setpoint_n=8.0))
    command = Command(control_word=ENABLE, number=2, heartbeat=6, force_setpoint_n=20.0, repeats=repeats)
    refused = checked.refusal(ProposedWrite(command, lambda: ("force_setpoint",)), HELD)
    assert (refused.reason if refused else None) is (RefusalReason.HEARTBEAT_STALE if repeats else None)


@pytest.mark.parametrize(("state", "is_taken"), [(State.OFF, True), (State.RAMPING, False)])
def test_what_is_written_on_the_way_to_nothing_is_refused_and_nothing_that_waits_at_rest(state: State, is_taken: bool):
    """A gateway that ends says so only where a force still goes down."""
    at = replace(REST, state=state, ramps_down=True)
    asked = ProposedWrite(Command(number=1, force_setpoint_n=3.0), lambda: ("force_setpoint",))
    assert (check().refusal(asked, at) is None) is is_taken
