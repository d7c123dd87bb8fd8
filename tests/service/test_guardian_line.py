"""Control's end of the guardian's line: whom a beat wakes, what is told last, and what is left of it without a guardian."""

import asyncio
import contextlib
import os
from pathlib import Path

import pytest

from gateway.processes import message_link
from gateway.service.guardian_line import GuardianLine
from gateway.service.heartbeat_memory import HeartbeatMemory
from tests.processes.test_message_link import Pair, ends

__all__ = ["ends"]


def test_a_loop_that_beats_in_memory_wakes_nobody(ends: Pair) -> None:
    memory = os.memfd_create("beat")

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1], HeartbeatMemory(memory))
        for tick in range(100):
            guardian.heartbeat(tick * 0.004)
        ends[0].setblocking(False)
        with pytest.raises(BlockingIOError):
            message_link.receive(ends[0])
        guardian.close()

    asyncio.run(scene())
    os.close(memory)


def test_the_end_of_the_guardian_is_heard_once_and_what_it_would_have_been_told_goes(ends: Pair) -> None:
    """Heard at each turn of the loop, it would take the processor from the ramp; kept, what is told would hold its ports."""
    reader, writer = os.pipe()

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        ends[0].close()
        async with asyncio.timeout(2):
            await guardian.told_to_stop.wait()
        assert not asyncio.get_running_loop().remove_reader(ends[1].fileno())
        before = len(list(Path("/proc/self/fd").iterdir()))
        for _ in range(10):
            guardian.hand_over(writer, b"SET 0\r\n", b"0\r\n", b"\r\n")
        assert len(list(Path("/proc/self/fd").iterdir())) == before
        guardian.close()

    asyncio.run(scene())
    for descriptor in (reader, writer):
        os.close(descriptor)


def test_what_has_waited_until_the_end_is_still_told(ends: Pair) -> None:
    """The cause of the end among it."""

    async def scene() -> int:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        sent = 0
        with contextlib.suppress(BlockingIOError):
            while True:
                message_link.send(ends[1], message_link.HEARTBEAT)
                sent += 1
        guardian.first_cause("internal error: ZeroDivisionError()")
        for _ in range(sent):
            assert message_link.receive(ends[0]) == message_link.Message(message_link.HEARTBEAT)
        guardian.close()
        return sent

    assert asyncio.run(scene()) > 0
    last = message_link.receive(ends[0])
    assert last and last.body == {"text": "internal error: ZeroDivisionError()"}
