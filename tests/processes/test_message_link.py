"""The line between guardian and control: messages stay whole, a descriptor arrives open, an end is an end."""

import array
import asyncio
import contextlib
import errno
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from gateway.processes import message_link
from gateway.service.guardian_line import GuardianLine

Pair = tuple[socket.socket, socket.socket]


@pytest.fixture
def ends() -> Iterator[Pair]:
    ours, theirs = message_link.create_link()
    yield ours, theirs
    ours.close()
    theirs.close()


def test_a_message_arrives_whole_with_its_body(ends: Pair) -> None:
    message_link.send(ends[0], message_link.READY, {"stall_s": 0.1, "banner": "x" * 5000})
    message_link.send(ends[0], message_link.HEARTBEAT)
    first, second = message_link.receive(ends[1]), message_link.receive(ends[1])
    assert first and first.tag == message_link.READY
    assert first.body["stall_s"] == 0.1
    assert len(first.body["banner"]) == 5000
    assert second == message_link.Message(message_link.HEARTBEAT)


def test_a_descriptor_is_the_same_open_file_at_the_other_end(ends: Pair, tmp_path: Path) -> None:
    with (tmp_path / "port").open("w+b") as port:
        message_link.send(ends[0], message_link.LINE, {"safe_frame": "00"}, port.fileno())
        message = message_link.receive(ends[1])
        assert message
        (passed,) = message.descriptors
        os.write(passed, b"SET 0\r\n")
        os.close(passed)
        assert port.seek(0) == 0
        assert port.read() == b"SET 0\r\n"
    assert message.body == {"safe_frame": "00"}


def test_a_descriptor_outlives_the_one_that_was_passed(ends: Pair) -> None:
    """What the guardian needs: control is dead, its descriptor closed, the port still open here."""
    reader, writer = os.pipe()
    message_link.send(ends[0], message_link.LINE, {}, writer)
    os.close(writer)
    message = message_link.receive(ends[1])
    assert message
    os.write(message.descriptors[0], b"safe")
    os.close(message.descriptors[0])
    assert os.read(reader, 16) == b"safe"
    assert os.read(reader, 16) == b""
    os.close(reader)


def test_the_end_of_the_line_is_none_and_not_an_exception(ends: Pair) -> None:
    message_link.send(ends[0], message_link.HEARTBEAT)
    ends[0].close()
    assert message_link.receive(ends[1]) == message_link.Message(message_link.HEARTBEAT)
    assert message_link.receive(ends[1]) is None


def test_a_peer_killed_with_unread_messages_is_an_end_too(ends: Pair) -> None:
    """Unix sockets answer ECONNRESET when the peer died with data unread."""
    message_link.send(ends[1], message_link.STOP)
    ends[0].close()
    assert message_link.receive(ends[1]) is None


def test_the_last_words_of_a_peer_killed_with_unread_messages_are_heard(ends: Pair) -> None:
    """The line that it has handed over is the way to the safe voltage."""
    message_link.send(ends[0], message_link.LINE, {"safe_frame": "00"})
    message_link.send(ends[1], message_link.STOP)
    ends[0].close()
    assert message_link.receive(ends[1]) == message_link.Message(message_link.LINE, {"safe_frame": "00"})
    assert message_link.receive(ends[1]) is None


def test_a_heartbeat_goes_out_eight_times_in_the_silence_that_kills_and_not_at_each_tick(ends: Pair) -> None:
    async def scene() -> list[str]:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        guardian.ready({}, 0.1)
        for tick in range(100):
            guardian.heartbeat(tick * 0.004)
        guardian.close()
        ends[0].setblocking(False)
        tags = []
        with contextlib.suppress(BlockingIOError):
            while message := message_link.receive(ends[0]):
                tags.append(message.tag)
        return tags

    tags = asyncio.run(scene())
    assert tags[0] == message_link.READY
    assert tags[1:] == [message_link.HEARTBEAT] * 25, "0.4 s in ticks of 4 ms: at 0, 16, 32 ..."


def test_control_hears_stop_and_the_end_of_its_guardian(ends: Pair) -> None:
    async def scene() -> tuple[bool, bool]:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        message_link.send(ends[0], message_link.STOP)
        async with asyncio.timeout(2):
            await guardian.told_to_stop.wait()
        was_gone = guardian.is_gone
        guardian.told_to_stop.clear()
        ends[0].close()
        async with asyncio.timeout(2):
            await guardian.told_to_stop.wait()
        guardian.heartbeat(0.0)  # nobody listens: no exception
        guardian.first_cause("nobody hears it")
        is_gone = guardian.is_gone
        guardian.close()
        return was_gone, is_gone

    assert asyncio.run(scene()) == (False, True)


def test_control_hands_over_its_port_with_the_safe_frame(ends: Pair) -> None:
    reader, writer = os.pipe()

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        guardian.hand_over(writer, b"SET 0\r\n", b"0\r\n", b"\r\n")
        guardian.close()

    asyncio.run(scene())
    message = message_link.receive(ends[0])
    assert message and message.tag == message_link.LINE
    assert bytes.fromhex(message.body["safe_frame"]) == b"SET 0\r\n"
    assert bytes.fromhex(message.body["safe_reply"]) == b"0\r\n"
    assert bytes.fromhex(message.body["reply_end"]) == b"\r\n"
    for descriptor in (*message.descriptors, reader, writer):
        os.close(descriptor)
    assert len(message.descriptors) == 1


def test_control_asks_for_the_simulated_ports_and_gets_them_or_the_reason(ends: Pair) -> None:
    async def scene(answer: dict[str, object]) -> dict[str, str] | None:
        ours, theirs = message_link.create_link()
        theirs.setblocking(False)
        guardian = GuardianLine(theirs)
        asking = asyncio.ensure_future(guardian.simulated_ports("demo"))
        await asyncio.sleep(0)
        question = message_link.receive(ours)
        assert question == message_link.Message(message_link.NEED_RIG, {"rig": "demo"})
        message_link.send(ours, message_link.RIG, answer)
        async with asyncio.timeout(2):
            ports = await asking
        guardian.close()
        ours.close()
        return ports

    ptys = {"output": "/dev/pts/1", "load_cell": "/dev/pts/2"}
    assert asyncio.run(scene({"ptys": ptys})) == ptys
    assert asyncio.run(scene({"failed": 78})) is None


def test_control_does_not_wait_for_ports_of_a_guardian_that_is_gone(ends: Pair) -> None:
    async def scene() -> dict[str, str] | None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        asking = asyncio.ensure_future(guardian.simulated_ports("demo"))
        await asyncio.sleep(0)
        ends[0].close()
        async with asyncio.timeout(2):
            ports = await asking
        guardian.close()
        return ports

    assert asyncio.run(scene()) is None


def test_a_guardian_that_does_not_read_does_not_stop_the_loop(ends: Pair) -> None:
    async def scene() -> bool:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        for _ in range(10_000):
            guardian.heartbeat(0.0)
        guardian.close()
        return guardian.is_gone

    assert not asyncio.run(scene()), "a full line is not the end of it"
    received = list(iter(lambda: message_link.receive(ends[0]), None))
    assert all(message == message_link.Message(message_link.HEARTBEAT) for message in received), "what arrives is whole"
    assert 0 < len(received) < 10_000, "the line was never full: this test shows nothing"


@pytest.mark.parametrize("words", [b"r{", b"r[]", b"r3", b"r\xff", b"r" + b"[" * 50_000, b"r" + b"x" * 70_000])
def test_what_is_no_message_is_told_apart_from_an_end(ends: Pair, words: bytes) -> None:
    ends[0].send(words)
    with pytest.raises(message_link.ProtocolError):
        message_link.receive(ends[1])
    message_link.send(ends[0], message_link.HEARTBEAT)
    assert message_link.receive(ends[1]) == message_link.Message(message_link.HEARTBEAT), "the next one is whole again"


def test_four_descriptors_arrive_and_of_more_all_are_closed_and_no_message(ends: Pair) -> None:
    before = len(list(Path("/proc/self/fd").iterdir()))
    message_link.send(ends[0], message_link.FORK, {}, *[0] * 4)
    four = message_link.receive(ends[1])
    assert four and len(four.descriptors) == 4 and four.drop_descriptors() is None  # which closes them
    message_link.send(ends[0], message_link.LINE, {}, *[0] * 9)
    with pytest.raises(message_link.ProtocolError):
        message_link.receive(ends[1])
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_no_call_waits(ends: Pair) -> None:
    with pytest.raises(BlockingIOError):
        message_link.receive(ends[0])
    with pytest.raises(BlockingIOError):
        for _ in range(10_000):
            message_link.send(ends[0], message_link.HEARTBEAT)


def test_a_port_that_was_handed_over_is_no_inheritance_of_other_children(ends: Pair) -> None:
    message_link.send(ends[0], message_link.LINE, {}, ends[0].fileno())
    message = message_link.receive(ends[1])
    assert message and not os.get_inheritable(message.descriptors[0])
    message.drop_descriptors()


def test_what_a_full_line_does_not_take_comes_after_it_in_order(ends: Pair) -> None:
    """A guardian that was stopped for seconds misses heartbeats, but neither the port nor READY."""
    reader, writer = os.pipe()

    async def scene() -> None:
        ends[1].setblocking(False)
        guardian = GuardianLine(ends[1])
        for _ in range(10_000):
            guardian.heartbeat(0.0)
        guardian.hand_over(writer, b"SET 0", b"", b"")
        os.close(writer)
        guardian.ready({}, 0.1)
        while message_link.receive(ends[0]) != message_link.Message(message_link.HEARTBEAT):
            pass
        with contextlib.suppress(BlockingIOError):
            while message_link.receive(ends[0]):
                pass
        guardian.heartbeat(0.0)
        guardian.close()

    asyncio.run(scene())
    handed, ready, beat = (message_link.receive(ends[0]) for _ in range(3))
    assert handed and ready and beat
    assert [handed.tag, ready.tag, beat.tag] == [message_link.LINE, message_link.READY, message_link.HEARTBEAT]
    os.write(handed.descriptors[0], b"SET 0")
    handed.drop_descriptors()
    assert os.read(reader, 16) == b"SET 0"
    os.close(reader)


def test_control_learns_that_its_simulated_ports_have_moved(ends: Pair) -> None:
    async def scene() -> list[dict[str, str]]:
        ends[1].setblocking(False)
        guardian, moved = GuardianLine(ends[1]), []
        guardian.on_ports = moved.append
        asking = asyncio.ensure_future(guardian.simulated_ports("demo"))
        for number in (1, 2):
            message_link.send(ends[0], message_link.RIG, {"ptys": {"output": f"/dev/pts/{number}"}})
        async with asyncio.timeout(2):
            assert await asking == {"output": "/dev/pts/1"}
            while not moved:
                await asyncio.sleep(0)
        guardian.close()
        return moved

    assert asyncio.run(scene()) == [{"output": "/dev/pts/2"}]


def test_a_descriptor_that_came_with_no_message_is_closed(ends: Pair) -> None:
    reader, writer = os.pipe()
    os.set_blocking(reader, False)
    ends[0].sendmsg([b""], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [writer]))])
    os.close(writer)
    assert message_link.receive(ends[1]) is None
    assert os.read(reader, 1) == b"", "nobody holds the other end any more"
    os.close(reader)


def test_a_line_that_fails_in_whatever_way_is_at_its_end() -> None:
    """Never an exception: it would end the guardian."""

    class Broken:
        def recvmsg(self, *_: object) -> None:
            raise OSError(errno.ENOBUFS, "No buffer space available")

    assert message_link.receive(Broken()) is None  # type: ignore[arg-type]
