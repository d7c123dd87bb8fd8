"""Accepted sockets under one epoll, and each by itself as off Linux; on both loops."""

import asyncio
import itertools
import socket
from dataclasses import dataclass, field
from typing import Any

import pytest

from gateway.fieldbus import socket_transport
from gateway.fieldbus.socket_transport import IN_A_ROW_S, READ_BYTES, ReadySockets, SocketTransport

EITHER = pytest.mark.parametrize("has_epoll", [True, False])


@dataclass(eq=False)
class Noting(asyncio.Protocol):
    """Notes what it is told; `act` does with its transport what a test wants of it."""

    act: Any = None
    heard: list[bytes] = field(default_factory=list)
    lost: list[Any] = field(default_factory=list)
    paused: int = 0
    transport: Any = None

    def connection_made(self, transport: Any) -> None:
        self.transport = transport

    def data_received(self, data: bytes) -> None:
        self.heard.append(data)
        if self.act:
            self.act(self.transport, data)

    def pause_writing(self) -> None:
        self.paused += 1
        self.transport.abort()

    def connection_lost(self, error: Any) -> None:
        self.lost.append(error)


def echo(transport: SocketTransport, data: bytes) -> None:
    transport.write(data)


class Scene:
    """Some sockets that are served, and their far ends."""

    def __init__(self, acts: list[Any], *, has_epoll: bool = True) -> None:
        self.ready = ReadySockets(has_epoll=has_epoll)
        self.ends, self.far = [], []
        for act in acts:
            near, far = socket.socketpair()
            far.setblocking(False)
            self.ends.append(Noting(act))
            self.far.append(far)
            self.ready.add(near, self.ends[-1])

    async def heard(self, number: int, size: int) -> bytes:
        """So many bytes at a far end, fewer where it ends."""
        found = b""
        async with asyncio.timeout(10):
            while len(found) < size and (more := await asyncio.get_running_loop().sock_recv(self.far[number], 65536)):
                found += more
        return found

    async def end(self) -> None:
        for protocol in self.ends:
            protocol.transport.abort()
        self.ready.close()
        for far in self.far:
            far.close()
        await self.until(lambda: all(protocol.lost for protocol in self.ends))
        assert self.ready._epoll is None or self.ready._epoll.closed

    async def until(self, condition: Any) -> None:
        async with asyncio.timeout(10):
            while not condition():
                await asyncio.sleep(0)


@EITHER
def test_each_gets_its_own_answer_and_is_read_a_bounded_piece_at_once(run: Any, has_epoll: bool) -> None:
    async def main() -> None:
        scene = Scene([echo] * 5, has_epoll=has_epoll)
        for number, far in enumerate(scene.far):
            far.send(bytes((number,)) * 3000)
        for number in range(5):
            assert await scene.heard(number, 3000) == bytes((number,)) * 3000
            assert max(map(len, scene.ends[number].heard)) <= READ_BYTES
        await scene.end()

    run(main())


def test_all_that_have_something_are_served_in_one_turn_of_the_loop(run: Any) -> None:
    async def main() -> None:
        scene = Scene([echo] * 20)
        for far in scene.far:
            far.send(b"x")
        await scene.until(lambda: any(protocol.heard for protocol in scene.ends))
        assert all(protocol.heard == [b"x"] for protocol in scene.ends)
        await scene.end()

    run(main())


@pytest.mark.parametrize(("sockets", "rounds"), [(7, 1), (8, 3)])
def test_many_that_have_more_at_once_are_served_again_for_so_long_at_most(
    run: Any, monkeypatch: pytest.MonkeyPatch, sockets: int, rounds: int
) -> None:
    clock_s = itertools.count(0.0, 1.01 / 3 * IN_A_ROW_S)
    monkeypatch.setattr(socket_transport, "monotonic", lambda: next(clock_s))

    def ask_again(transport: SocketTransport, _: bytes) -> None:
        number = [protocol.transport for protocol in scene.ends].index(transport)
        if len(scene.ends[number].heard) < 50:  # or a loop that never gets its turn would be none for the test, either
            scene.far[number].send(b"x")

    async def main() -> None:
        nonlocal scene
        scene = Scene([ask_again] * sockets)
        for far in scene.far:
            far.send(b"x")
        await scene.until(lambda: any(protocol.heard for protocol in scene.ends))
        assert [len(protocol.heard) for protocol in scene.ends] == [rounds] * sockets
        await scene.end()

    scene: Scene
    run(main())


@EITHER
def test_what_does_not_fit_waits_is_sent_in_order_and_before_the_end(run: Any, has_epoll: bool) -> None:
    def flood(transport: SocketTransport, _: bytes) -> None:
        transport.set_write_buffer_limits(high=1 << 24)
        for number in range(16):
            transport.write(bytes((number,)) * 100_000)
        transport.close()
        transport.write(b"behind the end")

    async def main() -> None:
        scene = Scene([flood], has_epoll=has_epoll)
        scene.far[0].send(b"x")
        expected = b"".join(bytes((number,)) * 100_000 for number in range(16))
        assert await scene.heard(0, 1 << 24) == expected
        assert scene.ends[0].lost == [None]
        await scene.end()

    run(main())


@EITHER
def test_who_does_not_read_is_told_of_at_the_cap(run: Any, has_epoll: bool) -> None:
    async def main() -> None:
        scene = Scene([lambda transport, _: transport.write(bytes(1 << 20))], has_epoll=has_epoll)
        scene.far[0].send(b"x")
        await scene.until(lambda: scene.ends[0].lost)
        assert scene.ends[0].paused == 1
        await scene.end()

    run(main())


@EITHER
def test_who_says_that_nothing_more_comes_still_gets_the_whole_answer(run: Any, has_epoll: bool) -> None:
    """As a program does that shuts its sending half and reads to the end."""

    def answer(transport: SocketTransport, _: bytes) -> None:
        transport.set_write_buffer_limits(high=1 << 21)
        transport.write(bytes(1 << 20))

    async def main() -> None:
        scene = Scene([answer], has_epoll=has_epoll)
        scene.far[0].send(b"x")
        scene.far[0].shutdown(socket.SHUT_WR)
        await scene.until(lambda: scene.ends[0].transport._is_closing)
        assert await scene.heard(0, 1 << 20) == bytes(1 << 20)
        assert await scene.heard(0, 1) == b""
        await scene.end()

    run(main())


@EITHER
def test_what_is_written_while_something_waits_comes_behind_it(run: Any, has_epoll: bool) -> None:
    """Ahead of it, it would stand in the middle of another answer."""

    async def main() -> None:
        scene = Scene([lambda *_: None], has_epoll=has_epoll)
        transport = scene.ends[0].transport
        transport.set_write_buffer_limits(high=1 << 21)
        transport.write(bytes(1 << 20))
        found = scene.far[0].recv(1 << 18)  # there is room again, and the loop has not been round
        transport.write(b"end")
        size = (1 << 20) + 3 - len(found)
        assert found + await scene.heard(0, size) == bytes(1 << 20) + b"end"
        await scene.until(lambda: not transport._waiting)
        assert not (epoll := scene.ready._epoll) or epoll.poll(0) == [], (
            "a socket that takes bytes wakes nobody for ever"
        )
        await scene.end()

    run(main())


@EITHER
def test_one_that_closes_hears_nothing_more_whoever_resumes_and_ends_once(run: Any, has_epoll: bool) -> None:
    async def main() -> None:
        told: list[Any] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context))
        scene = Scene([lambda *_: None], has_epoll=has_epoll)
        transport = scene.ends[0].transport
        transport.set_write_buffer_limits(high=1 << 21)
        transport.write(bytes(1 << 20))
        transport.close()
        transport.resume_reading()
        scene.far[0].send(b"too late")
        assert await scene.heard(0, 1 << 20) == bytes(1 << 20)
        for _ in range(2):
            transport.abort()
        await scene.until(lambda: scene.ends[0].lost)
        for _ in range(5):
            await asyncio.sleep(0)
        assert scene.ends[0].heard == [] and scene.ends[0].lost == [None] and told == []
        await scene.end()

    run(main())


@EITHER
def test_who_pauses_hears_the_rest_when_it_goes_on(run: Any, has_epoll: bool) -> None:
    async def main() -> None:
        scene = Scene([lambda transport, _: transport.pause_reading(), echo], has_epoll=has_epoll)
        scene.far[0].send(bytes(READ_BYTES) + b"rest")
        await scene.until(lambda: scene.ends[0].heard)
        scene.far[1].send(b"y")
        assert await scene.heard(1, 1) == b"y" and scene.ends[0].heard == [bytes(READ_BYTES)]
        assert not (epoll := scene.ready._epoll) or epoll.poll(0) == [], "what is not read wakes nobody for ever"
        scene.ends[0].transport.resume_reading()
        await scene.until(lambda: len(scene.ends[0].heard) == 2)
        assert scene.ends[0].heard[1] == b"rest"
        await scene.end()

    run(main())


@EITHER
def test_a_failing_protocol_loses_its_connection_and_no_other(run: Any, has_epoll: bool) -> None:
    def fail(_: SocketTransport, __: bytes) -> None:
        raise ZeroDivisionError

    async def main() -> None:
        told: list[Any] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context["exception"]))
        scene = Scene([fail, echo], has_epoll=has_epoll)
        for far in scene.far:
            far.send(b"x")
        assert await scene.heard(1, 1) == b"x"
        assert await scene.heard(0, 1) == b""
        assert [type(error) for error in told] == [ZeroDivisionError] and scene.ends[1].lost == []
        await scene.end()

    run(main())


@EITHER
def test_one_that_another_has_ended_in_the_same_turn_hears_nothing_more(run: Any, has_epoll: bool) -> None:
    async def main() -> None:
        scene = Scene([lambda *_: [each.transport.abort() for each in scene.ends]] * 8, has_epoll=has_epoll)
        for far in scene.far:
            far.send(b"x")
        await scene.until(lambda: all(protocol.lost for protocol in scene.ends))
        assert sum(len(protocol.heard) for protocol in scene.ends) == 1
        assert [protocol.lost for protocol in scene.ends] == [[None]] * 8
        await scene.end()

    run(main())


@EITHER
def test_a_far_end_that_has_gone_ends_it_once_whatever_is_under_way(run: Any, has_epoll: bool) -> None:
    async def main() -> None:
        scene = Scene([echo, lambda transport, _: transport.pause_reading()] * 2, has_epoll=has_epoll)
        scene.ends[1].transport.set_write_buffer_limits(high=1 << 24)
        for far in scene.far[1:]:
            far.send(b"x")
        await scene.until(lambda: all(protocol.heard for protocol in scene.ends[1:]))
        scene.ends[1].transport.write(bytes(1 << 22))
        for far in scene.far:
            far.close()
        scene.ends[3].transport.write(b"too late")
        await scene.until(lambda: all(protocol.lost for protocol in scene.ends))
        told = [error for protocol in scene.ends for error in protocol.lost]
        assert told[0] is None and len(told) == 4
        assert all(isinstance(error, BrokenPipeError | ConnectionResetError) for error in told[1:])
        await scene.end()

    run(main())
