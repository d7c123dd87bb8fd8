"""One Modbus TCP connection on asyncio: bytes to requests, answers back in order, and no peer can hurt the others.

Decisions:
- What one wake-up can bring is bounded, by a transport that reads no more at once: the 256 KiB of asyncio's and uvloop's own
  would be 20 000 requests in a row, 100 ms without control.
- A peer that sends as much as is read at once, or has had its requests of one turn, gives way: reading pauses until the loop
  has been round once.
- Who waits for the rate of its address has its place in the row: one that pipelines would else be there first each time, and
  a heartbeat of the same machine waited until its lease was over.
- Answers of one wake-up are joined into one write. Requests that must wait stay in the framer while reading is paused,
  so what is held for a peer is at most one read and one partial frame.
- A peer that does not read is closed when the transport asks to pause writing (its high-water mark is the cap).
- A master that sends a request in single bytes (URScript has nothing else) and lets TCP gather them (Nagle) sends the rest when
  the first is acknowledged, which TCP puts off by 40 ms: so half a frame is acknowledged at once, where the system can (Linux).
- No timer and no clock per request: a flag says that something was answered, one sweep for all connections reads it.
- Whatever but ModbusError comes out of the bank is our bug: the connection is cut and the exception goes on to the
  loop's handler.
"""

import asyncio
import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Final, Protocol, cast

from gateway.fieldbus.peers import Peers, address_of
from gateway.fieldbus.rate_limits import LATE_S, Backlog, LogLimiter, RequestRate
from gateway.fieldbus.settings import ServerSettings
from gateway.fieldbus.socket_transport import READ_BYTES
from gateway.fieldbus.waiting_bytes import count_waiting
from gateway.modbus.fast import whole_answer
from gateway.modbus.mbap import Adu, FramingLost, MbapFramer, encode
from gateway.modbus.peer import Peer
from gateway.modbus.server import DataBank, answer, refuse_unit

GIVES_WAY_S: Final = 10.0
"""So long a connection was silent that gives way where there is no room: most often its master has lost power or network, of
which nobody is told, and begins anew. A few of these would keep it out until they have been idle for long enough."""
_ACKNOWLEDGE_NOW: Final[int] = getattr(socket, "TCP_QUICKACK", 0)
_REQUESTS_IN_A_TURN: Final = 16  # a refused write costs more than a read: 85 of them from each of 32 peers are a stall


class Timer(Protocol):
    """Handle of a delayed call."""

    def cancel(self) -> None:
        """Cancel the call."""


class Clock(Protocol):
    """Methods of an event loop that a connection needs; a test's own clock has the same two."""

    def time(self) -> float:
        """Return the loop's time, s."""
        ...

    def call_later(self, delay: float, callback: Callable[[], None], /) -> Timer:
        """Call back after delay s."""
        ...


@dataclass(slots=True)
class ServerState:
    """State that all connections of one server share. connections: in the order in which they came, and are looked at."""

    bank: DataBank
    settings: ServerSettings
    clock: Clock
    log: LogLimiter
    peers: Peers
    on_peer_closed: Callable[[Peer], None]
    connections: dict["Connection", None] = field(default_factory=dict)
    on_last_gone: Callable[[], None] = lambda: None
    closing: bool = False

    def refusal(self, host: str, now_s: float) -> str | None:
        """Return why this address may not connect now; None: it may, if need be in the place of a silent one."""
        refusal = self.peers.refusal(host)
        return refusal if refusal and not self.longest_silent(host, now_s) else None

    def longest_silent(self, host: str, now_s: float) -> "Connection | None":
        """Return the connection that gives way to a new one of this host, None where all are in use."""
        rivals = self.peers.rivals(host)
        silent = [each for each in self.connections if each.peer.host in rivals and each.silent_s(now_s) >= GIVES_WAY_S]
        return max(silent, key=lambda each: (each.silent_s(now_s), -each.peer.port), default=None)


class Connection(asyncio.Protocol):
    """Made by the server for each accepted socket. The server calls sweep() and abort(), the transport the rest."""

    def __init__(self, shared: ServerState) -> None:
        self._shared = shared
        self._framer = MbapFramer()
        self._partial_since_s: float | None = None  # while reading: set exactly when the framer holds something
        self._closing_since_s: float | None = None
        self._resume: Timer | None = None
        self._answered = True
        self._last_answer_s = 0.0
        self._admitted = False
        self._rate: RequestRate | None = None
        self._has_place = False  # in the row of those who wait for the rate of one address
        self._backlog = Backlog()
        self._read_s, self._taken = 0.0, 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Admit the peer, or abort the connection where there are too many."""
        shared, now_s = self._shared, self._shared.clock.time()
        self._transport = cast(asyncio.Transport, transport)  # uvloop's is no subclass
        self._write = self._transport.write
        peername = transport.get_extra_info("peername")
        if peername is None or shared.closing:  # it has left already, or we are leaving
            self._transport.abort()
            return
        shown: Peer | None = transport.get_extra_info("modbus_peer")  # by its certificate
        self.peer = shown or Peer(str(address_of(peername[0])), peername[1], role=shared.settings.role)
        if (refusal := shared.refusal(self.peer.host, now_s)) is not None:
            shared.log("refused", f"W230 {self.peer}: {refusal}", now_s)
            self._transport.abort()
            return
        silent = shared.longest_silent(self.peer.host, now_s)
        self._admit(now_s)  # before the other one goes: an owner that comes back was never away
        if silent:
            silent.give_way(now_s)

    def _admit(self, now_s: float) -> None:
        shared = self._shared
        self._admitted = True
        shared.peers.join(self.peer.host)
        shared.connections[self] = None
        self._rate = shared.peers.rate(self.peer.host, now_s)
        is_plain = self._transport.get_extra_info("modbus_taken") is None  # of TLS one whole frame may be one of a pile
        self._is_unlimited = self._rate is None and is_plain
        self._units = frozenset(shared.settings.units)
        self._peer_behind = replace(self.peer, is_behind=True)
        self._transport.set_write_buffer_limits(high=shared.settings.write_buffer_bytes)

    def data_received(self, data: bytes) -> None:
        """Answer what has come, READ_BYTES at most: the one call per request."""
        if self._is_unlimited and self._partial_since_s is None and self._answer_whole(data):
            return
        self._receive(data)

    def _answer_whole(self, data: bytes) -> bool:
        """Answer exactly one whole frame; False where it is anything else."""
        try:
            frame = whole_answer(data, self._units, self._shared.bank, self.peer)
        except BaseException:
            self._transport.abort()
            raise
        if frame is not None:
            self._write(frame)
            self._answered = True
        return frame is not None

    def _receive(self, data: bytes) -> None:
        """Whatever is not exactly one frame from an unlimited peer; most often one from a peer whose rate allows it."""
        if self._is_closing:
            return
        self._note_backlog(len(data))
        rate, waits = self._rate, len(self._framer) or self._backlog.is_late
        if rate and not waits and not rate.wait_s(self._read_s) and self._answer_whole(data):
            rate.spend()
            return
        self._framer.push(data)
        self._answer_complete_requests()
        if len(data) == READ_BYTES and not (self._is_paused or self._is_closing):
            self._pause(0.0)

    def _answer_complete_requests(self) -> None:
        """Execute the framer's whole requests until they end, the rate is used up, or the stream is no Modbus."""
        answers: list[bytes] = []
        lost: FramingLost | None = None
        try:
            while self._framer and self._may_ask(len(answers)) and (request := self._framer.take()) is not None:
                answers.append(self._answer(request))
        except FramingLost as caught:
            lost = caught
        except BaseException:
            self._transport.abort()
            raise
        self._note_progress(bool(answers))
        if answers:
            self._write(b"".join(answers))
        if lost is not None:
            self._close("framing", f"W232 {self.peer}: {lost}")

    def _may_ask(self, answered: int) -> bool:
        """answered: requests of this turn; after some the other connections have theirs, and the loop its ticks."""
        if answered >= _REQUESTS_IN_A_TURN and len(self._framer):
            self._pause(0.0)
            return False
        if self._rate is None or self._has_place:
            return True
        wait_s = self._rate.wait_s(self._shared.clock.time())
        if wait_s > 0.0 and len(self._framer):
            self._rate.spend()
            self._has_place = True
            self._pause(wait_s)
            return False
        return True

    def _answer(self, request: Adu) -> bytes:
        if self._rate is not None and not self._has_place:
            self._rate.spend()
        self._has_place = False
        bank, units = self._shared.bank, self._shared.settings.units
        if request.unit in units:
            pdu = answer(request.pdu, bank, self._peer_behind if self._backlog.is_late else self.peer)
        else:
            pdu = refuse_unit((request.unit, request.pdu), units, bank, self.peer)
        return encode(Adu(request.transaction, request.unit, pdu))

    def _note_backlog(self, size: int) -> None:
        """Say of a client that asks more than is answered, and waits for no answer, that it is late. size: of what has come."""
        self._read_s, self._taken = self._shared.clock.time(), self._taken + size
        of_tls = self._transport.get_extra_info("modbus_taken")  # what waits in the socket is encrypted, too
        is_more = size == READ_BYTES or self._transport.get_extra_info("modbus_more")
        if self._backlog.note(self._read_s, of_tls or self._taken, count_waiting(self._transport) if is_more else 0.0):
            rate = f"{self._shared.settings.requests_per_s:g} requests/s" if self._rate else "is answered"
            asks = f"asks more than {rate} and waits for no answer"
            self._log("rate", f"W237 {self.peer}: {asks}: what it asks is carried out late, a stop as well")

    def _note_progress(self, answered: bool) -> None:
        """A partial frame counts from its first byte, so that a byte now and then does not keep it alive."""
        if answered:
            self._answered = True
        if not len(self._framer) or self._is_paused:
            self._partial_since_s = None
            return
        self._acknowledge()
        if answered or self._partial_since_s is None:
            self._partial_since_s = self._shared.clock.time()

    def _acknowledge(self) -> None:
        """Let the peer send the rest of its frame now. The option holds for what has come so far only."""
        wire = self._transport.get_extra_info("socket")
        if wire is not None and _ACKNOWLEDGE_NOW:
            with suppress(OSError):  # it has left: the transport will say so
                wire.setsockopt(socket.IPPROTO_TCP, _ACKNOWLEDGE_NOW, 1)

    @property
    def _is_paused(self) -> bool:
        return self._resume is not None

    @property
    def _is_closing(self) -> bool:
        return self._closing_since_s is not None

    def _pause(self, delay_s: float) -> None:
        self._transport.pause_reading()
        self._resume = self._shared.clock.call_later(delay_s, self._resume_reading)

    def _resume_reading(self) -> None:
        self._resume = None
        # although no buffer is full: the rate is low, or shared with other connections
        self._backlog.is_late |= self._shared.clock.time() - self._read_s >= LATE_S
        self._answer_complete_requests()  # of too many refused writes it pauses again
        if not self._is_paused:
            self._transport.resume_reading()

    def pause_writing(self) -> None:
        """Abort the connection: the transport holds more than the cap."""
        cap_bytes = self._shared.settings.write_buffer_bytes
        self._log("unread", f"W231 {self.peer}: more than {cap_bytes} bytes of answers were not read, closed")
        self.abort()

    def sweep(self, now_s: float) -> None:
        """Close what has been idle, or in the middle of a frame, for too long; cut what does not finish closing."""
        settings = self._shared.settings
        if self._closing_since_s is not None:
            if now_s - self._closing_since_s >= settings.partial_s:
                self._transport.abort()
        elif self._answered or self._is_paused:
            self._answered, self._last_answer_s = False, now_s
        elif self._partial_since_s is not None and now_s - self._partial_since_s >= settings.partial_s:
            self._close("partial", f"W233 {self.peer}: a request stayed incomplete for {settings.partial_s:g} s")
        elif self._partial_since_s is None and now_s - self._last_answer_s >= settings.idle_s:
            self._close("idle", f"{self.peer}: no request for {settings.idle_s:g} s")

    def silent_s(self, now_s: float) -> float:
        """Return for how long nothing was asked, s; 0 while something is under way or since the last sweep."""
        is_in_use = self._answered or self._partial_since_s is not None or self._is_paused
        return 0.0 if is_in_use or self._is_closing else now_s - self._last_answer_s

    def give_way(self, now_s: float) -> None:
        """Close for a new connection, which there would be no room for."""
        silent_s = self.silent_s(now_s)
        self._close("idle", f"{self.peer}: no request for {silent_s:.0f} s, and another connection needs its place")

    def close(self) -> None:
        """Close from the server's side; answers given so far are still delivered."""
        self._stop()
        self._transport.close()

    def abort(self) -> None:
        """Abort the connection: the server does not wait any longer."""
        self._stop()
        self._transport.abort()

    def _close(self, cause: str, sentence: str) -> None:
        """Answers given so far are still delivered; the sweep cuts the connection if they are not read."""
        self._log(cause, f"{sentence}, closed")
        self.close()

    def _stop(self) -> None:
        self._closing_since_s = self._shared.clock.time()
        self._units = frozenset()
        if self._rate is not None and self._has_place:
            self._rate.give_back()
        self._has_place = False
        if self._resume is not None:
            self._resume.cancel()
            self._resume = None

    def _log(self, cause: str, sentence: str) -> None:
        self._shared.log(cause, sentence, self._shared.clock.time())

    def connection_lost(self, _error: Exception | None) -> None:
        """Give the peer's place back."""
        if not self._admitted:
            return
        self._stop()
        self._shared.connections.pop(self, None)
        self._shared.peers.leave(self.peer.host)
        if not any(other.peer.identity == self.peer.identity for other in self._shared.connections):
            self._shared.on_peer_closed(self.peer)
        if not self._shared.connections:
            self._shared.on_last_gone()
