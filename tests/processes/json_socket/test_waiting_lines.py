"""Whether a line has waited behind others of its own caller: what it asks may be of one who is gone by now."""

import contextlib
import socket
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest

from gateway.processes.json_socket.connection import JsonConnection, SocketLimits


@dataclass(eq=False)
class HandServer:
    """Answers a line in each turn, which takes turn_s, and notes whether it has waited."""

    theirs: socket.socket
    turn_s: float = 0.01
    now_s: float = 100.0
    limits: SocketLimits = field(default_factory=SocketLimits)
    queue: deque[Callable[[], None]] = field(default_factory=deque)
    readers: list[Callable[[], None]] = field(default_factory=list)
    has_waited: list[bool] = field(default_factory=list)

    @property
    def loop(self) -> Any:
        return self

    def time(self) -> float:
        return self.now_s

    def add_reader(self, _peer: socket.socket, readable: Callable[[], None]) -> None:
        self.readers.append(readable)

    def remove_reader(self, _peer: socket.socket) -> None:
        self.readers.clear()

    remove_writer = remove_reader

    def enqueue(self, turn: Callable[[], None]) -> None:
        self.queue.append(turn)

    def answer(self, _line: bytes, *, has_waited: bool = False) -> bytes:
        self.has_waited.append(has_waited)
        return b"{}\n"

    def note_activity(self, caller: JsonConnection) -> None:
        pass

    forget_connection = note_activity

    def serve(self, turns: int) -> None:
        for readable in tuple(self.readers):
            readable()
        for _ in range(turns):
            if self.queue:
                self.queue.popleft()()
            elif self.readers:
                self.readers[0]()
            self.now_s += self.turn_s
            with contextlib.suppress(BlockingIOError):
                self.theirs.recv(65536)


@pytest.fixture
def pair() -> Iterator[tuple[HandServer, socket.socket]]:
    ours, theirs = socket.socketpair()
    server = HandServer(theirs)
    ours.setblocking(False)
    theirs.setblocking(False)
    caller = JsonConnection(server, ours)
    caller.listen()
    yield server, theirs
    caller.close()
    theirs.close()


def test_lines_behind_a_quarter_of_a_second_of_others_have_waited_until_none_is_left(
    pair: tuple[HandServer, socket.socket],
) -> None:
    server, theirs = pair
    line = b'{"do": "echo"}'.ljust(999) + b"\n"
    assert theirs.send(line * 100) == 100_000, "more than is read at once"
    server.serve(120)
    assert len(server.has_waited) == 100
    assert server.has_waited[:24] == [False] * 24
    assert server.has_waited[27:] == [True] * 73, "what is read behind them, too"
    server.serve(200)
    theirs.send(line)
    server.serve(2)
    assert server.has_waited[100:] == [False], "it has come behind all that"


@pytest.mark.parametrize("under_way", [1, 2, 10])
def test_lines_of_who_waits_for_answers_have_never_waited(
    under_way: int, pair: tuple[HandServer, socket.socket]
) -> None:
    server, theirs = pair
    theirs.send(b"{}\n" * under_way)
    for _ in range(500):
        answered = len(server.has_waited)
        server.serve(1)
        theirs.send(b"{}\n" * (len(server.has_waited) - answered))
    assert len(server.has_waited) > 200
    assert not any(server.has_waited)
