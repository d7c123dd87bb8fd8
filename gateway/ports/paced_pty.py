"""The device's end of a simulated serial line: a pty whose bytes take the time that the wire's baud rate takes.

Bytes are handed over when the last one of a write has passed, at the latest every 10 ms: one wake-up per sentence, not one
per byte. asyncio's timers are up to 1 ms late (epoll counts milliseconds), and never early here. A client at another baud
rate hears what its UART would make of the line, and is heard so.
"""

import asyncio
import contextlib
import os
from collections.abc import Callable
from typing import Final

from gateway.devices import PacedWire, resample_at_baud
from gateway.ports.port import OnBytes, monotonic_s
from gateway.ports.pseudo_terminal import Pty

_LONGEST_PIECE_S: Final = 0.01
_SHORTEST_WAIT_S: Final = 1e-3  # a loop whose timers fire early must not spin
_CHUNK_BYTES: Final = 4096


class PacedPty:
    """on_bytes(chunk, now_s): what the client sent, once it is through the wire. `send` goes the other way."""

    def __init__(self, baud: int, *, on_bytes: OnBytes, bits_per_character: int = 10) -> None:
        self._baud = baud
        self._on_bytes = on_bytes
        self._bits_per_character = bits_per_character
        self._pty: Pty | None = None

    @property
    def path(self) -> str:
        """Path of the terminal's end that a program opens."""
        return self._open_pty.path

    @property
    def is_open(self) -> bool:
        """Decide whether the plug is in."""
        return self._pty is not None

    @property
    def _open_pty(self) -> Pty:
        assert self._pty, "open() comes first"
        return self._pty

    def open(self) -> None:
        """Make the pty; its client's speed is the wire's until a client sets another."""
        self._pty = Pty()
        self._pty.set_client_baud(self._baud)
        self._inward = _Flow(PacedWire(self._baud, self._bits_per_character), self._deliver)
        self._outward = _Flow(PacedWire(self._baud, self._bits_per_character), self._write)
        asyncio.get_running_loop().add_reader(self._pty.fd, self._on_readable)

    def send(self, data: bytes, at_s: float | None = None) -> None:
        """Put bytes on the wire to the client, behind those that are still on it; nowhere, while the plug is out. at_s: when,
        monotonic s, where that is a while ago; None: now."""
        if self._pty is None:
            return
        self._outward.put(resample_at_baud(data, self._baud, self._open_pty.client_baud()), at_s)

    def read_arrived(self, late_s: float) -> None:
        """Hand over what would be through the wire, had it come so long ago: a loop that was late by that reads it now, and may
        have called another timer first."""
        if self._pty:
            self._on_readable()
            self._inward.hand_over(late_s)

    @property
    def backlog_s(self) -> float:
        """Time until everything sent is through the wire."""
        return self.backlog_at(monotonic_s())

    def backlog_at(self, at_s: float) -> float:
        """Return how long what was sent before kept the wire, s, at at_s, monotonic s."""
        last_s = self._outward.wire.last_through_s
        return 0.0 if last_s is None else max(0.0, last_s - at_s)

    def close(self) -> None:
        """Pull the plug; what is still on the wire is lost."""
        if self._pty is None:
            return
        asyncio.get_running_loop().remove_reader(self._pty.fd)
        self._inward.stop()
        self._outward.stop()
        self._pty.close()
        self._pty = None

    def _on_readable(self) -> None:
        """Read as much as the wire has room for; the rest waits in the client's driver, as on a real line."""
        pty = self._open_pty
        room = self._inward.wire.room
        if room == 0:
            asyncio.get_running_loop().remove_reader(pty.fd)
            return
        try:
            data = os.read(pty.fd, min(room, _CHUNK_BYTES))
        except OSError:  # nothing there after all
            return
        self._inward.put(resample_at_baud(data, pty.client_baud(), self._baud))

    def _deliver(self, data: bytes, now_s: float) -> None:
        asyncio.get_running_loop().add_reader(self._open_pty.fd, self._on_readable)
        self._on_bytes(data, now_s)

    def _write(self, data: bytes, _now_s: float) -> None:
        with contextlib.suppress(BlockingIOError):  # what nobody reads is lost, as behind a UART
            os.write(self._open_pty.fd, data)


class _Flow:
    """One direction: a wire and the timer that empties it."""

    def __init__(self, wire: PacedWire, take: Callable[[bytes, float], None]) -> None:
        self.wire = wire
        self._take = take
        self._timer: asyncio.TimerHandle | None = None

    def put(self, data: bytes, at_s: float | None = None) -> None:
        self.wire.send(data, monotonic_s() if at_s is None else at_s)
        if self._timer is None:
            self._wait()

    def stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _wait(self) -> None:
        last_s = self.wire.last_through_s
        if last_s is not None:
            delay_s = min(_LONGEST_PIECE_S, max(_SHORTEST_WAIT_S, last_s - monotonic_s()))
            self._timer = asyncio.get_running_loop().call_later(delay_s, self._on_time)

    def hand_over(self, late_s: float) -> None:
        now_s = monotonic_s()
        if data := self.wire.bytes_through(now_s + late_s):
            self._take(data, now_s)

    def _on_time(self) -> None:
        self._timer = None
        now_s = monotonic_s()
        data = self.wire.bytes_through(now_s)
        self._wait()
        if data:
            self._take(data, now_s)
