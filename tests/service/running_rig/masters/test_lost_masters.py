"""Who is lost, and when: behind a takeover or a stop of another one, and beside one, where what hangs presses nothing."""

from dataclasses import replace

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.control import LeaseAction
from gateway.control.settings import Defaults
from gateway.modbus import Peer
from gateway.registers import Refusal
from gateway.registers.words import State
from gateway.registers.writes.held_starts import HeldEnables
from tests.control.bench import settings
from tests.service.running_rig.runs.test_runs_and_masters import LEASE_S, leased
from tests.service.running_rig.simulated_rig import ENABLE, OTHER, OWNER, RESET, TAKE, SmallRig


@pytest.mark.parametrize("ago_s", [0.0, 0.2, 0.34])
def test_who_takes_over_has_one_whole_length_of_the_lease_to_beat(ago_s: float) -> None:
    """What was left of the former owner's was 10 ms: the force fell before the new one could write a second time."""
    rig = leased().holding()
    rig.write(4, 4711)
    rig.beats = False
    rig.run(ago_s).write(0, ENABLE | TAKE, peer=OTHER)
    assert rig.run(LEASE_S - 0.02).state is State.HOLDING
    assert rig.until(State.FAULT, 0.05).bank.owner is None


@pytest.mark.parametrize("masters", [(OWNER,), (OWNER, OTHER), (OWNER, OTHER, Peer("10.0.0.7"))])
def test_programs_that_hang_keep_no_force_by_taking_over_with_each_frame(masters: tuple[Peer, ...]) -> None:
    rig = leased()
    for number, peer in enumerate(masters):
        rig.write(0, ENABLE | TAKE, 1200, 0, 0, 7 + number, peer=peer)
    rig.beats, pressed = False, 0
    for cycle in range(100):
        rig.answer(0, ENABLE | TAKE, 1200, 0, 0, 7 + cycle % len(masters), peer=masters[cycle % len(masters)])
        pressed += rig.run(0.05).state in (State.RAMPING, State.HOLDING)
    assert pressed * 0.05 <= len(masters) * LEASE_S + 0.1
    assert rig.state is State.FAULT


@pytest.mark.parametrize("action", LeaseAction)
@pytest.mark.parametrize("is_split", [False, True])
@pytest.mark.parametrize("ends", ["stops", "is lost"])
def test_the_frames_of_a_program_that_hung_beside_another_owner_press_not_when_that_one_ends(
    action: LeaseAction, is_split: bool, ends: str
) -> None:
    """They had been refused for hours: 30 N for a lease, or until somebody came, in the moment in which the owner stopped."""
    rig = SmallRig(settings(lease_s=LEASE_S, lease_action=action))
    rig.beats = False

    def flow(cycles: int, owner: bool) -> None:
        for cycle in range(cycles):
            if owner:
                rig.write(0, ENABLE, 800, 0, 0, 1 + cycle)
            for words in [(0, ENABLE, 3000), (4, 139)] if is_split else [(0, ENABLE, 3000, 0, 0, 139)]:
                rig.answer(*words, peer=OTHER)
            rig.run(0.1)

    flow(20, owner=True)
    if ends == "stops":
        rig.write(0, 0, 0, 0, 0, 50)
    flow(40, owner=False)
    assert max(force_n for *_, force_n in rig.trace) < 9.0
    if rig.state is State.OFF:
        rig.write(0, ENABLE, 3000, 0, 0, 140, peer=OTHER)
        assert rig.run(0.1).state is not State.OFF, "its program goes on"


@pytest.mark.parametrize("by", ["a pause", "its own 0", "a takeover", "no lease"])
def test_who_was_refused_beside_another_owner_enables_with_the_same_heartbeat(by: str) -> None:
    rig = SmallRig(settings(lease_s=None if by == "no lease" else LEASE_S))
    rig.write(0, ENABLE, 800, 0, 0, 1)
    assert rig.answer(0, ENABLE, 900, 0, 0, 7, peer=OTHER)
    rig.write(0, 0, 0, 0, 0, 2)
    if by == "a pause":
        rig.run(3.1)
    elif by == "its own 0":
        rig.write(0, 0, peer=OTHER)
        rig.run(0.9)  # what comes again within a cycle is a cycle's
    rig.write(0, ENABLE | (TAKE if by == "a takeover" else 0), 900, 0, 0, 7, peer=OTHER)
    assert rig.run(0.1).state is not State.OFF


@pytest.mark.parametrize("action", LeaseAction)
@pytest.mark.parametrize("hangs_s", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("by", ["the page's stop", "a coil", "a takeover that stops"])
def test_the_frames_of_a_program_that_has_just_hung_undo_no_stop_of_another_one(
    action: LeaseAction, hangs_s: float, by: str
) -> None:
    """Within its lease it was no lost master: behind a stop its next frame pressed 12 N, for good where they are held."""
    rig = SmallRig(settings(lease_s=LEASE_S, lease_action=action))
    rig.beats = False
    for beat in range(1, 20):
        rig.run(0.05).write(0, *(frame := (ENABLE, 1200, 0, 0, beat)))
    for _ in range(round(hangs_s / 0.05)):
        rig.run(0.05).write(0, *frame)
    assert rig.state is State.HOLDING
    if by == "a takeover that stops":
        rig.write(0, TAKE | ENABLE, peer=OTHER)
    rig.bank.write_bits(0, [False], OTHER) if by == "a coil" else rig.write(0, 0, peer=OTHER)
    began = len(rig.run(0.05).trace)
    for _ in range(20):
        refused = rig.run(0.05).answer(0, *frame)
        assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    assert max(voltage_v for _, voltage_v, _ in rig.trace[began:]) == 0.0
    rig.write(0, *frame[:4], 20)
    assert rig.run(0.1).state is not State.OFF, "its program goes on"


@pytest.mark.parametrize("by", ["its own stop", "another one that comes long behind"])
def test_a_stop_asks_for_no_beat_of_who_has_stopped_or_has_been_away(by: str) -> None:
    rig = leased().holding()
    rig.write(4, 4711)
    rig.beats = False
    if by == "its own stop":
        rig.write(0, 0)
    else:
        rig.write(0, 0)
        rig.run(1.0).write(0, ENABLE, 800, 0, 0, 1, peer=OTHER)
        rig.run(0.1).write(0, 0, peer=OTHER)
    rig.write(0, ENABLE, 1200, 0, 0, 4711)
    assert rig.run(0.1).state is not State.OFF


class Held(SmallRig):
    """12 N of 30 N are held for a master whose program hangs while its frame flows; some have taken over with it."""

    def __init__(self, word: int = ENABLE) -> None:
        control = settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD)
        super().__init__(replace(control, defaults=Defaults(force_ramp_n_per_s=5.0)))
        self.write(0, *self.block(word, 30.0, beat=7))
        self.frame = self.block(word, 30.0, beat=8)
        self.write(0, *self.frame)
        self.run(2.0).beats = False
        for beat in range(9, 15):
            self.frame = self.block(word, 30.0, beat=beat)
            self.write(0, *self.frame)
            self.run(0.1)
        self.flow(1.0)
        assert self.state is State.HOLDING and 12.0 < self.plant.force_n < 16.0

    def flow(self, seconds: float) -> list[Refusal | None]:
        """The frame goes on, ten times a second; the answers."""
        return [self.run(0.1) and self.answer(0, *self.frame) for _ in range(round(seconds / 0.1))]


@pytest.mark.parametrize("word", [ENABLE, ENABLE | TAKE])
def test_what_somebody_has_lowered_beside_a_lost_master_its_frames_do_not_raise(word: int) -> None:
    """12 N were held, a person at the page wrote 5 N, and the next frame of the program that hung pressed 30 N."""
    rig = Held(word)
    rig.write(1, 500, peer=OTHER)
    refused = rig.flow(6.0)[-1]
    assert rig.plant.force_n == pytest.approx(5.0, abs=0.5)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    rig.write(0, *rig.frame[:4], 4711)
    rig.beats = True
    assert rig.run(6.0).plant.force_n == pytest.approx(30.0, abs=0.5), "it goes on"


@pytest.mark.parametrize("ago_s", [0.0, 0.01, 0.05])
def test_what_somebody_has_just_lowered_beside_a_lost_master_its_next_frame_does_not_raise(ago_s: float) -> None:
    """Before the next step the force had not begun to fall: 12 N were no more than was held, and undid the 5 N for good."""
    rig = SmallRig(settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD)).holding()
    rig.write(0, *(frame := (ENABLE, 1200, 0, 0, 4711)))
    rig.beats = False
    rig.run(LEASE_S + 0.1).write(0, *frame)
    rig.write(1, 500, peer=OTHER)
    rig.run(ago_s)
    for _ in range(20):
        refused = rig.answer(0, *frame)
        assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
        rig.run(0.1)
    assert rig.plant.force_n == pytest.approx(5.0, abs=0.5)


def test_what_another_master_has_pressed_and_left_the_frames_of_one_that_hung_before_do_not_raise() -> None:
    """Another one had taken over, and pressed 8 N until it was lost: the first one's frames, refused so far, pressed 30 N."""
    rig = Held()
    rig.write(0, ENABLE | TAKE, 800, 0, 0, 100, peer=OTHER)
    for beat in range(101, 120):
        rig.write(4, beat, peer=OTHER)
        assert rig.answer(0, *rig.frame), "not the owner"
        rig.run(0.1)
    rig.flow(6.0)
    assert rig.state is State.HOLDING and rig.plant.force_n == pytest.approx(8.0, abs=0.5)


@pytest.mark.parametrize("again", ["its frame", "another heartbeat", "its program"])
def test_who_has_taken_over_takes_no_force_back_from_a_living_master_by_its_last_frame(again: str) -> None:
    """Bit 3 stood in the last frame of a program that hung: 30 N for 8 N, and then none, for the beats of the other one were
    refused."""
    rig = leased()
    rig.beats = False
    frame = (ENABLE | TAKE, 3000, 0, 0, 7)
    rig.write(0, *frame)
    rig.write(0, ENABLE | TAKE, 800, 0, 0, 100, peer=OTHER)
    rig.run(0.1).write(4, 101, peer=OTHER)
    if again == "another heartbeat":
        assert rig.answer(4, 8), "not the owner"
        frame = (*frame[:4], 8)
    elif again == "its program":
        frame = (*frame[:4], 8)
        rig.write(0, *frame)
        rig.write(0, TAKE | ENABLE, 800, 0, 0, 102, peer=OTHER)
    for beat in range(103, 123):
        refused = rig.answer(0, *frame)
        if again == "another heartbeat":
            assert refused is None and rig.bank.owner == OWNER.host
            return
        assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
        rig.run(0.1).write(4, beat, peer=OTHER)
    assert rig.state is State.HOLDING and rig.plant.force_n == pytest.approx(8.0, abs=0.5)


@pytest.mark.parametrize("words", [(3, 1), (1, 2000), (1, 3100, 0, 0)])
def test_nothing_rises_beside_a_lost_master_without_a_beat(words: tuple[int, ...]) -> None:
    rig = Held()
    held_n = rig.plant.force_n
    rig.write(1, 1100)
    rig.write(5, 4000)
    for peer in (OWNER, OTHER) if words != (3, 1) else (OWNER,):  # of another one the voltage is cleared
        refused = rig.answer(*words, peer=peer)
        assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    assert rig.run(2.0).plant.force_n < held_n


def test_the_masters_that_were_lost_are_sixty_four() -> None:
    held, told = HeldEnables(), []
    held.on_lost = told.append
    for number in range(65):
        for beat in (3, 3, 4):
            held.note_lost(f"10.0.0.{number}", beat)
    held.note_lost(None, 5)
    assert len(told) == 130 and len(told[-1]) == 64 and told[-1]["10.0.0.64"] == [3, 4]


@pytest.mark.parametrize("lease_s", [None, LEASE_S])
def test_who_keeps_enable_at_1_over_a_fault_takes_no_force_of_another_one_over_by_bit_3_of_its_frames(
    lease_s: float | None,
) -> None:
    """They had been refused over the fault: somebody reset it and enabled 8 N, and the next one pressed 30 N."""
    rig = SmallRig(settings(lease_s=lease_s)).faulted()
    frame = ENABLE | TAKE, 3000, 0, 0, 139
    for _ in range(10):
        assert rig.run(0.1).answer(0, *frame, peer=OTHER)
    rig.write(0, RESET, 0, 0, 0, 9000)
    rig.write(0, ENABLE, 800, 0, 0, 9001)
    for _ in range(30):
        refused = rig.run(0.1).answer(0, *frame, peer=OTHER)
        assert refused and refused.reason is RefusalReason.CALIBRATION_HELD
    assert rig.bank.owner == OWNER.host and rig.plant.force_n == pytest.approx(8.0, abs=0.5)
    rig.write(0, 0, peer=OTHER)
    rig.write(0, ENABLE, 800, 0, 0, 9002)
    rig.write(0, *frame[:-1], 140, peer=OTHER)
    assert rig.bank.owner == OTHER.host, "behind its own 0 it counts"
