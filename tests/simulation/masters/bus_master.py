"""A master on the serial bus of a gateway's RTU face: one question at a time, and one who hears nothing waits before it asks
again, so that no late answer is taken for the next question's.

Its own bytes can be spoiled on the way, too: then nobody answers, as nobody may. What was asked and not answered may have
been done all the same.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from tests.simulation.judges.heard import crc16
from tests.simulation.kernel.cables import CABLES
from tests.simulation.masters.spelling import WRITES, control_of
from tests.simulation.masters.tcp_master import Asked, Master

PATIENCE_S = 0.1
PAUSE_S = 0.7
"""Longer than any standstill that the process survives."""
STRANGE_S = 1.0
"""After a request was doubled on its way, who was answered twice need not wonder."""
MOST_WAITING = 3
LONGEST_GAP_S = 0.05
"""Inside of a request: who waits longer has given it up."""
UNIT, BROADCAST = 1, 0
BUSES = {"bus": "rival", "second bus": "worker"}
"""Who is the master on each."""


class BusMaster(Master):
    """complaints: what was answered that nobody had asked, or otherwise than asked."""

    _question: Asked | None = None
    _number = 0
    _is_pausing = False

    def __init__(self, bus: str, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._queue: list[tuple[bytes, int]] = []
        self._bus = CABLES[bus]
        self._bus.on_device = self._hear_bus

    def connect(self) -> bool:
        """Whether somebody is at the other end."""
        return self._bus.port is not None

    def disconnect(self) -> None:
        """A bus has no connections: it only falls silent."""
        self._give_up()

    def lose(self) -> None:
        self._give_up()

    vanish = disconnect

    def stall(self, duration_s: float) -> None:
        """Nothing on a bus keeps what was said."""

    def ask(self, pdu: bytes, unit: int = UNIT) -> None:
        if self.connect() and len(self._queue) < MOST_WAITING:
            self._queue.append((pdu, unit))
            self._ask_next()

    def send_raw(self, data: bytes) -> None:
        self._bus.send_to_host(data)

    def _ask_next(self) -> None:
        if self._question is not None or self._is_pausing or not self._queue:
            return
        pdu, unit = self._queue.pop(0)
        self._stream, self._number = b"", self._number + 1
        self._question = Asked(self._number, pdu, control_of(pdu))
        frame = bytes((unit,)) + pdu
        pieces = self._pieces(frame + crc16(frame).to_bytes(2, "little"))
        self._put(pieces, self._number if unit == BROADCAST else 0)
        self._outside.call_later(PATIENCE_S, self._on_silence, self._number)

    def _put(self, pieces: Sequence[tuple[bytes, float]], broadcast: int) -> None:
        """Put a request on the bus, with a gap inside where it is to be split. broadcast: its number, which nobody answers: it
        has been done as soon as it is through; 0: none."""
        bus, ((piece, gap_s), *rest) = self._bus, pieces
        bus.send_to_host(piece)
        if rest:
            self._outside.call_later(min(gap_s, LONGEST_GAP_S) + bus.backlog_s, self._put, rest, broadcast)
        elif broadcast:
            self._outside.call_later(bus.backlog_s, self._on_silence, broadcast)

    def burst(self, count: float, is_read_wrong: float) -> None:
        """A bus has one question at a time."""

    def _on_silence(self, number: int) -> None:
        if self._question is not None and self._number == number:
            self._give_up()

    def _give_up(self) -> None:
        """Whatever it was, it may have been done."""
        question, self._question = self._question, None
        self._queue.clear()
        if question is None:
            return
        self._tell(question, False)
        self._is_pausing = True
        self._outside.call_later(PAUSE_S, self._go_on)

    def _go_on(self) -> None:
        self._is_pausing = False

    def _hear_bus(self, chunk: bytes, now_s: float) -> None:
        self._stream += chunk
        frame = self._stream
        if len(frame) < 5 or crc16(frame[:-2]) != int.from_bytes(frame[-2:], "little"):
            return
        self._stream = b""
        question, is_strange = self._question, now_s - self._bus.strange_s < STRANGE_S
        if question is None:
            if not self._is_pausing and not is_strange:
                self.complaints.append(f"I8: {self.name} was answered {frame.hex()} on the bus without having asked")
            return
        if frame[0] != UNIT or frame[1] & 0x7F != question.pdu[0]:
            if not is_strange:
                asked = question.pdu.hex()
                self.complaints.append(f"I8: {self.name} asked {asked} on the bus, was answered {frame.hex()}")
            return
        self._question = None
        pdu = frame[1:-2]
        self.heard.append((now_s, pdu))
        del self.heard[:-64]
        if pdu[0] in WRITES:
            self._tell(question, True)
        elif is_strange:  # a refusal may be the second one of what was asked before (seed 256664)
            self._tell(question, False)
        self._ask_next()


def make_master(name: str) -> Callable[..., Master]:
    """Who `rival` is, and `worker`: where there is a bus, or a second one, a master on it."""
    bus = next((bus for bus, master in BUSES.items() if master == name), "")
    return partial(BusMaster, bus) if bus in CABLES else Master
