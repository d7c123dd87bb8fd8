"""A gateway that starts, behind a restart too: masters are answered at once, and nothing presses before it is watched."""

import socket
import struct

import pytest

from gateway.processes.exit_cause import EndCause, Ending
from gateway.registers.refusal import Refusal
from gateway.service.running_rig.running_rig import RunningRig
from tests.end_to_end.own_devices import OwnDevices
from tests.service.running_rig.test_running_rig import MASTER, devices, pressing, with_running_rig

__all__ = ["devices"]  # a fixture of theirs


def test_masters_are_answered_before_the_guardian_watches_and_enable_nothing_until_it_does(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Behind a restart they are there at once; a loop that stood still then would be missed half a minute later."""
    is_ready, was = list[bool](), RunningRig._show_faces

    def served(rig: RunningRig) -> None:
        was(rig)
        with pytest.raises(Refusal, match="W213"):
            rig.bank.write_registers(0, struct.pack(">6H", 1, 0, 0, 1, 0, 4000), MASTER)
        is_ready.append(bool(rig.bank.read_bits(101, 1)[0]))

    async def scene(rig: RunningRig, _: socket.socket) -> None:
        await pressing(rig, devices)

    monkeypatch.setattr(RunningRig, "_show_faces", served)
    with_running_rig(devices, scene, Ending(EndCause.MACHINE_BUSY, "anything"))
    assert is_ready == [False]
