"""A master with more than one frame, or connection: what each brings counts by itself."""

from collections.abc import Callable
from dataclasses import replace
from struct import pack

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.control.settings import SelfTestSettings
from gateway.modbus import Peer
from gateway.registers.words import State
from tests.control.bench import settings
from tests.service.running_rig.simulated_rig import ENABLE, OTHER, OWNER, SELF_TEST, TAKE, TARE, SmallRig

LEASE_S, CYCLE_S = 0.35, 0.05
FIRST, SECOND = 139, 9
PLC, TWIN = Peer("10.0.0.5", 4001, name="plc"), Peer("10.0.0.6", 4001, name="plc")
Frame = Callable[[SmallRig, int], None]


def _block(peer: Peer) -> Frame:
    return lambda rig, beat: rig.write(0, ENABLE, 1200, 0, 0, beat, peer=peer)


def _floats(rig: SmallRig, beat: int) -> None:
    rig.bank.write_registers(202, pack(">4f", 12.0, 0.0, 0.0, beat), OWNER)


PAIRS: dict[str, tuple[Frame, Frame]] = {
    "two connections": (_block(OWNER), _block(Peer(OWNER.host, OWNER.port + 1))),
    "one certificate at two addresses": (_block(PLC), _block(TWIN)),
    "words and floats": (_block(OWNER), _floats),
    "words and the heartbeat alone": (_block(OWNER), lambda rig, beat: rig.write(4, beat)),
}


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("counts", [False, True])
def test_two_frames_of_one_master_keep_a_force_up_only_where_one_of_them_changes(pair: str, counts: bool) -> None:
    """Each was another heartbeat than the one before: a program that hung, or two, pressed for ever."""
    rig, frames = SmallRig(settings(lease_s=LEASE_S)), PAIRS[pair]
    rig.beats = False
    for cycle in range(40):
        for frame, beat in zip(frames, (FIRST, SECOND), strict=True):
            if rig.state is not State.FAULT:
                frame(rig, beat + cycle % 2 if counts else beat)
            rig.run(CYCLE_S)
    assert rig.state is (State.HOLDING if counts else State.FAULT)


@pytest.mark.parametrize("beats", ["stand still", "count", "toggle"])
def test_a_master_that_connects_for_each_frame_keeps_a_force_up_only_where_one_of_them_changes(beats: str) -> None:
    """The first frame of a connection brought another heartbeat than the register's: one that hung pressed for ever."""
    rig = SmallRig(settings(lease_s=LEASE_S))
    rig.beats = False
    for cycle in range(40):
        beat = FIRST + {"stand still": 0, "count": cycle, "toggle": cycle % 2}[beats]
        if rig.state is not State.FAULT:
            rig.write(0, ENABLE, 1200, 0, 0, beat, peer=Peer(OWNER.host, 5000 + cycle))
            rig.run(CYCLE_S).write(4, SECOND, peer=Peer(OWNER.host, 6000 + cycle))
        rig.run(CYCLE_S)
    assert rig.state is (State.FAULT if beats == "stand still" else State.HOLDING)


@pytest.mark.parametrize("takes", [0, TAKE])
@pytest.mark.parametrize("why", ["a silent cell", "another owner"])
def test_what_was_refused_begins_not_by_a_second_frame_that_stands_still(why: str, takes: int) -> None:
    """Its other heartbeat was taken for a sign of life: 30 N behind the plug of the cell, for one length of the lease."""
    rig = SmallRig(settings(lease_s=LEASE_S))
    rig.beats, rig.is_cell_silent = False, why == "a silent cell"
    rig.run(1.0)
    if why == "another owner":
        rig.write(0, ENABLE, 800, 0, 0, 1)
        if takes:
            rig.write(0, ENABLE | takes, 3000, 0, 0, FIRST, peer=OTHER)
        rig.write(0, ENABLE | TAKE, 800, 0, 0, 2)
    began = 0
    for cycle in range(60):
        if cycle == 20:
            rig.is_cell_silent = False
            began = len(rig.trace)
        if why == "another owner" and cycle <= 20:
            rig.write(0, *((ENABLE, 800, 0, 0, 3 + cycle) if cycle < 20 else (0,)))
        refused = rig.answer(0, ENABLE | takes, 3000, 0, 0, FIRST, peer=OTHER)
        rig.answer(4, SECOND, peer=OTHER)
        rig.run(CYCLE_S)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    assert max(force_n for _, _, force_n in rig.trace[began + 50 :]) < 1.0


def test_a_tare_is_taken_again_by_no_second_frame_that_stands_still() -> None:
    rig = SmallRig(settings(lease_s=LEASE_S)).run(1.0)
    answers = []
    for _ in range(20):
        answers.append(rig.run(CYCLE_S).answer(0, TARE, 0, 0, 0, FIRST))
        rig.write(4, SECOND)
    assert all(answers[2:])


@pytest.mark.parametrize("is_split", [False, True])
def test_a_stop_on_the_host_of_a_hung_program_lets_none_of_its_frames_begin(is_split: bool) -> None:
    """They had been refused for as long as they came: the 0 of somebody beside it on that host was taken for its own, and its
    next frame pressed. Who comes again behind a pause has ended and begins."""
    rig = SmallRig(settings(lease_s=LEASE_S))
    rig.beats = False

    def flow(cycles: int) -> list[RefusalReason | None]:
        answers = []
        for _ in range(cycles):
            refused = rig.answer(0, ENABLE, 3000, 0, 0, FIRST, peer=OTHER)
            answers.append(refused.reason if refused else None)
            if is_split:
                rig.answer(4, SECOND, peer=OTHER)
            rig.run(CYCLE_S)
        return answers

    rig.write(0, ENABLE, 800, 0, 0, 1)
    flow(3)
    rig.write(0, 0, 0, 0, 0, 2)
    flow(3)
    rig.write(0, 0, peer=Peer(OTHER.host, OTHER.port + 1))
    began = len(rig.trace)
    assert flow(20) == [RefusalReason.HEARTBEAT_STALE] * 20
    assert max(force_n for _, _, force_n in rig.trace[began + 50 :]) < 1.0
    rig.run(3.1).write(0, ENABLE, 3000, 0, 0, FIRST, peer=OTHER)
    assert rig.run(0.1).state is not State.OFF


def test_who_was_refused_while_a_run_s_bit_was_kept_begins_nothing_by_frames_without_that_bit() -> None:
    """The bit's own 0 is waited for; of other frames nothing was noted, and they began when their reason was over."""
    rig = SmallRig(replace(settings(lease_s=LEASE_S), self_test=SelfTestSettings()))
    rig.run(1.0).write(0, SELF_TEST, 0, 0, 0, 1, peer=OTHER)
    rig.until(State.CALIBRATING).write(0, SELF_TEST, 0, 0, 0, 2, peer=OTHER)
    rig.run(0.1).write(0, 0)
    rig.until(State.OFF, 10.0).beats = False
    rig.is_cell_silent = True
    rig.run(1.0)
    for _ in range(5):
        assert rig.run(CYCLE_S).answer(0, ENABLE, 3000, 0, 0, FIRST, peer=OTHER)
    rig.is_cell_silent = False
    rig.run(0.3)
    refused = rig.answer(0, ENABLE, 3000, 0, 0, FIRST, peer=OTHER)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
