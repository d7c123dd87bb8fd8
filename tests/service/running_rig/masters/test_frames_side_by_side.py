"""A master with more than one frame, or connection: what each brings counts by itself."""

from collections.abc import Callable
from struct import pack

import pytest

from gateway.modbus import Peer
from gateway.registers.words import State
from tests.control.bench import settings
from tests.service.running_rig.simulated_rig import ENABLE, OWNER, SmallRig

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
