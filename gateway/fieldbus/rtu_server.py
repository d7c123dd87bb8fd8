"""The Modbus RTU face: one serial port, one unit id, one master at a time. What is a request is decided in
gateway.modbus.rtu_receiver, what it means in gateway.modbus.server and the bank.

Decisions
- A serial face is one peer for ownership, whoever is on the wire: a bus has no addresses of masters. Its host is
  `serial:N`, N the face's place in the rig's `fieldbus`; a port that is lost is a closed connection.
- The answer follows at once: the receiver has waited for the silence that the line must have before it.
- What is asked while an answer is still on the wire is executed and not answered: who sends does not listen, and nothing
  piles up. Of a master that has not waited for answers for a quarter of a second nothing renews a lease, and nothing begins:
  what it has sent waits in adapters and drivers, and it may be gone. That is seen by requests that are read together; where
  a slow line parts them (9600 baud in pieces of 4 or 8 ms) it is not, and a driver's 4 KB of heartbeats last for 4 s. What
  the baud says of the time between them would tell, but it says nothing on adapters that have none (CDC, serial servers).
- Without a port of its own the face is a pseudo-terminal, paced like a line at its baud.
"""

import asyncio
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from gateway.defaults import PILE_S
from gateway.devices import SerialSettings
from gateway.modbus.peer import Peer
from gateway.modbus.rtu import BROADCAST_UNIT, LONGEST_ADU, encode_adu
from gateway.modbus.rtu_receiver import RtuReceiver, RtuRequest
from gateway.modbus.server import DataBank, answer, refuse_echo
from gateway.ports import PacedPty, PortError, PortEvents, SerialPort
from gateway.ports.port import monotonic_s

STANDSTILL_S: Final = 0.5
"""So long a process stands still that who asked before has given up: on a bus the answer would be taken for the next one's."""
_AFTERMATH_S: Final = 0.05  # behind it what has waited is read, and its silence awaited
_REPORT_PERIOD_S: Final = 60.0
_WRONG_LINE_BYTES: Final = 24  # three requests' worth without one that can be read: the line is set otherwise


@dataclass(frozen=True, slots=True)
class RtuSettings:
    """path: of the serial port, None for a pseudo-terminal; peer: who all masters on this line are."""

    path: str | None
    serial: SerialSettings
    unit: int
    peer: Peer


class ModbusRtuServer:
    """Serves one bank on one serial port. Make, open and close it in the same event loop."""

    def __init__(
        self,
        bank: DataBank,
        settings: RtuSettings,
        *,
        on_peer_closed: Callable[[Peer], None],
        log: Callable[[str, str], None],
    ) -> None:
        self.settings = settings
        self._bank, self._on_peer_closed, self._log = bank, on_peer_closed, log
        serial = settings.serial
        self._receiver = RtuReceiver(
            settings.unit, serial.baud, serial.character_s, may_echo=not _is_terminal(settings.path)
        )
        self._noise = _NoiseReport(str(serial))
        self._timer: asyncio.TimerHandle | None = None
        self._due_s = 0.0
        self._mute_until_s = 0.0
        self._peer_behind = replace(settings.peer, is_behind=True)
        self._piles_since_s: float | None = None
        self._was_lost = False
        events = PortEvents(self._on_bytes, self._on_lost, self._on_open, self._on_refused, self._on_restored)
        self.port = SerialPort(settings.path, serial, events) if settings.path else None
        self._pty = None if settings.path else _make_pty(serial, self._on_bytes)

    @property
    def path(self) -> str:
        """Path of the port, or of the pseudo-terminal that a master opens."""
        return self.port.path if self.port else self._open_pty.path

    @property
    def peers(self) -> tuple[Peer, ...]:
        """The face's only peer while its port is open."""
        return (self.settings.peer,) if self.port is None or self.port.is_open else ()

    async def start(self) -> None:
        """Open the port and keep it open from now on. PortError when it cannot be opened."""
        if self.port:
            await self.port.open()
        else:
            self._open_pty.open()

    async def close(self) -> None:
        """Close the port; the answers given so far are still sent."""
        self._stop_timer()
        if self.port:
            self.port.close()
        else:
            self._open_pty.close()

    @property
    def _open_pty(self) -> PacedPty:
        assert self._pty
        return self._pty

    @property
    def _backlog_bytes(self) -> int:
        if self.port is None:
            return int(self._open_pty.backlog_s / self._character_s)
        try:
            return self.port.unsent_bytes
        except OSError:
            return 0  # unplugged while a request was executed: a driver that has gone says EIO, and the port tells it

    @property
    def _character_s(self) -> float:
        return self.settings.serial.character_s

    def _on_open(self, _descriptor: int) -> None:
        assert self.port
        if self._was_lost:
            self._log(f"face {self.settings.peer}", f"{self.port.path} is back: Modbus RTU serves again")
        if self.port.warning:
            self._log("port", self.port.warning)

    def _on_lost(self, error: PortError) -> None:
        self._was_lost = True
        self._stop_timer()
        self._receiver.forget()
        self._log(f"face {self.settings.peer}", str(error))
        self._on_peer_closed(self.settings.peer)

    def _on_refused(self, error: PortError) -> None:
        self._log(f"face {self.settings.peer}", f"{error}; tried again until it opens")

    def _on_restored(self, change: PortError) -> None:
        self._log("port", str(change))

    def _on_bytes(self, chunk: bytes, now_s: float) -> None:
        self._receiver.receive(chunk, now_s)
        deadline_s = self._receiver.deadline_s
        if self._timer is None or (deadline_s is not None and deadline_s < self._due_s):
            self._wait(now_s)

    def _wait(self, now_s: float) -> None:
        """Come back when the receiver has something to decide. One timer is enough: a later deadline is waited for anew."""
        self._stop_timer()
        if (deadline_s := self._receiver.deadline_s) is not None:
            self._due_s, delay_s = deadline_s, max(0.0, deadline_s - now_s)
            self._timer = asyncio.get_running_loop().call_later(delay_s, self._on_time)

    def note_standstill(self) -> None:
        """Answer nothing that may have waited through a standstill; it is executed all the same, a stop may be in it."""
        self._mute_until_s = monotonic_s() + _AFTERMATH_S

    def _on_time(self) -> None:
        self._timer = None
        if monotonic_s() - self._due_s > STANDSTILL_S:
            self.note_standstill()
        if self.port:  # what came while this process was late goes on with what is waiting here
            self.port.read_arrived()
        else:
            self._open_pty.read_arrived(max(0.0, monotonic_s() - self._due_s))
        requests = self._receiver.take(monotonic_s())
        if requests:  # nobody waits for the answer to a broadcast: one may have another request right behind it
            most = 2 if any(request.unit == BROADCAST_UNIT for request in requests) else 1
            self._piles_since_s = None if len(requests) <= most else self._piles_since_s or monotonic_s()
        for request in requests:
            self._execute(request)
        now_s = monotonic_s()
        if told := self._noise.tell(self._receiver.frames, self._receiver.noise_bytes, now_s):
            self._log(f"noise {self.settings.peer}", told.format(path=self.path))
        self._wait(now_s)

    def _execute(self, request: RtuRequest) -> None:
        has_waited = self._piles_since_s is not None and monotonic_s() - self._piles_since_s >= PILE_S
        peer = self._peer_behind if has_waited else self.settings.peer
        pdu = (refuse_echo if request.is_in_doubt else answer)(request.pdu, self._bank, peer)
        is_late = monotonic_s() < self._mute_until_s
        if not request.is_answered or is_late or self._backlog_bytes > LONGEST_ADU:
            return
        frame = encode_adu(request.unit, pdu)
        if self.port:
            self.port.write(frame)
        else:
            self._open_pty.send(frame)
        self._receiver.note_sent(request, frame, monotonic_s())

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


def _is_terminal(path: str | None) -> bool:
    """Decide whether the line is a pseudo-terminal, which has no echo."""
    return path is None or os.path.realpath(path).startswith("/dev/pts/")


def _make_pty(serial: SerialSettings, on_bytes: Callable[[bytes, float], None]) -> PacedPty:
    return PacedPty(serial.baud, on_bytes=on_bytes, bits_per_character=serial.bits_per_character)


class _NoiseReport:
    """What is said of bytes that are no request: at once, then at most once a minute with their number."""

    def __init__(self, settings: str) -> None:
        self._settings = settings
        self._told_bytes = 0
        self._next_s = 0.0
        self._is_wrong_line_told = False

    def tell(self, frames: int, noise_bytes: int, now_s: float) -> str:
        """Return a sentence with {path} to be filled in; empty where there is nothing new."""
        fresh = noise_bytes - self._told_bytes
        if not frames and noise_bytes >= _WRONG_LINE_BYTES and not self._is_wrong_line_told:
            self._is_wrong_line_told = True
            sentence = f"W236 {{path}}: {noise_bytes} bytes and no request in them at {self._settings}"
            return self._note(noise_bytes, now_s, f"{sentence}: is the master set to another baud or parity?")
        if not frames or not fresh or now_s < self._next_s:
            return ""
        cure = "termination and bias of the line, its cable beside motors"
        return self._note(
            noise_bytes, now_s, f"W235 {{path}}: {fresh} bytes that are no request were left out; {cure}?"
        )

    def _note(self, noise_bytes: int, now_s: float, sentence: str) -> str:
        self._told_bytes, self._next_s = noise_bytes, now_s + _REPORT_PERIOD_S
        return sentence
