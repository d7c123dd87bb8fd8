"""A running rig in this process, on ptys whose devices the test serves, as control and guardian begin and end it."""

import asyncio
import socket
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from gateway.processes import message_link
from gateway.processes.event_log import EventLog
from gateway.processes.exit_cause import Ending
from gateway.profiles import load_rig
from gateway.service.guardian_line import GuardianLine
from gateway.service.running_rig.handover import Handover
from gateway.service.running_rig.running_rig import RunningRig
from tests.end_to_end.own_devices import OwnDevices

Scene = Callable[[RunningRig, socket.socket], Awaitable[None]]


STANDSTILL_S = 5.0
"""Of loop, devices and all: a machine that others use stands still for 100 ms and more, of which a rig makes the fault that it
has to make; scenes that wait for a force would wait for ever. None of them is about these times, which have tests of their
own in virtual time (`wired`)."""


@pytest.fixture
def devices(tmp_path: Path) -> Iterator[OwnDevices]:
    """On a rig that allows such a pause."""
    with OwnDevices(tmp_path, stall_s=STANDSTILL_S, timeout_s=STANDSTILL_S) as devices:
        yield devices


def with_running_rig(
    devices: OwnDevices, scene: Scene, restarted: Ending | None = None, kept: dict[str, Any] | None = None
) -> list[str]:
    """Start a rig, play the scene, close it; return what was logged. kept: what the process before has left for this one."""
    lines: list[str] = []
    state = devices.directory / "state"
    state.mkdir()

    async def play(log: EventLog) -> None:
        ours, theirs = message_link.create_link()
        theirs.setblocking(False)
        profile = load_rig(str(devices.rig))
        guardian = GuardianLine(theirs)
        rig = RunningRig(profile, profile.ports(), state, guardian, log)
        try:
            await rig.start(["127.0.0.1", 0], Handover(kept or {}, record=False), restarted=restarted)
            rig.loop.is_watched = True  # as behind READY
            async with asyncio.timeout(10):
                await scene(rig, ours)
        finally:
            await rig.close()
            guardian.close()
            drop(ours)

    with EventLog(lines.append) as log:
        asyncio.run(play(log))
    return lines


def drop(guardian: socket.socket) -> None:
    """Close the guardian's end, and every descriptor that was passed to it."""
    while (message := message_link.receive(guardian)) is not None:
        for descriptor in message.descriptors:
            socket.close(descriptor)
    guardian.close()
