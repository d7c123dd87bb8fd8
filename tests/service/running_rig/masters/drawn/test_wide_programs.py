"""Wider scenes: serial faces, certificates, more spellings, other leases, standstills."""

from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control import LeaseAction
from gateway.modbus import Peer
from gateway.registers.words import State
from tests.service.running_rig.masters.drawn.laws import LEASE_S
from tests.service.running_rig.masters.drawn.test_drawn_programs import STEPS, begun
from tests.service.running_rig.masters.drawn.wide_scene import WideScene
from tests.service.running_rig.simulated_rig import CALIBRATE, ENABLE, OTHER, OWNER, TAKE, TARE

SEEDS = 50000, 50100, 50200, 50300, 50400, 50500, 61046, 61089, 61412, 63047, 64074, 66800


@pytest.mark.parametrize("first", SEEDS)
def test_what_hangs_begins_nothing_on_any_face_and_what_goes_on_has_its_force(first: int, budget: int) -> None:
    for seed in range(first, first + budget):
        scene = WideScene(seed)
        scene.play(STEPS)
        assert scene.rig.trace


def test_what_hung_begins_by_none_of_the_connections_of_its_pool() -> None:
    """By one of them it had come last before its heartbeat moved, by the other one."""
    rig = begun()
    rig.is_cell_silent = True
    rig.run(0.5)
    first, second = (Peer(OTHER.host, port) for port in (4002, 4003))
    for beat, peer in ((4, first), (5, second), (6, second)):
        assert rig.run(0.05).answer(0, ENABLE, 1200, 0, 0, beat, peer=peer)
    rig.is_cell_silent = False
    rig.run(0.2)
    assert rig.answer(0, ENABLE, 1200, 0, 0, 6, peer=first)


def test_behind_a_stop_a_program_that_hung_does_not_begin_by_a_heartbeat_older_than_a_lease() -> None:
    """Its cycle was longer than the lease, and the stop took no heartbeat away that was older: it began in each cycle."""
    rig = begun()
    rig.write(0, 0, 0, 0, 0, 6, peer=OTHER)
    rig.run(0.9).write(4, 7, peer=OTHER)
    rig.run(2 * LEASE_S).write(0, ENABLE, 1200, peer=OTHER)
    assert rig.loop.decision.state is not State.OFF
    rig.write(0, 0)
    for _ in range(3):
        assert rig.run(2 * LEASE_S).answer(0, ENABLE, 1200, peer=OTHER)


def test_what_hung_begins_by_no_frame_without_a_heartbeat_that_its_pool_brings_now_and_then() -> None:
    """By one of its connections the word had come last before the heartbeat moved, and was a new one for that."""
    rig = begun()
    rig.is_cell_silent = True
    rig.run(0.5)
    first, second = (Peer(OTHER.host, port) for port in (4002, 4003))
    for beat, word in ((4, second), (5, first), (5, first), (5, first), (5, first)):
        rig.write(1, 1200, 0, 0, beat, peer=first)
        assert rig.run(0.05).answer(0, ENABLE, peer=word)
    rig.is_cell_silent = False
    refused = rig.run(0.2).answer(0, ENABLE, peer=second)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    rig.write(1, 1200, 0, 0, 6, peer=first)
    assert rig.answer(0, ENABLE, peer=second) is None, "its program goes on"


def test_a_zero_of_enable_that_comes_with_the_bit_of_a_tare_lets_no_refused_start_go() -> None:
    """What came behind it was taken for a new one."""
    rig = begun()
    rig.write(0, ENABLE, 1200, 0, 0, 90, peer=OTHER)
    assert rig.answer(1, 0, 0, 0, 1) and rig.answer(0, TARE), "another one owns"
    rig.write(0, 0, 0, 0, 0, 91, peer=OTHER)
    refused = rig.answer(0, ENABLE)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    assert rig.answer(0, ENABLE, 1200, 0, 0, 2) is None, "its program goes on"


def test_who_stands_still_does_not_own_what_ramps_down_for_a_lost_master() -> None:
    """Another one was refused for an owner of whom nothing came any more."""
    rig = begun(lease_action=LeaseAction.RAMP)
    rig.write(0, ENABLE, 1200, 0, 0, 51, peer=OTHER)
    rig.run(0.25).answer(0, ENABLE | TARE, 1200, 0, 0, 91, peer=Peer(OTHER.host, OTHER.port + 1))
    assert rig.run(0.1).state is State.RAMPING and rig.bank.owner is None
    assert rig.answer(0, ENABLE, peer=OTHER) is None
    assert rig.bank.owner is None
    assert rig.answer(0, ENABLE, 1200, 0, 0, 2) is None, "there is no owner, and this program goes on"


def test_behind_a_refused_start_a_program_beside_it_on_its_host_tares() -> None:
    """Each of its tares came behind a refused run of the other one, and was taken for the same frame, for good."""
    rig = begun()
    rig.is_cell_silent = True
    assert rig.run(0.5).answer(0, ENABLE, peer=OTHER)
    other, answers = Peer(OTHER.host, OTHER.port + 1), []
    for cycle in range(4):
        rig.is_cell_silent = cycle < 3
        answers.append(rig.run(0.2).answer(0, TARE, 0, peer=other))
        rig.answer(4, 100 + cycle, peer=other)
        rig.answer(4, cycle, peer=OTHER)
        assert rig.answer(0, ENABLE, peer=OTHER) or cycle == 3
    assert answers[-1] is None, answers


def test_behind_a_stop_of_another_one_nothing_begins_that_has_never_beaten() -> None:
    """The register stood at its heartbeat, behind a power cut, say: no stop lasted longer than its cycle."""
    rig = begun()
    for _ in range(5):
        answers = [rig.answer(0, ENABLE, peer=OTHER), rig.answer(1, 300, 0, 0, 0, peer=OTHER)]
        rig.run(0.05).write(0, 0)
    assert answers[0] and answers[0].reason is RefusalReason.HEARTBEAT_STALE and rig.state is State.OFF
    rig.write(1, 300, 0, 0, 1, peer=OTHER)
    assert rig.answer(0, ENABLE, peer=OTHER) is None, "its program goes on"


def test_behind_the_0_of_another_program_on_its_host_nothing_begins_whose_heartbeat_has_stood_since_the_start() -> None:
    """Behind a power cut, say: it brought what stood in the register, had no beat to be too old, and began each time."""
    rig, twin = begun(), Peer(OTHER.host, OTHER.port + 1)
    answers = []
    for _ in range(5):
        answers.append(rig.answer(0, ENABLE, peer=OTHER))
        rig.answer(1, 300, 0, 0, 0, peer=OTHER)
        rig.run(0.05).write(0, 0, peer=twin)
        rig.run(0.05)
    assert answers[0] is None and all(answers[1:]), answers
    rig.write(1, 300, 0, 0, 1, peer=OTHER)
    assert rig.answer(0, ENABLE, peer=OTHER) is None, "its program goes on"


def test_a_tare_with_the_heartbeat_of_the_last_one_is_refused_however_late_it_comes() -> None:
    rig = begun()
    assert rig.answer(0, TARE, 0, 0, 0, 7, peer=OTHER) is None
    refused = rig.run(5.0).answer(0, TARE, 0, 0, 0, 7, peer=OTHER)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE


@pytest.mark.parametrize("is_beside_another", [False, True])
def test_behind_a_death_no_run_begins_again_of_a_program_that_hung_and_whose_run_another_one_had_ended(
    is_beside_another: bool,
) -> None:
    """No enable had fallen, so that no stop was seen; and the 0 of a program beside it, which hung too, was its own."""
    kept = dict[str, Any]()
    rig, other = begun(kept), Peer(OTHER.host, OTHER.port + 1)
    rig.write(0, 0, 0, 0, 0, 9, peer=other)
    rig.write(1, 0, 0, 0, 7, peer=OTHER)
    rig.write(0, CALIBRATE, peer=OTHER)
    assert rig.state is State.CALIBRATING
    rig.bank.mask_write(0, 0xFFFF & ~(ENABLE | CALIBRATE), 0, Peer("web"))
    assert rig.run(0.1).state is State.OFF
    for _ in range(2):
        if is_beside_another:
            rig.answer(0, 0, 0, 0, 0, 9, peer=other)
        rig = begun(kept)
        for _ in range(5):
            rig.write(1, 0, 0, 0, 7, peer=OTHER)
            refused = rig.answer(0, CALIBRATE, peer=OTHER)
            assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
            rig.run(0.2)
    rig.write(1, 0, 0, 0, 8, peer=OTHER)
    assert rig.answer(0, CALIBRATE, peer=OTHER) is None, "its program goes on"


@pytest.mark.parametrize("waits", [False, True])
def test_what_hung_begins_nothing_for_the_silence_of_a_gateway_that_stood_still(waits: bool) -> None:
    """Three seconds in which its frames were not heard were three in which it had not sent any."""
    rig = begun()
    rig.is_cell_silent = True
    assert rig.run(0.5).answer(0, ENABLE, 1200, 0, 0, 7, peer=OTHER)
    rig.is_cell_silent = False
    rig.run(0.2).ticks += 310
    if waits:
        rig.answer(4, 7, peer=OTHER)
    refused = rig.run(0.2).answer(0, ENABLE, 1200, 0, 0, 7, peer=OTHER)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    assert rig.run(3.1).answer(0, ENABLE, 1200, 0, 0, 7, peer=OTHER) is None, "who is silent for so long decides anew"


def test_behind_a_standstill_a_program_that_hung_does_not_undo_the_0_of_another_one_on_its_host() -> None:
    """Within 0.8 s of that 0 its next frame would have come, and been refused: nobody was there to hear it."""
    rig = begun()
    for beat in (6, 7):
        rig.run(0.05).write(0, ENABLE, 1200, 0, 0, beat, peer=OTHER)
    rig.run(0.2).write(0, 0, peer=Peer(OTHER.host, OTHER.port + 1))
    rig.run(0.2).ticks += 100
    refused = rig.run(0.2).answer(0, ENABLE, 1200, 0, 0, 7, peer=OTHER)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE and rig.state is State.OFF


def test_what_hung_takes_nothing_over_by_a_connection_of_its_pool_that_had_brought_another_word() -> None:
    """By that one its last word was older than its last heartbeat, and the takeover that was refused came by the other one."""
    rig = begun()
    first, second = (Peer(OTHER.host, port) for port in (4002, 4003))
    rig.write(0, TAKE)
    rig.wire.fault = FaultCode.OUTPUT_LOST
    for beat, peer, word in ((21, first, ENABLE), (22, second, ENABLE), (23, second, ENABLE | TAKE)):
        assert rig.run(0.05).answer(4, beat, peer=peer) and rig.answer(0, word, peer=peer)
    rig.wire.fault = FaultCode.NONE
    for peer in (second, first, first):
        rig.run(0.1).answer(4, 23, peer=second)
        assert rig.answer(0, ENABLE | TAKE, peer=peer)
    assert rig.bank.owner == OWNER.host
