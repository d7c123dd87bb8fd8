"""Callers of control.sock, by their bytes: lines in bits and in piles, halves, lines without an end, answers not read."""

import json
import socket
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.processes.json_socket import server as json_server
from gateway.processes.json_socket.connection import SocketLimits
from gateway.processes.json_socket.server import JsonLineServer
from tests.service.requests.drawn.world import World
from tests.service.requests.test_hostile_requests import CONTROL

LIMITS = SocketLimits(callers=4, idle_s=1.0, spared_s=0.3)
READS = [{"do": verb} for verb in ("running", "health", "state", "last-refusal", "last-writer", "self-test")]
MOST_HELD = 2 * 65536 + (1 << 20)
TURNS = 40


class Caller:
    """lines: sent, and not answered yet. rest: of a line of which a part was sent. reads: takes its answers."""

    def __init__(self, wire: socket.socket, now_s: float) -> None:
        self.wire, self.spoke_s = wire, now_s
        self.lines, self.rest, self.heard = deque[bytes](), b"", b""
        self.is_spoiled, self.reads, self.was_deaf, self.is_closed, self.is_slow = False, True, False, False, False

    @property
    def is_owed(self) -> bool:
        """Whether an answer must be there: of a line that is not whole yet there is none."""
        return self.reads and len(self.lines) > bool(self.rest) and not self.is_spoiled


class Callers:
    """The socket with its server, served by the world's loop, and who asks there."""

    def __init__(self, world: World, draw: Random, patch: pytest.MonkeyPatch) -> None:
        self._world, self._draw, self.broken = world, draw, list[str]()
        self._server: JsonLineServer = world.stage.server
        self._answers: dict[bytes, bytes] = {}
        self._callers, self._number = list[Caller](), 0
        patch.setattr(json_server, "time", SimpleNamespace(thread_time=lambda: 0.0))
        self._serve()

    def _serve(self) -> None:
        server, answer = self._server, self._server.answer

        def answered(line: bytes, *, has_waited: bool = False) -> Any:
            given = answer(line, has_waited=has_waited)
            if line in self._answers:
                self.broken.append(f"{line[:80]!r} is executed twice")
            if line.endswith(b"\n"):  # else not by these
                self._answers[line] = given if isinstance(given, bytes) else given.result(timeout=0.0)
            return given

        server.answer, server.limits = answered, LIMITS  # type: ignore[method-assign]
        server.loop, server._is_serving = self._world, True  # type: ignore[assignment]
        server._look_at_file = lambda: None  # type: ignore[method-assign]  # it has no file here
        listener = server._listener = socket.socket(socket.AF_UNIX)
        listener.setblocking(False)
        listener.bind(b"")
        listener.listen(16)
        server._await_connection()
        server._sweep()
        self._come().is_slow = True

    def act(self, look: Callable[[], Any], differences: Callable[[Any, Any], list[str]]) -> str:
        """What a caller says; nothing but what is answered with ok changes anything."""
        draw, before = self._draw, look()
        known, alive = set(self._answers), [one for one in self._callers if not one.is_slow]
        how = draw.choice(
            (self._come, self._say, self._say, self._say, self._pile, self._endless, self._deafen, self._go)
        )
        for _ in range(draw.randrange(1, 6) if how == self._come else 0):
            self._come().is_slow = draw.random() < 0.5
        caller = draw.choice(alive) if alive else self._come()
        if how != self._come:
            how(caller)  # type: ignore[call-arg]
        self._turn()
        fresh = [line for line in self._answers if line not in known]
        is_taken = any(self._answers[line].startswith(b'{"ok": true') for line in fresh)
        if not is_taken and (changes := differences(before, look())):
            self.broken.append(f"{how.__name__} of {[line[:80] for line in fresh]} changes {changes[:6]}")
        return f"{how.__name__} {[line[:80] for line in fresh]} of {len(self._callers)}"

    # -- what they do

    def _come(self) -> Caller:
        wire = socket.socket(socket.AF_UNIX)
        wire.setblocking(False)
        wire.connect(self._server._listener.getsockname())  # type: ignore[union-attr]
        self._callers.append(caller := Caller(wire, self._world.clock.now_s))
        self._turn()
        for each in self._server._callers:  # little is on its way: who takes nothing is soon waited for
            each._peer.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        return caller

    def _line(self) -> bytes:
        """Each is another one, by blanks at its end."""
        draw, self._number = self._draw, self._number + 1
        which = draw.random()
        line = json.dumps(draw.choice(READS)).encode() if which < 0.7 else json.dumps(draw.choice(CONTROL)).encode()
        if which > 0.9:
            line = line[: draw.randrange(len(line))] + draw.randbytes(draw.randrange(3)).replace(b"\n", b"")
        return line + b" " * self._number + b"\n"

    def _slow(self, caller: Caller) -> None:
        """From now on it says a byte now and then, and never a whole line."""
        caller.is_slow = caller.reads and not (caller.lines or caller.is_spoiled)

    def _say(self, caller: Caller) -> None:
        """One line, or a part of it, and then the rest in bits."""
        line = caller.rest or self._line()
        if not caller.rest:
            caller.lines.append(line)
        at = self._draw.choice((len(line), len(line), self._draw.randrange(1, len(line) + 1)))
        for k in range(0, at, step := self._draw.choice((1, 7, 1000))):
            self._send(caller, line[k : min(k + step, at)])
            self._turn(2)
        caller.rest = line[at:]

    def _pile(self, caller: Caller) -> None:
        lines = [self._line() for _ in range(self._draw.randrange(2, 12))]
        caller.lines.extend(lines)
        self._send(caller, caller.rest + b"".join(lines))
        caller.rest = b""

    def _endless(self, caller: Caller) -> None:
        if self._draw.random() < 0.3:
            caller.is_spoiled = True
            for _ in range(70):
                self._send(caller, b"[" * 1000)
                self._turn(3)
            self._turn()
            if caller.reads and not caller.is_closed:
                self.broken.append("a line without an end is waited for")

    def _deafen(self, caller: Caller) -> None:
        """Who asks for much and takes nothing, and then all of it."""
        caller.reads, caller.was_deaf = not caller.reads, True
        if not caller.reads:
            self._pile(caller)

    def _go(self, caller: Caller) -> None:
        caller.wire.close()
        caller.is_closed = True
        self._callers.remove(caller)

    def _send(self, caller: Caller, data: bytes) -> None:
        with suppress(OSError):
            caller.wire.send(data)

    # -- what they hear

    def _turn(self, count: int = TURNS) -> None:
        for _ in range(count):
            self._world.poll()
            self._world.clock.advance(0.0)
        self.collect()

    def collect(self) -> None:
        """Take what has been answered; whatever was asked and is not answered by now is missed."""
        for caller in tuple(self._callers):
            if caller.reads:
                self._take(caller)
        if len(self._server._callers) > LIMITS.callers:
            self.broken.append(f"{len(self._server._callers)} callers are served")
        for each in self._server._callers:
            if len(each._unread) + len(each._unsent) > MOST_HELD:
                self.broken.append(f"{len(each._unread)} and {len(each._unsent)} bytes are held for a caller")

    def _take(self, caller: Caller) -> None:
        try:
            while data := caller.wire.recv(1 << 20):
                caller.heard += data
            caller.is_closed = True
        except BlockingIOError:
            pass
        except OSError:
            caller.is_closed = True
        *answers, caller.heard = caller.heard.split(b"\n")
        for answer in answers:
            self._judge_answer(caller, answer)
        if caller.is_closed:
            caller.wire.close()
            self._callers.remove(caller)

    def _judge_answer(self, caller: Caller, answer: bytes) -> None:
        if b"connections are open" in answer:
            if len(self._callers) <= LIMITS.callers:
                self.broken.append(f"{answer!r} to one of {len(self._callers)}")
        elif answer.endswith(b'closed"}'):
            idle_s, is_many = self._world.clock.now_s - caller.spoke_s, b"others are waiting" in answer
            if not (caller.is_spoiled or caller.was_deaf or idle_s >= (LIMITS.spared_s if is_many else LIMITS.idle_s)):
                self.broken.append(f"{answer!r} after {idle_s:.3f} s")
        elif not caller.is_spoiled:
            line = caller.lines.popleft() if caller.lines else b""
            if self._answers.get(line) != answer + b"\n":
                self.broken.append(f"{line[:80]!r} is answered {answer[:200]!r}")
            caller.spoke_s = self._world.clock.now_s

    def judge_soon(self) -> None:
        """Whoever reads, and has asked for whole lines, has its answers; who asks for nothing is gone after a while."""
        for slow in [one for one in self._callers if one.is_slow]:
            self._send(slow, b"{")
        self._turn(4)
        now_s, most_s = self._world.clock.now_s, 1.25 * LIMITS.idle_s + 0.1
        idle = [one for one in self._callers if not one.was_deaf and now_s - one.spoke_s > most_s]
        self.broken += [
            f"a caller is still there {now_s - one.spoke_s:.3f} s after its last whole line" for one in idle
        ]
        for _ in range(TURNS):
            if not (late := [one for one in self._callers if one.is_owed]):
                return
            self._turn(4)
        self.broken += [f"{one.lines[0][:80]!r} is not answered" for one in late]

    def close(self) -> None:
        self._server._let_go()
        for each in tuple(self._server._callers):
            each.close()
        for caller in self._callers:
            caller.wire.close()
