"""Control's end of the guardian's line: whom a beat wakes, what is told last, and what is left of it without a guardian."""

import asyncio
import contextlib
import errno
import os
import socket
from pathlib import Path
from typing import Any

import pytest

from gateway.defaults import MOST_FRAMES
from gateway.processes import message_link
from gateway.service.guardian_line import GuardianLine
from gateway.service.heartbeat_memory import HeartbeatMemory
from tests.processes.test_message_link import Pair, ends

__all__ = ["ends"]


def fill(link: socket.socket) -> int:
    """Send until the line takes nothing more; return how many messages wait in it."""
    sent = 0
    with contextlib.suppress(BlockingIOError):
        while True:
            message_link.send(link, message_link.HEARTBEAT)
            sent += 1
    return sent


def test_a_loop_that_beats_in_memory_wakes_nobody(ends: Pair) -> None:
    memory = os.memfd_create("beat")

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1], HeartbeatMemory(memory))
        for tick in range(100):
            guardian.heartbeat(tick * 0.004, None, [65535 - tick, 7, 65535 - tick, tick])
        assert HeartbeatMemory(memory).master_beats == (65436, 7, 99)
        ends[0].setblocking(False)
        with pytest.raises(BlockingIOError):
            message_link.receive(ends[0])
        guardian.close()

    asyncio.run(scene())
    os.close(memory)


def test_the_guardian_is_told_who_owns_and_the_next_process_finds_its_last_heartbeats(ends: Pair) -> None:
    memory = os.memfd_create("beat")

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1], HeartbeatMemory(memory))
        for tick, owner in enumerate(("10.0.0.5", "10.0.0.5", None, None)):
            guardian.heartbeat(0.01 * tick, owner, range(tick, tick + 10))
        told = [message_link.receive(ends[0]) for _ in range(2)]
        assert [message and message.body for message in told] == [{"owner": "10.0.0.5"}, {"owner": None}]
        guardian.close()

    asyncio.run(scene())
    ours, theirs = socket.socketpair()

    async def next_one() -> tuple[tuple[int, ...] | None, ...]:
        lines = GuardianLine(ours, HeartbeatMemory(memory)), GuardianLine(theirs)
        found = lines[0].left_beats, lines[1].left_beats
        for line in lines:
            line.close()
        return found

    assert asyncio.run(next_one()) == (tuple(range(3, 3 + 1 + MOST_FRAMES)), None), (
        "the last one, and those of its frames"
    )
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


def test_a_line_that_cannot_be_handed_over_says_so(ends: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> int:
        raise OSError(errno.EMFILE, "Too many open files")

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        monkeypatch.setattr(os, "dup", full)
        with pytest.raises(OSError, match="Too many"):
            guardian.hand_over(ends[1].fileno(), b"SET 0\r\n", b"0\r\n", b"\r\n")
        guardian.close()

    asyncio.run(scene())
    ends[0].setblocking(False)
    assert message_link.receive(ends[0]) is None, "nothing was told of it"


def test_a_line_that_is_lost_is_taken_back(ends: Pair) -> None:
    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        guardian.take_back()
        guardian.close()

    asyncio.run(scene())
    assert message_link.receive(ends[0]) == message_link.Message(message_link.LINE_LOST)


def test_what_has_waited_until_the_end_is_still_told(ends: Pair) -> None:
    """The cause of the end among it."""

    async def scene() -> int:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        sent = fill(ends[1])
        guardian.first_cause("internal error: ZeroDivisionError()")
        for _ in range(sent):
            assert message_link.receive(ends[0]) == message_link.Message(message_link.HEARTBEAT)
        guardian.close()
        return sent

    assert asyncio.run(scene()) > 0
    last = message_link.receive(ends[0])
    assert last and last.body == {"text": "internal error: ZeroDivisionError()"}


def test_what_the_line_did_not_take_goes_with_the_next_beat_and_in_order(ends: Pair) -> None:
    """The port of the output among it, which nobody would guard until something else was told."""
    memory = os.memfd_create("beat")

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1], HeartbeatMemory(memory))
        waiting = fill(ends[1])
        guardian.hand_over(memory, b"SET 0\r\n", b"0\r\n", b"\r\n")
        guardian.keep(calibration=3)
        for _ in range(waiting):
            assert message_link.receive(ends[0]) == message_link.Message(message_link.HEARTBEAT)
        guardian.heartbeat(1.0)
        line, kept = message_link.receive(ends[0]), message_link.receive(ends[0])
        assert line and kept and (line.tag, len(line.descriptors)) == (message_link.LINE, 1)
        assert (kept.tag, kept.body) == (message_link.KEEP, {"calibration": 3})
        line.drop_descriptors()
        guardian.close()

    asyncio.run(scene())
    os.close(memory)


def test_a_fact_for_the_next_process_is_told_whenever_it_has_changed_and_not_at_each_tick(ends: Pair) -> None:
    ports = {"0": 8802}

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        for zero_n in (0.0, 0.0, 8.3, 8.3, 0.0):
            guardian.keep(zero_n=zero_n)
        for place in ("0", "1", "1"):
            ports[place] = 8802
            guardian.keep(tls_ports=ports)
        guardian.close()

    asyncio.run(scene())
    told = [message.body for message in iter(lambda: message_link.receive(ends[0]), None)]
    both = {"0": 8802, "1": 8802}
    assert told == [{"zero_n": 0.0}, {"zero_n": 8.3}, {"zero_n": 0.0}, {"tls_ports": {"0": 8802}}, {"tls_ports": both}]


@pytest.mark.parametrize("size", [100_000, 1_000_000])
def test_a_cause_of_any_length_is_told_by_its_beginning(ends: Pair, size: int) -> None:
    """An exception may hold what it could not read; a message that is too long has no end, and was taken for nonsense."""

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        guardian.first_cause(f"internal error: UnicodeDecodeError('utf-8', b'{'x' * size}')")
        told = message_link.receive(ends[0])
        assert told is not None and told.tag == message_link.FIRST_CAUSE
        assert told.body["text"].startswith("internal error: UnicodeDecodeError('utf-8', b'xxx")
        assert len(told.body["text"]) < 10_000
        guardian.close()

    asyncio.run(scene())


def test_a_line_that_is_closed_reads_and_beats_no_more(ends: Pair) -> None:
    """Its number may be another file's by then, and the memory goes with it."""
    number = os.memfd_create("beat")

    async def scene() -> None:
        ends[1].setblocking(False)
        memory = HeartbeatMemory(number)
        guardian = GuardianLine(ends[1], memory)
        reads = ends[1].fileno()
        guardian.heartbeat(7.5)
        assert memory.beat_s == 7.5
        guardian.close()
        assert ends[1].fileno() == -1
        assert not asyncio.get_running_loop().remove_reader(reads)
        with pytest.raises(ValueError, match="released"):
            memory.beat(1.0)

    asyncio.run(scene())
    os.close(number)


def test_a_simulated_rig_that_comes_again_is_followed_to_its_ports_and_its_process(ends: Pair) -> None:
    async def scene() -> None:
        ends[1].setblocking(False)
        guardian, moved, failed = GuardianLine(ends[1]), list[dict[str, str]](), list[dict[str, Any]]()
        asyncio.get_running_loop().set_exception_handler(lambda loop, context: failed.append(context))
        guardian.on_ports = moved.append
        asked = asyncio.create_task(guardian.simulated_ports("demo"))
        await asyncio.sleep(0)
        need = message_link.receive(ends[0])
        assert need and (need.tag, need.body) == (message_link.NEED_RIG, {"rig": "demo"})
        message_link.send(ends[0], message_link.RIG, {"ptys": {"output": "/dev/pts/1"}, "pid": 7})
        assert await asked == {"output": "/dev/pts/1"}
        assert (guardian.rig_pid, moved) == (7, [])
        for body in ({"pid": 8, "failed": True}, {"ptys": {"output": "/dev/pts/2"}, "pid": 9}):
            message_link.send(ends[0], message_link.RIG, body)
            while guardian.rig_pid != body["pid"]:
                await asyncio.sleep(0.001)
        assert (moved, failed) == ([{"output": "/dev/pts/2"}], [])
        guardian.close()

    asyncio.run(asyncio.wait_for(scene(), 5.0))


def test_what_the_guardian_is_told_are_its_own_words(ends: Pair) -> None:
    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        guardian.note_safe()
        guardian.ready({"port": 5020}, 0.4)
        for now_s in (1.0, 1.02, 1.051, 1.09, 1.102):
            guardian.heartbeat(now_s)
        told = [message_link.receive(ends[0]) for _ in range(5)]
        assert [one and (one.tag, one.body) for one in told] == [
            (message_link.SAFE, {}),
            (message_link.READY, {"port": 5020, "stall_s": 0.4}),
            *[(message_link.HEARTBEAT, {})] * 3,
        ]
        ends[0].setblocking(False)
        with pytest.raises(BlockingIOError):
            message_link.receive(ends[0])
        message_link.send(ends[0], message_link.STOP)
        await asyncio.wait_for(guardian.told_to_stop.wait(), 2.0)
        assert guardian.is_gone is False
        guardian.close()

    asyncio.run(scene())


def test_a_start_that_waits_for_the_simulated_rig_ends_with_its_guardian(ends: Pair) -> None:
    """Nobody is left to answer: without an end the process would stay, and hold the state directory."""

    async def scene() -> dict[str, str] | None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        asked = asyncio.ensure_future(guardian.simulated_ports("demo"))
        await asyncio.sleep(0)
        ends[0].close()
        async with asyncio.timeout(2):
            ports = await asked
        assert guardian.is_gone and guardian.told_to_stop.is_set()
        guardian.close()
        return ports

    assert asyncio.run(scene()) is None
