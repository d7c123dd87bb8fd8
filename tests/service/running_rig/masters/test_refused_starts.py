"""A start that was refused, whatever for, of a program that then hangs: its frame is sent on and on, and begins nothing when
the reason for its refusal is over. A program that goes on begins with its next beat."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from struct import pack
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control import ControlSettings, LeaseAction
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.settings import Defaults, SelfTestSettings
from gateway.modbus import Peer
from gateway.profiles import load_calibration
from gateway.registers import Refusal
from gateway.registers.words import State
from gateway.service.running_rig.handover import Handover
from tests.control.bench import settings
from tests.gate.budgets import striped
from tests.service.running_rig.simulated_rig import ENABLE, OWNER, RESET, SELF_TEST, TAKE, TARE, SmallRig

HUNG, PAGE, LEASE_S, BEAT = Peer("10.0.0.9"), Peer("web"), 0.35, 7
MOVING = State.READY, State.RAMPING, State.HOLDING, State.CALIBRATING
STALE = RefusalReason.HEARTBEAT_STALE
Frame = Callable[[SmallRig, int], None]


def _words(address: int, *words: int) -> Frame:
    """BEAT in it is the heartbeat of the cycle."""
    return lambda rig, beat: rig.write(address, *(beat if word == BEAT else word for word in words), peer=HUNG)


def _floats(rig: SmallRig, beat: int) -> None:
    rig.bank.write_registers(200, pack(">5f", ENABLE, 12.0, 0, 0, beat), HUNG)


def _coil(rig: SmallRig, beat: int) -> None:
    rig.bank.write_bits(0, [True], HUNG)


FACES: dict[str, tuple[Frame, ...]] = {
    "one block": (_words(0, ENABLE, 1200, 0, 0, BEAT),),
    "a heartbeat, then single words": (_words(4, BEAT), _words(1, 1200), _words(0, ENABLE)),
    "single words, then a heartbeat": (_words(1, 1200), _words(0, ENABLE), _words(4, BEAT)),
    "a setpoint, then a coil": (_words(1, 1200, 0, 0, BEAT), _coil),
    "floats": (_floats,),
    "a takeover": (_words(0, ENABLE | TAKE, 1200, 0, 0, BEAT),),
    "a self-test": (_words(0, SELF_TEST, 0, 0, 0, BEAT),),
}


def _silent_cell(rig: SmallRig) -> Iterator[None]:
    rig.is_cell_silent = True
    rig.run(1.0)
    yield
    rig.is_cell_silent = False
    rig.run(0.3)


def _lost_output(rig: SmallRig) -> Iterator[None]:
    rig.run(0.5).wire.fault = FaultCode.OUTPUT_LOST
    rig.run(0.2)
    yield
    rig.wire.fault = FaultCode.NONE
    rig.run(0.2)


def _run_of_this_machine(rig: SmallRig) -> Iterator[None]:
    rig.run(0.5).controller.active_run.ask(CalibrationPlan())
    rig.until(State.CALIBRATING).run(1.0)
    yield
    rig.write(0, 0, peer=PAGE)
    rig.run(0.5)


def _force_on_its_way_to_0(rig: SmallRig) -> Iterator[None]:
    rig.holding(30.0).beats = False
    rig.run(LEASE_S + 0.1)
    yield
    rig.until(State.OFF)


def _latched_fault(rig: SmallRig) -> Iterator[None]:
    rig.faulted()
    yield
    rig.write(0, TAKE | RESET, 0, 0, 0, 4711, peer=PAGE)
    rig.write(0, 0, peer=PAGE)
    rig.bank.release_owner()


def _another_owner(rig: SmallRig) -> Iterator[None]:
    rig.holding()
    yield
    rig.write(0, 0)


REASONS = (_silent_cell, _lost_output, _run_of_this_machine, _force_on_its_way_to_0, _latched_fault, _another_owner)


def _rig(reason: Callable[[SmallRig], Iterator[None]], action: LeaseAction) -> SmallRig:
    return SmallRig(_control(LeaseAction.RAMP if reason is _force_on_its_way_to_0 else action))


def _control(action: LeaseAction) -> ControlSettings:
    ramp = Defaults(force_ramp_n_per_s=30.0)
    return replace(settings(lease_s=LEASE_S, lease_action=action), self_test=SelfTestSettings(), defaults=ramp)


def _cycle(rig: SmallRig, face: str, beat: int) -> list[Refusal]:
    refused = []
    for frame in FACES[face]:
        try:
            frame(rig, beat)
        except Refusal as refusal:
            refused.append(refusal)
    rig.run(0.05)
    return refused


@pytest.mark.parametrize(("reason", "face"), striped(REASONS, FACES))
def test_the_refused_start_of_a_program_that_hung_begins_nothing_when_the_reason_is_over(
    face: str, reason: Callable[[SmallRig], Iterator[None]]
) -> None:
    """One lease long it pressed, with on_loss hold for ever, when the cell was plugged in again, say."""
    if (reason, face) == (_another_owner, "a takeover"):
        pytest.skip("another owner is no reason against a takeover")
    rig = _rig(reason, LeaseAction.HOLD)
    lasting = reason(rig)
    next(lasting)
    assert all(_cycle(rig, face, BEAT) for _ in range(6)), "each cycle is refused"
    rig.beats = False
    next(lasting, None)
    behind = len(rig.trace)
    answers = [_cycle(rig, face, BEAT) for _ in range(40)]
    assert all(answers) and not any(state in MOVING for state, *_ in rig.trace[behind:])
    if answers[-1][0].reason is STALE:
        for beat in (BEAT + 1, BEAT + 2):
            _cycle(rig, face, beat)
        assert rig.state in MOVING, "a program that goes on begins"


@pytest.mark.parametrize("face", FACES)
@pytest.mark.parametrize("reason", [_silent_cell, _run_of_this_machine, _force_on_its_way_to_0])
def test_the_refused_start_of_a_program_that_beats_begins_as_soon_as_the_reason_is_over(
    face: str, reason: Callable[[SmallRig], Iterator[None]]
) -> None:
    rig = _rig(reason, LeaseAction.FAULT)
    lasting = reason(rig)
    next(lasting)
    for cycle in range(6):
        refused = _cycle(rig, face, 100 + cycle)
        assert refused and refused[0].reason is not STALE, "the reason is told, as long as there is one"
    rig.beats = False
    next(lasting, None)
    _cycle(rig, face, 106)
    assert not _cycle(rig, face, 107) and rig.state in MOVING


def test_a_setpoint_that_another_calibration_allows_is_no_start_of_a_program_that_hung() -> None:
    rig = SmallRig(_control(LeaseAction.HOLD)).run(0.5)
    rig.beats = False
    less = replace(load_calibration("demo"), number=17, force_limits_n=(1.0, 10.0))
    rig.bank.set_active_model(less)
    for _ in range(3):
        assert _cycle(rig, "one block", BEAT)
    rig.bank.set_active_model(replace(less, number=18, force_limits_n=(1.0, 40.0)))
    [refused] = _cycle(rig, "one block", BEAT)
    assert refused.reason is STALE and rig.state is State.OFF
    assert not _cycle(rig, "one block", BEAT + 1) and rig.state in MOVING


def test_an_owner_whose_write_was_refused_under_force_beats_by_the_heartbeat_of_the_next_one() -> None:
    """Its lease is renewed by it: of a write that was refused nothing was taken, the heartbeat neither."""
    rig = SmallRig(_control(LeaseAction.FAULT))
    rig.beats = False
    rig.write(0, ENABLE, 1200, 0, 0, 1)
    for beat in range(2, 20):
        assert rig.answer(0, ENABLE, 9900, 0, 0, beat)
        assert rig.answer(0, ENABLE, 1200, 0, 0, beat) is None
        rig.run(LEASE_S - 0.05)
    assert rig.state is State.HOLDING and rig.bank.owner == OWNER.host


@pytest.mark.parametrize("lease_s", [None, LEASE_S])
def test_who_writes_no_heartbeat_and_has_waited_or_has_no_lease_begins(lease_s: float | None) -> None:
    rig = SmallRig(settings(lease_s=lease_s, lease_action=LeaseAction.HOLD))
    rig.is_cell_silent = True
    rig.run(1.0).beats = False
    assert rig.answer(0, ENABLE, 1200)
    rig.is_cell_silent = False
    rig.run(0.3 if lease_s is None else 3.1)
    assert rig.answer(0, ENABLE, 1200) is None and rig.state in MOVING


@pytest.mark.parametrize("face", [*FACES, "a person"])
def test_behind_a_restart_no_program_begins_that_hung_while_it_was_refused_and_a_person_does(face: str) -> None:
    kept: dict[str, Any] = {}
    rig, answers = SmallRig(_control(LeaseAction.HOLD)), list[list[Refusal]]()
    faces = {"a person": (_words(0, ENABLE, 1200),)} | FACES
    for process in range(2):
        rig = SmallRig(_control(LeaseAction.HOLD))
        Handover(dict(kept), record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
        rig.is_cell_silent, rig.beats = not process, False
        rig.run(1.0)
        for _ in range(6):
            answers.append([])
            for frame in faces[face]:
                try:
                    frame(rig, BEAT)
                except Refusal as refusal:
                    answers[-1].append(refusal)
            rig.run(0.05)
    assert (rig.state in MOVING) is (face == "a person")
    assert bool(answers[-1]) is (face != "a person")


def test_who_hung_and_was_taken_over_from_presses_nothing_in_the_next_process() -> None:
    """It died a moment later, before a frame of it could be refused."""
    kept: dict[str, Any] = {}
    rig = SmallRig(_control(LeaseAction.HOLD)).run(0.5)
    Handover({}, record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
    rig.beats = False
    frame = ENABLE, 1200, 0, 0, BEAT
    rig.write(0, *frame, peer=HUNG)
    rig.run(0.1).write(0, ENABLE | TAKE, 500, 0, 0, 99, peer=PAGE)
    again = SmallRig(_control(LeaseAction.HOLD)).run(0.5)
    Handover(kept | {"owner": "web"}, record=False).restore_held(again.bank, again.now(), lambda **facts: None, [99])
    refused = again.answer(0, *frame, peer=HUNG)
    assert refused and refused.reason is STALE and again.state is State.OFF
    assert again.answer(0, *frame[:4], BEAT + 1, peer=HUNG) is None


def test_the_tare_of_a_program_that_hung_is_taken_once() -> None:
    """The robot laid the tool down, and its 10 N became the zero: 20 N were held by the registers, and 30 N by the cell."""
    kept: dict[str, Any] = {}
    rig = SmallRig(_control(LeaseAction.FAULT)).run(1.0)
    Handover({}, record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
    rig.beats, read_n = False, rig.plant.reading_n
    rig.write(0, TARE, 0, 0, 0, BEAT, peer=HUNG)
    rig.plant.reading_n = lambda: read_n() + 10.0  # type: ignore[method-assign]
    for _ in range(40):
        refused = rig.run(0.05).answer(0, TARE, 0, 0, 0, BEAT, peer=HUNG)
        assert refused
    assert refused.reason is STALE and abs(rig.controller.zero_n) < 0.5
    again = SmallRig(_control(LeaseAction.FAULT)).run(1.0)
    Handover(dict(kept), record=False).restore_held(again.bank, again.now(), lambda **facts: None)
    assert again.answer(0, TARE, 0, 0, 0, BEAT, peer=HUNG), "nor behind a restart"
    rig.write(0, TARE, 0, 0, 0, BEAT + 1, peer=HUNG)
    assert rig.controller.zero_n > 9.5, "a program that goes on means it"
    for _ in range(2):
        rig.run(1.0).write(0, TARE, peer=PAGE)  # a person has no heartbeat


def test_a_tare_that_was_refused_is_not_taken_from_a_program_that_hung_meanwhile() -> None:
    rig = SmallRig(_control(LeaseAction.FAULT)).holding(30.0)
    rig.write(0, 0)
    answers = [rig.run(0.05).answer(0, TARE, 0, 0, 0, BEAT, peer=HUNG) for _ in range(60)]
    assert [refused.reason for refused in answers if refused][:1] == [RefusalReason.TARE_REFUSED]
    assert all(answers) and answers[-1] and answers[-1].reason is STALE
    assert rig.answer(0, TARE, 0, 0, 0, BEAT + 1, peer=HUNG) is None


@pytest.mark.parametrize("hangs", [True, False])
def test_the_tare_of_a_program_that_writes_single_words_is_taken_as_often_as_its_heartbeat_moves(hangs: bool) -> None:
    """Of one that hung it was taken in each cycle, for as long as its frames flowed."""
    rig = SmallRig(_control(LeaseAction.FAULT)).run(1.0)
    refused = 0
    for cycle in range(20):
        refused += rig.answer(0, TARE, peer=HUNG) is not None
        rig.write(4, BEAT if hangs else BEAT + cycle % 2, peer=HUNG)
        rig.run(0.05)
    assert refused == (19 if hangs else 1), "the first heartbeat proves nothing"
    rig.write(0, 0, peer=HUNG)
    rig.run(0.8).write(0, TARE, peer=HUNG)


def test_a_tare_counts_again_behind_a_heartbeat_that_only_goes_to_and_fro() -> None:
    rig = SmallRig(_control(LeaseAction.FAULT)).run(1.0)
    for word, beat in ((TARE, 0), (0, 1), (0, 0), (0, 1), (TARE, 0)):
        rig.run(0.1).write(0, word, 0, 0, 0, beat)
    assert rig.state is State.OFF


def test_without_a_lease_a_tare_needs_no_other_heartbeat() -> None:
    rig = SmallRig(settings()).run(1.0)
    for _ in range(2):
        rig.write(0, TARE, 0, 0, 0, BEAT)
    assert rig.state is State.OFF


@pytest.mark.parametrize("word", [0x7FFF, 0x8003])
def test_whoever_corrects_a_word_that_no_rig_knows_begins_with_its_next_heartbeat(word: int) -> None:
    for beat, refused in ((BEAT, STALE), (BEAT + 1, None)):
        rig = SmallRig(_control(LeaseAction.FAULT))
        unknown = rig.answer(0, word, 1200, 0, 0, BEAT)
        answer = rig.run(0.1).answer(0, ENABLE, 1200, 0, 0, beat)
        assert unknown and (answer and answer.reason) is refused
