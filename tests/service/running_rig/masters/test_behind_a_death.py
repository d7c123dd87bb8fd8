"""Behind the death of a control process: what hangs presses nothing, and what goes on may."""

from dataclasses import replace
from typing import Any

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.control import LeaseAction
from gateway.control.settings import SelfTestSettings
from gateway.modbus import Peer
from gateway.registers import Refusal
from gateway.registers.words import State
from gateway.service.running_rig.handover import Handover, left_of
from tests.control.bench import settings
from tests.service.running_rig.runs.test_runs_and_masters import LEASE_S
from tests.service.running_rig.simulated_rig import ENABLE, OTHER, OWNER, SELF_TEST, TAKE, TARE, SmallRig

HUNG = (ENABLE, 3000, 0, 0, 139)


@pytest.mark.parametrize("action", LeaseAction)
@pytest.mark.parametrize("beat", [7, 8])
def test_behind_a_crash_the_last_frame_of_a_program_that_hung_presses_not(action: LeaseAction, beat: int) -> None:
    """The next process knew of no loss: 12 N for another lease, or held until somebody came. Its next beat counts."""
    kept: dict[str, Any] = {}
    rigs = [SmallRig(settings(lease_s=0.35, lease_action=action)) for _ in range(2)]
    for rig in rigs:
        Handover(dict(kept), record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
        frame = rig.block(ENABLE, 12.0, beat=7)
        rig.beats = False
        for _ in range(20):
            rig.answer(0, *frame)
            rig.run(0.1)
    assert kept["lost_beats"] == {OWNER.host: [7]}
    assert max(voltage_v for _, voltage_v, _ in rigs[0].trace) > 1.0
    assert max(voltage_v for _, voltage_v, _ in rigs[1].trace) == 0.0 and rigs[1].state is State.OFF
    rigs[1].run(3.0).answer(0, *frame[:4], beat, *frame[5:])
    assert (rigs[1].run(0.1).state is State.OFF) is (beat == 7)


@pytest.mark.parametrize("action", LeaseAction)
def test_behind_a_crash_the_frames_of_a_hung_program_press_not_whichever_comes_first(action: LeaseAction) -> None:
    """Setpoint and heartbeat came in two frames: the next process judged the first by a heartbeat that nobody had written, and
    12 N were held until somebody came."""
    kept: dict[str, Any] = {}
    rigs = [SmallRig(settings(lease_s=0.35, lease_action=action)) for _ in range(2)]
    for rig in rigs:
        Handover(dict(kept), record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
        rig.beats = False
        for _ in range(20):
            rig.answer(0, ENABLE, 1200)
            rig.answer(4, 7)
            rig.run(0.1)
    assert kept["lost_beats"] == {OWNER.host: [7]}
    assert max(voltage_v for _, voltage_v, _ in rigs[0].trace) > 1.0
    assert max(voltage_v for _, voltage_v, _ in rigs[1].trace) == 0.0 and rigs[1].state is State.OFF
    rigs[1].write(4, 8)
    rigs[1].run(3.0).write(0, ENABLE, 1200)
    assert rigs[1].run(0.1).state is not State.OFF, "its program goes on"


@pytest.mark.parametrize(
    ("writes", "is_found"),
    [((0, ENABLE, 1200, 0, 0, 7), False), ((4, 7), False), ((1, 0), False), ((0, 0), False), ((4, 8), True)],
)
@pytest.mark.parametrize("behind_a_crash", [False, True])
def test_a_lost_master_is_there_again_with_another_heartbeat_or_there_with_its_own_0_and_a_cycle(
    writes: tuple[int, ...], is_found: bool, behind_a_crash: bool
) -> None:
    """A day later a crash came: its first enable with the heartbeat of that loss was refused, and writing 0 did not help."""
    kept: dict[str, Any] = {}
    rig = SmallRig(settings(lease_s=0.35))

    def handed_over(rig: SmallRig) -> SmallRig:
        Handover(dict(kept), record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
        return rig

    handed_over(rig).write(0, ENABLE, 1200, 0, 0, 7)
    rig.beats = False
    rig.until(State.FAULT).run(1.0)
    if behind_a_crash:
        rig = handed_over(SmallRig(rig.settings))
    rig.answer(*writes)
    assert kept["lost_beats"] == ({} if is_found else {OWNER.host: [7]})
    rig = handed_over(SmallRig(rig.settings))
    refused = rig.answer(0, ENABLE, 1200, 0, 0, 7)
    assert (refused is None) is is_found
    rig.write(0, 0)
    assert rig.run(1.0).answer(0, ENABLE, 1200, 0, 0, 8 if is_found else 7) is None


@pytest.mark.parametrize("action", LeaseAction)
@pytest.mark.parametrize(
    "ends", ["dies", "dies twice", "is stopped by another one, then dies", "is refused, then dies"]
)
def test_behind_a_death_the_frames_of_a_program_that_has_just_hung_press_not(action: LeaseAction, ends: str) -> None:
    """Within its lease it was no lost master yet, and who was refused beside the owner none at all."""
    kept: dict[str, Any] = {}
    control = settings(lease_s=LEASE_S, lease_action=action)

    def begun(left_beats: list[int] | None) -> SmallRig:
        rig = SmallRig(control)
        hand = Handover(dict(kept), record=False).restore_held
        hand(rig.bank, rig.now(), lambda **facts: kept.update(facts), left_beats)
        rig.beats = False
        return rig

    def flow(rig: SmallRig, seconds: float) -> list[Refusal | None]:
        return [rig.run(0.05) and rig.answer(0, *HUNG, peer=OTHER) for _ in range(round(seconds / 0.05))]

    rig = begun(None)
    if ends.startswith("is refused"):
        rig.write(0, ENABLE, 800, 0, 0, 1)
    else:
        rig.write(0, *HUNG[:4], 138, peer=OTHER)
    flow(rig, 0.2)
    if ends.startswith("is stopped"):
        rig.write(0, 0)
    kept["owner"] = rig.bank.owner  # as the guardian is told
    for _ in range(2 if ends == "dies twice" else 1):
        rig = begun(rig.loop.owner_beats)
    assert kept["lost_beats"][OTHER.host] == [139] and kept["owner"] is None
    for refused in flow(rig, 2.0):
        assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    assert (rig.state, rig.wire.voltage_v) == (State.OFF, 0.0)
    rig.write(0, *HUNG[:4], 140, peer=OTHER)
    assert rig.run(0.1).state is not State.OFF, "its program goes on"


def test_behind_a_death_a_takeover_counts_no_more_that_was_refused_for_its_heartbeat() -> None:
    """In the next process it was a first one: another master enabled 8 N, and the frame of a hung program pressed 30 N."""
    kept: dict[str, Any] = {}

    def begun() -> SmallRig:
        rig = SmallRig(settings(lease_s=LEASE_S))
        Handover(dict(kept), record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
        rig.beats = False
        return rig

    frame = (ENABLE | TAKE, *HUNG[1:])
    rig = begun()
    rig.write(0, *frame, peer=OTHER)
    for word in (ENABLE | TAKE, ENABLE):
        rig.write(0, word, 800, 0, 0, 1)
        refused = rig.answer(0, *frame, peer=OTHER)
        assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
        assert kept["lost_beats"] == {OTHER.host: [139]} and rig.bank.owner == OWNER.host
        rig = begun()


def test_behind_a_death_a_hung_program_takes_no_force_of_a_living_master_over_by_bit_3_of_its_last_frame() -> None:
    kept: dict[str, Any] = {"lost_beats": {OTHER.host: [139]}}
    rig = SmallRig(settings(lease_s=LEASE_S))
    Handover(kept, record=False).restore_held(rig.bank, rig.now(), lambda **facts: None)
    rig.write(0, ENABLE, 800, 0, 0, 1)
    for _ in range(30):
        refused = rig.run(0.1).answer(0, ENABLE | TAKE, *HUNG[1:], peer=OTHER)
        assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    assert rig.bank.owner == OWNER.host and rig.plant.force_n == pytest.approx(8.0, abs=0.5)
    rig.write(0, ENABLE | TAKE, *HUNG[1:4], 140, peer=OTHER)
    assert rig.bank.owner == OTHER.host, "its program goes on"


@pytest.mark.parametrize("ends", ["lost, then dies", "dies", "ends cleanly"])
@pytest.mark.parametrize("ports", [(4001, 4001), (4001, 4002)])
@pytest.mark.parametrize("first", [0, 1])
def test_behind_a_restart_no_frame_of_several_presses_of_a_program_that_hung(
    ends: str, ports: tuple[int, int], first: int
) -> None:
    """Each of them brings another heartbeat, on and on. The next process knew the last one only: by the other frame 12 N were
    held until somebody came. A frame of a program that goes on brings a fresh one."""
    kept: dict[str, Any] = {}

    def begun(left_beats: list[int] | None = None) -> SmallRig:
        rig = SmallRig(settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD))
        hand = Handover(dict(kept), record=False)
        hand.restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts), left_beats)
        rig.beats = False
        return rig

    frames = [((0, ENABLE, 1200, 0, 0, 7), ports[0]), ((0, ENABLE, 1200, 0, 0, 8, 0), ports[1])]
    rig = begun()
    for cycle in range(40 if ends.startswith("lost") else 3):
        for words, port in frames[:: -1 if first and cycle else 1]:
            rig.answer(*words, peer=replace(OWNER, port=port))
        rig.run(0.05)
    assert rig.wire.voltage_v > 1.0
    left_beats, kept["owner"] = rig.loop.owner_beats, rig.bank.owner
    if ends.startswith("ends"):
        rig.bank.held_enables.note_lost(rig.bank.owner, rig.bank.command.heartbeat)
        kept = left_of(kept)
    for _ in range(2):
        rig = begun(None if ends.startswith("ends") else left_beats)
        for _ in range(40):
            for words, port in (frames[first], frames[1 - first]):
                refused = rig.answer(*words, peer=replace(OWNER, port=port))
                assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
            rig.run(0.05)
        assert max(voltage_v for _, voltage_v, _ in rig.trace) == 0.0
        left_beats = rig.loop.owner_beats
    rig.write(0, ENABLE, 1200, 0, 0, 9, peer=replace(OWNER, port=ports[1]))
    assert rig.run(0.1).state is not State.OFF, "its program goes on"


@pytest.mark.parametrize("action", LeaseAction)
def test_behind_a_death_on_the_heels_of_a_fault_no_frame_presses_of_a_program_that_had_hung(
    action: LeaseAction,
) -> None:
    """The fault had taken the output from its master, which was no lost one yet, nor refused one: nobody knew of it."""
    kept: dict[str, Any] = {}

    def begun() -> SmallRig:
        rig = SmallRig(settings(lease_s=LEASE_S, lease_action=action))
        Handover(dict(kept), record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
        rig.beats = False
        return rig

    rig = begun()
    rig.write(0, *HUNG)
    rig.run(0.1).is_cell_silent = True
    rig.until(State.FAULT)
    assert rig.now() < 0.6 + LEASE_S and rig.bank.owner is None
    rig = begun()
    for _ in range(20):
        refused = rig.run(0.1).answer(0, *HUNG)
        assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    rig.write(0, *HUNG[:4], 140)
    assert rig.run(0.1).state is not State.OFF, "its program goes on"


@pytest.mark.parametrize("ends", ["by its own word", "with its self-test"])
def test_a_master_whose_output_ends_as_it_has_ordered_is_no_lost_one(ends: str) -> None:
    """Behind a death its next order would be refused as one of a program that had hung."""
    kept: dict[str, Any] = {}
    rig = SmallRig(replace(settings(lease_s=LEASE_S), self_test=SelfTestSettings()))
    Handover({}, record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
    if ends == "by its own word":
        rig.holding().write(0, 0)
    else:
        rig.calibrating(SELF_TEST)
        assert rig.bank.owner == OWNER.host
    rig.until(State.OFF, within_s=120.0)
    assert not kept.get("lost_beats")


@pytest.mark.parametrize("ends", ["dies", "ends"])
def test_behind_a_death_nothing_begins_that_was_refused_and_whose_heartbeat_has_come_again(ends: str) -> None:
    """The word comes without a heartbeat. Behind its first refusal the heartbeat had moved, and behind the second one it stood:
    the next process knew of none."""
    kept: dict[str, Any] = {}
    answers: list[Refusal | None] = []
    for process in range(2):
        rig = SmallRig(settings(lease_s=LEASE_S))
        Handover(dict(kept), record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
        rig.is_cell_silent, rig.beats = not process, False
        if not process:
            rig.write(1, 0, 0, 0, 6, peer=OTHER)
        rig.run(0.5)
        for _ in range(2):
            answers.append(rig.answer(0, ENABLE, peer=OTHER))
            rig.answer(1, 1200, 0, 0, 7, peer=OTHER)
            rig.run(0.5)
        for fact in kept.keys() - left_of(kept).keys() if ends == "ends" else ():
            del kept[fact]
    assert answers[0] and answers[2] and answers[2].reason is RefusalReason.HEARTBEAT_STALE


def test_behind_a_death_the_owner_s_heartbeats_are_told_beside_those_with_which_its_host_was_lost_before() -> None:
    """Two programs on it had hung, and one of them owned by its setpoint: the other one began."""
    rig = SmallRig(settings(lease_s=LEASE_S))
    hand = Handover({"lost_beats": {OTHER.host: [139]}, "owner": OTHER.host}, record=False)
    hand.restore_held(rig.bank, rig.now(), lambda **facts: None, [7])
    for port, beat in ((4002, 7), (4003, 139)):
        refused = rig.answer(0, ENABLE, 1200, 0, 0, beat, peer=Peer(OTHER.host, port))
        assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE


def test_the_tare_of_a_program_that_hung_before_its_heartbeat_could_move_is_taken_by_no_process_behind_it() -> None:
    """Its word came before its first heartbeat, and a first one proves nothing: each process tared once more."""
    kept: dict[str, Any] = {}

    def begun() -> SmallRig:
        rig = SmallRig(settings(lease_s=LEASE_S))
        Handover(dict(kept), record=False).restore_held(rig.bank, rig.now(), lambda **facts: kept.update(facts))
        return rig.run(0.5)

    rig = begun()
    assert rig.answer(0, TARE, peer=OTHER) is None
    rig.write(4, 0, peer=OTHER)
    refused = begun().answer(0, TARE, peer=OTHER)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
