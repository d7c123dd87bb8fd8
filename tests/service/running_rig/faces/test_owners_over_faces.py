"""One owner, whichever face each master comes by: who is refused, whose heartbeat counts, and what a takeover leaves."""

from struct import pack

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer
from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.rtu import BROADCAST_UNIT, encode_adu
from gateway.registers.words import State
from tests.control.bench import settings
from tests.fieldbus.test_rtu_waiting import Scene
from tests.service.running_rig.simulated_rig import ENABLE, RESET, TAKE, TARE, SmallRig

LEASE_S, UNIT = 0.35, 3
PAGE, ROBOT, BUS, PLC = Peer("web"), Peer("10.0.0.7", 5), Peer("serial:1"), Peer("10.0.0.7", 9, name="plc")
FRAME = ENABLE, 1200, 0, 0


def _held_by(peer: Peer) -> SmallRig:
    rig = SmallRig(settings(lease_s=LEASE_S))
    rig.beats = False
    for beat in range(8):
        rig.run(0.1).write(0, *FRAME, 10 + beat, peer=peer)
    assert rig.state in (State.RAMPING, State.HOLDING) and rig.bank.owner == peer.identity
    return rig


def _beats_in_vain(rig: SmallRig, peer: Peer) -> None:
    """Until the lease is over: what is refused renews none, nor does it press behind it."""
    for beat in range(12):
        for words in ((4, 200 + beat), (0, *FRAME, 300 + beat), (1, 400), (0, TARE | ENABLE)):
            refused = rig.answer(*words, peer=peer)
            is_over = rig.state is State.FAULT
            assert is_over or (refused and (refused.code, refused.reason) == (6, RefusalReason.NOT_OWNER))
        rig.run(0.05)
    assert (rig.state, rig.wire.voltage_v) == (State.FAULT, 0.0)


@pytest.mark.sampled
@pytest.mark.parametrize("takes_over", [False, True])
@pytest.mark.parametrize(("owner", "other"), [(PAGE, ROBOT), (ROBOT, BUS), (BUS, PLC), (PLC, PAGE), (ROBOT, PLC)])
def test_the_heartbeat_of_its_owner_alone_keeps_a_force_up(owner: Peer, other: Peer, takes_over: bool) -> None:
    rig = _held_by(owner)
    if takes_over:
        rig.write(0, ENABLE | TAKE, 600, 0, 0, 99, peer=other)
    assert rig.bank.owner == (other if takes_over else owner).identity
    _beats_in_vain(rig, owner if takes_over else other)


@pytest.mark.sampled
@pytest.mark.parametrize("words", [(0, 0), (0, ENABLE | TAKE, 600, 0, 0, 77), (0, TARE), (0, RESET), (4, 80), (1, 400)])
def test_a_broadcast_on_a_bus_does_what_the_same_request_does_and_says_nothing(
    words: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    outcomes = []
    for unit in (UNIT, BROADCAST_UNIT):
        scene, rig = Scene(monkeypatch), _held_by(ROBOT)
        scene.server._bank = rig.bank  # type: ignore[assignment]
        address, *data = words
        scene.hear(encode_adu(unit, P.write_registers_request(address, pack(f">{len(data)}H", *data))))
        scene.run(scene.now_s + 0.1)
        refused = rig.bank.last_refusal
        outcomes.append((rig.run(0.2).state, rig.bank.owner, rig.words(0, 13), refused and refused.reason))
        assert bool(scene.sent) is (unit == UNIT)
    assert outcomes[0] == outcomes[1]
