"""A local socket that answers one JSON object per line: the control socket of a gateway, and that of a simulated rig.

It lives in the control loop, so whatever is sent must cost that loop next to nothing. Everything that callers cause (a
connection, a chunk, a request) waits in one queue; one item is done at a time, and then the queue rests nine times as long as
that took: the socket has a tenth of the loop, however many ask. A caller has one request at a time, and the next is not
read before its answer is taken. Raw sockets rather than asyncio's streams: those accept a hundred connections and answer
a thousand buffered lines in one go, which is longer than a tick.

A gateway works without it, so a place where no socket can be made is a sentence and no exception.
"""

import asyncio
import contextlib
import errno
import os
import socket
import time
import traceback
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any, Final

from gateway.processes.disk_worker import DiskWorker
from gateway.processes.json_socket.connection import JsonConnection, SocketLimits, close_with_sentence
from gateway.processes.json_socket.messages import (
    LONGEST_ANSWER,
    Answer,
    encode_answer,
    error_answer,
    has_huge_number,
    load_shallow,
    refuse_constant,
    why_path_too_long,
    why_too_large,
)

Handler = Callable[[dict[str, Any]], Answer | Future[Answer]]
"""A future, done in the loop, is for what waits for a disk."""
_SHARE: Final = 0.1  # of the loop's time
_LONGEST_REST_S: Final = 0.5
_NO_DESCRIPTOR_S: Final = 0.1
_LOOK_BOUND_S: Final = 0.1  # a disk that takes longer keeps the file
_GONE: Final = "its directory is gone: make it again (mkdir), and it is served again"


class JsonLineServer:
    """Serves PATH (mode 0600): each line {"do": NAME, ...} goes to handlers[NAME], whose answer gets "ok": true.

    A handler refuses by raising ValueError or OSError; the caller reads {"ok": false, "error": sentence}. Anything else that it
    raises is an internal error: the caller reads that, log gets the traceback, and all goes on.
    """

    def __init__(
        self,
        path: Path,
        handlers: dict[str, Handler],
        log: Callable[[str, str], None] = lambda cause, sentence: None,
        limits: SocketLimits | None = None,
    ) -> None:
        self.limits = limits or SocketLimits()
        self.has_waited = False  # the line that is handled now: behind others of its caller, which may be gone
        self._path = path
        self._handlers = handlers
        self._log = log
        self._is_serving = False  # from `start` to `close`, whether it has a socket or waits for one
        self._listener: socket.socket | None = None
        self._file: os.stat_result | None = None
        self._callers: dict[JsonConnection, None] = {}  # in the order in which they last spoke
        self._queue: deque[Callable[[], None]] = deque()
        self._turn: asyncio.TimerHandle | None = None
        self._sweep_timer: asyncio.TimerHandle | None = None
        self._is_looking = False  # where its file leads: a disk may keep that waiting
        self._told = ""  # why its file leads elsewhere

    async def start(self) -> str:
        """Begin to serve; empty, or a sentence that says why nothing is served: tried again, but for a path that is too
        long, until `close`."""
        if why := why_path_too_long(self._path):
            return self._unserved(why)
        self.loop, self._is_serving = asyncio.get_running_loop(), True
        try:
            self._path.unlink(missing_ok=True)
            self._listener = self._bind()
        except OSError as error:
            self._told = error.strerror or str(error)
        self._await_connection()
        self._sweep()
        return self._unserved(self._told) if self._told else ""

    def _unserved(self, why: str) -> str:
        return f"{self._path} is not served, its tools will not find this gateway: {why}"

    def _bind(self) -> socket.socket:
        listener = socket.socket(socket.AF_UNIX)
        listener.setblocking(False)
        previous = os.umask(0o177)
        try:
            listener.bind(str(self._path))
            listener.listen(128)
            self._file = self._path.stat()
        except OSError:
            listener.close()
            raise
        finally:
            os.umask(previous)
        return listener

    async def close(self) -> None:
        """Close at once: a caller that reads nothing would never let go of a polite close."""
        if not self._is_serving:
            return
        self._is_serving = False
        self._let_go()
        for caller in tuple(self._callers):
            caller.close()
        for timer in (self._turn, self._sweep_timer):
            if timer:
                timer.cancel()
        self._queue.clear()
        ends_s = self.loop.time() + _LOOK_BOUND_S
        while self._is_looking and self.loop.time() < ends_s:
            await asyncio.sleep(1e-3)
        if not self._is_looking and self._why_lost() == "":
            with contextlib.suppress(OSError):
                self._path.unlink(missing_ok=True)

    def _let_go(self) -> None:
        if self._listener:
            self.loop.remove_reader(self._listener)
            self._listener.close()
            self._listener = None

    # -- its file

    def _why_lost(self) -> str | None:
        """Return why the path no longer leads here, empty where it does; None where it leads nowhere. While the socket is open
        the number of its inode is given to no other."""
        try:
            there = self._path.stat()
            return "" if self._file and os.path.samestat(there, self._file) else "another file has its name"
        except FileNotFoundError:
            return None
        except OSError as error:
            return error.strerror or str(error)

    def _look(self) -> str | None:
        """As above, and the way is free where a dead socket stands in it: it came back with a folder that was moved away."""
        why = self._why_lost()
        if not why or not _is_dead(self._path):
            return why
        with contextlib.suppress(OSError):
            self._path.unlink()
        return None

    def _look_at_file(self) -> None:
        """In a thread: of a network's folder whose server is away the mere question has no end, and the loop would stand."""
        if self._is_looking:
            return
        self._is_looking = True
        looking = DiskWorker()
        looking(self._look, self._on_looked)
        looking.close()

    def _on_looked(self, why: str | BaseException | None) -> None:
        self._is_looking = False
        if self._is_serving and not isinstance(why, BaseException):  # else no thread was to be had
            self._keep_file(why)

    def _keep_file(self, why: str | None) -> None:
        """Make a new file where there is none: who cleans up a folder must not part a gateway from its tools. What others have
        put in its place stays theirs. why: it leads elsewhere."""
        if why is None:
            try:
                fresh = self._bind()
            except OSError as error:
                if error.errno == errno.EADDRINUSE:
                    return  # another file has come since: the next look tells what it is
                why = _GONE if error.errno == errno.ENOENT else error.strerror or str(error)
            else:
                was = "removed: it is served again" if self._listener else "not to be had: it is served now"
                self._let_go()
                self._listener = fresh
                self._await_connection()
                self._log("socket", f"{self._path} was {was}")
        if why and why != self._told:
            self._log("socket", f"E152 {self._unserved(why)}")
        self._told = why or ""

    # -- one thing at a time

    def enqueue(self, turn: Callable[[], None]) -> None:
        """Put something to do at the end of the queue. It must not raise."""
        self._queue.append(turn)
        if self._turn is None:
            self._turn = self.loop.call_later(0.0, self._take_turn)

    def _take_turn(self) -> None:
        if not self._queue or self._listener is None:
            self._turn = None
            return
        began_s = time.thread_time()  # what it cost, not how long others on this machine had the processor meanwhile
        self._queue.popleft()()
        took_s = time.thread_time() - began_s
        self._turn = self.loop.call_later(min(took_s * (1.0 / _SHARE - 1.0), _LONGEST_REST_S), self._take_turn)

    # -- connections

    def _await_connection(self) -> None:
        if self._listener is not None:
            self.loop.add_reader(self._listener, self._on_connection)

    def _on_connection(self) -> None:
        assert self._listener
        self.loop.remove_reader(self._listener)
        self.enqueue(self._accept)

    def _accept(self) -> None:
        assert self._listener
        try:
            peer, _ = self._listener.accept()
        except BlockingIOError:
            self._await_connection()
            return
        except OSError:  # no descriptor is left: it stays in the kernel's queue meanwhile
            self.loop.call_later(_NO_DESCRIPTOR_S, self._await_connection)
            return
        self._await_connection()
        peer.setblocking(False)
        if len(self._callers) >= self.limits.callers and not self._make_room():
            close_with_sentence(peer, f"{self.limits.callers} connections are open, the most allowed: try again")
            return
        caller = JsonConnection(self, peer)
        self.note_activity(caller)
        caller.listen()

    def _make_room(self) -> bool:
        """Whoever has been silent for longest goes, if that is long enough: silent callers lock nobody out."""
        silent = next(iter(self._callers))
        if self.loop.time() - silent.spoke_s < self.limits.spared_s:
            return False
        silent.dismiss("others are waiting, and nothing was asked here for longest")
        return True

    def note_activity(self, caller: JsonConnection) -> None:
        """Make this caller the one that spoke last."""
        caller.spoke_s = self.loop.time()
        self._callers.pop(caller, None)
        self._callers[caller] = None

    def forget_connection(self, caller: JsonConnection) -> None:
        """Drop a caller that has left."""
        self._callers.pop(caller, None)

    def _sweep(self) -> None:
        oldest_s = self.loop.time() - self.limits.idle_s
        for caller in [caller for caller in self._callers if caller.spoke_s <= oldest_s]:
            caller.dismiss(f"no whole request for {self.limits.idle_s:g} s")
        self._look_at_file()
        self._sweep_timer = self.loop.call_later(self.limits.idle_s / 4.0, self._sweep)

    # -- requests

    def answer(self, line: bytes, *, has_waited: bool = False) -> bytes | Future[bytes]:
        """Return the answer to one line, whatever it is, or a future of it."""
        self.has_waited = has_waited
        answer: Answer | Future[Answer] = {}

        def handled() -> Answer:
            nonlocal answer
            answer = self._handle_line(line)
            return {} if isinstance(answer, Future) else answer

        text = self._encode(handled)
        if not isinstance(answer, Future):
            return text
        later: Future[bytes] = Future()
        answer.add_done_callback(lambda done: later.set_result(self._encode(done.result)))
        return later

    def _encode(self, take: Callable[[], Answer]) -> bytes:
        """Return the line of the answer that is taken, or of why there is none."""
        try:
            text = encode_answer({"ok": True} | take())
            if len(text) > LONGEST_ANSWER:
                text = encode_answer(error_answer(f"the answer would have {len(text)} bytes"))
        except (ValueError, OSError) as error:
            text = encode_answer(error_answer(str(error)))
        except Exception as error:
            self._log(
                "internal",
                "A499 internal error in an answer of the control socket, please report it:\n" + traceback.format_exc(),
            )
            sentence = f"internal error, please report it with the gateway's log: {type(error).__name__}: {error}"
            text = encode_answer(error_answer(sentence))
        return text.encode() + b"\n"

    def _handle_line(self, line: bytes) -> Answer | Future[Answer]:
        if has_huge_number(line):
            return error_answer("a number of more digits than any that means something")
        try:
            request = load_shallow(line, parse_constant=refuse_constant)
            handler = self._handlers[request["do"]]
        except (ValueError, KeyError, TypeError):
            return error_answer(f'expected {{"do": one of {", ".join(sorted(self._handlers))}, ...}}')
        if too_much := why_too_large(request):
            return error_answer(too_much)
        return handler(request)


def _is_dead(path: Path) -> bool:
    """Is this a socket without a listener? Nobody can listen on it any more: whoever binds makes a file of his own."""
    with socket.socket(socket.AF_UNIX) as caller:
        caller.setblocking(False)  # of one that has no room it is told at once
        try:
            caller.connect(str(path))
        except OSError as error:
            return error.errno == errno.ECONNREFUSED and path.is_socket()
    return False
