"""One connection to a JSON socket: a request at a time, and the next is not read before its answer is taken."""

import asyncio
import contextlib
import socket
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Protocol

from gateway.defaults import PILE_S
from gateway.processes.json_socket.messages import encode_answer, error_answer


@dataclass(frozen=True, slots=True)
class SocketLimits:
    """idle_s: from one whole answer to the next whole request. spared_s: nobody who spoke within it makes room for another."""

    callers: int = 32
    idle_s: float = 30.0
    spared_s: float = 1.0
    longest_line: int = 65536


class ConnectionServer(Protocol):
    """Server as its connections need it."""

    limits: SocketLimits
    loop: asyncio.AbstractEventLoop

    def enqueue(self, turn: Callable[[], None]) -> None:
        """Put something to do at the end of the queue. It must not raise."""

    def answer(self, line: bytes, *, has_waited: bool) -> bytes | Future[bytes]:
        """Return the answer to one line, whatever it is, or a future of it. has_waited: behind others, and its caller may be
        gone."""
        ...

    def note_activity(self, caller: "JsonConnection") -> None:
        """Make this caller the one that spoke last."""

    def forget_connection(self, caller: "JsonConnection") -> None:
        """Drop a caller that has left."""


class JsonConnection:
    """One caller: reads, waits for its turn, has one line answered, waits until the answer is taken.

    spoke_s: when it last connected, or took a whole answer; the loop's time.
    """

    def __init__(self, server: ConnectionServer, peer: socket.socket) -> None:
        self.spoke_s = 0.0
        self._server = server
        self._peer = peer
        self._unread = bytearray()
        self._read_s = 0.0  # when the last of it was read
        self._is_late = False
        self._unsent = b""
        self._is_last = False  # nothing more comes
        self._is_deaf = False  # nothing more is wanted: what comes is dropped until the caller ends

    def listen(self) -> None:
        """Wait for the next bytes."""
        self._is_late = self._is_late and self._has_more()
        self._server.loop.add_reader(self._peer, self._on_readable)

    def _has_more(self) -> bool:
        try:
            return bool(self._peer.recv(1, socket.MSG_PEEK))
        except OSError:  # nothing, or it has left
            return False

    def _on_readable(self) -> None:
        self._server.loop.remove_reader(self._peer)
        self._server.enqueue(self._receive)

    def _receive(self) -> None:
        if self._is_closed:
            return
        try:
            chunk = self._peer.recv(self._server.limits.longest_line)
        except BlockingIOError:
            self.listen()
            return
        except OSError:
            self.close()
            return
        self._is_last, self._read_s = not chunk, self._server.loop.time()
        if not self._is_deaf:
            self._unread += chunk
            self._answer_next()
        elif self._is_last:
            self.close()
        else:
            self.listen()

    def _answer_next(self) -> None:
        """A text without a newline before the end of the stream is a line too."""
        if self._is_closed:
            return
        longest = self._server.limits.longest_line
        end = self._unread.find(b"\n") + 1 or (len(self._unread) if self._is_last else 0)
        if (end or len(self._unread)) > longest:
            self._stop_listening(f"a line of more than {longest} bytes")
        elif end:
            line = bytes(self._unread[:end])
            del self._unread[:end]
            self._is_late = self._is_late or self._server.loop.time() - self._read_s >= PILE_S
            answer = self._server.answer(line, has_waited=self._is_late)
            if isinstance(answer, Future):
                answer.add_done_callback(lambda done: self._server.enqueue(lambda: self._send(done.result())))
            else:
                self._send(answer)
        elif self._is_last:
            self.close()
        else:
            self.listen()

    def _send(self, data: bytes) -> None:
        if self._is_closed:
            return
        try:
            sent = self._peer.send(data)
        except BlockingIOError:
            sent = 0
        except OSError:
            self.close()
            return
        if sent < len(data):
            self._unsent = data[sent:]
            self._server.loop.add_writer(self._peer, self._on_writable)
        else:
            self._server.note_activity(self)
            self._continue()

    def _on_writable(self) -> None:
        self._server.loop.remove_writer(self._peer)
        self._server.enqueue(self._send_rest)

    def _send_rest(self) -> None:
        data, self._unsent = self._unsent, b""
        self._send(data)

    def _continue(self) -> None:
        if self._unread:
            self._server.enqueue(self._answer_next)
        else:
            self.listen()

    def dismiss(self, why: str) -> None:
        """Say why, if it takes a line now, and close."""
        if not self._unsent:
            with contextlib.suppress(OSError):
                self._peer.send(encode_answer(error_answer(f"{why}: closed")).encode() + b"\n")
        self.close()

    def _stop_listening(self, why: str) -> None:
        """Say why and end our direction. A close now would take the sentence away from a caller that is still writing."""
        self._unread.clear()
        self._is_deaf = True
        with contextlib.suppress(OSError):
            self._peer.send(encode_answer(error_answer(f"{why}: closed")).encode() + b"\n")
            self._peer.shutdown(socket.SHUT_WR)
        self.listen()

    @property
    def _is_closed(self) -> bool:
        return self._peer.fileno() < 0

    def close(self) -> None:
        """Close the connection; a closed one stays closed."""
        if not self._is_closed:
            self._server.loop.remove_reader(self._peer)
            self._server.loop.remove_writer(self._peer)
            self._peer.close()
        self._server.forget_connection(self)


def close_with_sentence(peer: socket.socket, sentence: str) -> None:
    """Close a connection that is not served, and say why if it takes a line now."""
    with contextlib.suppress(OSError):
        peer.send(encode_answer(error_answer(sentence)).encode() + b"\n")
    peer.close()
