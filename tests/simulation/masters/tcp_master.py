"""Masters of every kind on the simulated network: one that works, one that does not know what it does, one that wants harm.

They spell frames themselves. Each checks its own answers: the right transaction, in order, each once (I8).
"""

import struct
from collections import deque
from collections.abc import Callable
from math import pi, sin
from typing import NamedTuple

from tests.simulation.kernel.network import Caller, Line
from tests.simulation.kernel.virtual_time import VirtualLoop
from tests.simulation.masters.spelling import (
    BEAT,
    ENABLE,
    WAYS,
    WRITES,
    Wish,
    coil_pdu,
    coils_pdu,
    control_of,
    mask_pdu,
    read_and_write_pdu,
    read_pdu,
    write_one_pdu,
    write_pdu,
    written_address,
)

RESET, TARE, TAKE, PULL = 2, 4, 8, 16
RUNS = {"calibrate": 32, "self_test": 64}
"""Bits that start a run, which lasts while they stand."""
BEATS_S = (0.08, 0.1, 0.15)
"""Time between two heartbeats of one that works: more than once within a lease of 0.2 s."""
UNITS = frozenset((0, 1, 255))
EXCEPTIONS = frozenset((1, 2, 3, 4, 6, 11))
STOPS = frozenset(
    (write_one_pdu(0, 0), write_pdu(0, 0), coil_pdu(0, on=False), coils_pdu(0, 0, 1), mask_pdu(0, 0xFFFE, 0))
)
READS = frozenset((read_pdu(100, 20), read_pdu(102, 1), read_pdu(0, 13)))
PATH_S = 0.04
RESET_S = 0.3
"""Until what a reset has changed is seen: some ticks."""


class Asked(NamedTuple):
    """A request that waits for its answer. control: the control word that it writes, None for none."""

    transaction: int
    pdu: bytes
    control: int | None
    unit: int = 1


class Master:
    """One program on one address. on_write(control word or None, is_answered): a write was
    taken, or nobody will hear whether it was; complaints: broken answers. badge: name and role of its certificate."""

    badge: tuple[str, str] = ("", "")
    on_pdu: Callable[[bytes, bool], None] = staticmethod(lambda pdu, is_answered: None)
    on_start: Callable[[bytes, bool], None] = staticmethod(lambda pdu, is_taken: None)
    on_refusal: Callable[[], None] = staticmethod(lambda: None)
    _is_hung, _beat_beside = False, 0

    def __init__(
        self,
        name: str,
        outside: VirtualLoop,
        inside: Callable[[], VirtualLoop | None],
        on_write: Callable[[int | None, bool], None],
        beat_s: float = BEATS_S[0],
    ) -> None:
        self.name, self._outside, self._inside, self._on_write = name, outside, inside, on_write
        self.complaints: list[str] = []
        self.heard: list[tuple[float, bytes]] = []
        self._line: Line | None = None
        self._waiting: deque[Asked] = deque()
        self._stream = b""
        self._transaction = self._beat = self._port = 0
        self._wish = Wish(0, 0.0, 0)
        self._way = WAYS["block"]
        self._beating = 0
        self._is_framed = True
        self._beat_s = beat_s
        self._cut: list[tuple[float, float]] = []
        self._free_s = 0.0  # when what waits to be sent is sent

    # -- connection

    def connect(self) -> bool:
        """Connect where nobody is connected; False where nobody listens."""
        inside = self._inside()
        if self._line is None and inside is not None and inside.servers:
            self._port += 1
            self._stream, self._is_framed, self._free_s = b"", True, 0.0
            self._waiting.clear()
            line: Line | None = None

            def hear(data: bytes) -> None:
                if self._line is line:
                    self._hear(data)

            line = self._line = Line(inside, self._outside, Caller(self.name, 40000 + self._port, *self.badge), hear)
        return self._line is not None

    def lose(self) -> None:
        """The other end has died."""
        self._line = None
        self._waiting.clear()

    def disconnect(self) -> None:
        self._give_up_waiting()
        if self._line:
            self._line.close()
        self.lose()

    def _give_up_waiting(self) -> None:
        for asked in self._waiting:
            self._tell(asked, False)

    def vanish(self) -> None:
        """Lose its power: the other end is not told, and it begins anew when it is asked to."""
        self._give_up_waiting()
        if self._line:
            self._line.vanish()
        self.lose()

    def stall(self, duration_s: float) -> None:
        """A switch on the way begins anew: what it says arrives so much later, all at once."""
        if self._line:
            self._line.stall(duration_s)

    # -- requests

    def ask(self, pdu: bytes, unit: int = 1) -> None:
        if self.connect():
            self._send(self._frame(pdu, unit))

    def _frame(self, pdu: bytes, unit: int = 1) -> bytes:
        self._transaction = (self._transaction + 1) & 0xFFFF
        self._waiting.append(Asked(self._transaction, pdu, control_of(pdu), unit))
        return struct.pack(">HHHB", self._transaction, 0, len(pdu) + 1, unit) + pdu

    def _send(self, data: bytes) -> None:
        """Send bytes, behind whatever of this connection still waits for its time."""
        assert self._line
        now_s = self._outside.clock.now_s
        if not self._cut and self._free_s < now_s:  # at the same moment a piece may still wait for its turn
            self._line.send(data)
            return
        self._free_s = max(self._free_s, now_s)
        for piece, pause_s in self._pieces(data):
            self._outside.call_at(self._free_s, self._send_piece, self._line, piece)
            self._free_s += pause_s

    def _send_piece(self, line: Line, piece: bytes) -> None:
        if self._line is line:
            line.send(piece)

    def _pieces(self, data: bytes) -> tuple[tuple[bytes, float], ...]:
        if not self._cut:
            return ((data, 0.0),)
        share, pause_s = self._cut.pop()
        place = 1 + int(share * (len(data) - 1))
        return (data[:place], pause_s), (data[place:], 0.0)

    def split(self, share: float, pause_s: float, count: float) -> None:
        """Each of the next `count` requests arrives in two pieces, cut at this share of its length, with a pause between."""
        self._cut = [(share, pause_s)] * int(count)

    def burst(self, count: float, is_read_wrong: float) -> None:
        """Send its command by FC23, so often in one segment; where the read is wrong, every other one must write nothing."""
        frames = []
        for number in range(int(count) if self.connect() else 0):
            self._beat += 1
            self._wish = self._wish._replace(beat=self._beat)
            first = 90 if is_read_wrong and number % 2 else 100
            frames.append(self._frame(read_and_write_pdu(first, 11, 0, *self._wish.words)))
        if frames:
            self._send(b"".join(frames))

    def send_raw(self, data: bytes) -> None:
        """Bytes that are no request, perhaps: answers are not counted from now on."""
        if self.connect():
            self._is_framed = False
            self._send(data)

    # -- one that works

    def hold(self, force_n: float, control: int = ENABLE, way: str = "block", voltage_v: float | None = None) -> None:
        """Command this force, or this voltage, and beat from now on; way: of WAYS."""
        self._wish, self._way, self._is_hung = Wish(control, force_n, self._beat, voltage_v), WAYS[way], False
        self._beating += 1
        if self._way.beat:
            for pdu in self._way.begin(self._wish):
                self.ask(pdu)
        self._keep_beating(self._beating)

    def program(self, force_n: float, *numbers: float) -> None:
        """Command by the whole block from now on."""
        self.hold(force_n, ENABLE)
        self._wish = self._wish._replace(program=tuple(map(int, numbers)))

    def follow(self, mean_n: float, swing_n: float, period_s: float) -> None:
        """Command a force that swings about its mean, as a robot on a path does: 25 setpoints a second."""
        self.hold(mean_n)
        self._write_path(self._beating, mean_n, swing_n, 2.0 * pi * PATH_S / period_s, 1)

    def _write_path(self, number: int, mean_n: float, swing_n: float, step: float, place: int) -> None:
        if number == self._beating and not self._is_hung:
            self._beat += 1
            self._wish = self._wish._replace(force_n=mean_n + swing_n * sin(step * place), beat=self._beat)
            for pdu in self._way.begin(self._wish):
                self.ask(pdu)
            self._outside.call_later(PATH_S, self._write_path, number, mean_n, swing_n, step, place + 1)

    def hang(self, beat_beside: float = 0.0) -> None:
        """Go on with the last frame, whose heartbeat stays as it was. beat_beside: heartbeat of another frame of its own, which
        stays as well; 0: it has none."""
        self._is_hung, self._beat_beside = True, int(beat_beside)

    def run(self, name: str) -> None:
        """Clear what is latched, start a run by its bit, and beat from now on."""
        self.reset(take=True)
        self._beating += 1
        self._outside.call_later(RESET_S, self._begin_run, self._beating, RUNS[name])

    def _begin_run(self, number: int, bit: int) -> None:
        if number == self._beating:  # nothing else has been asked of it meanwhile
            self.hold(0.0, bit)

    def tare(self) -> None:
        """Beside the bits that stand."""
        self.ask(write_one_pdu(0, self._wish.control | TARE))

    def let_go(self) -> None:
        """Disable in words."""
        self._beating += 1
        self._wish = self._wish._replace(control=0)
        self._beat += 1
        self.ask(write_pdu(0, 0, 0, 0, 0, self._beat))

    def fall_silent(self) -> None:
        """Die without a word: the connection stays."""
        self._beating += 1

    def reset(self, take: bool = False) -> None:
        """Reset faults, with a heartbeat of its own, and whatever somebody else has left in the other words of the block; take
        over, if asked."""
        self._wish = self._wish._replace(control=0)
        for control in (TAKE if take else 0, RESET):
            self._beat += 1
            self.ask(write_pdu(0, control, 0, 0, 0, self._beat, *[0] * 8))

    def _keep_beating(self, number: int) -> None:
        if number == self._beating:
            self._beat += not self._is_hung
            wish = self._wish = self._wish._replace(beat=self._beat)
            for pdu in (self._way.beat(wish),) if self._way.beat else self._way.begin(wish):
                self.ask(pdu)
            if self._is_hung and self._beat_beside:
                self.ask(write_one_pdu(BEAT, self._beat_beside))
            self._outside.call_later(self._beat_s, self._keep_beating, number)

    # -- answers

    def _hear(self, data: bytes) -> None:
        if not data:
            self.lose()
            return
        self._stream += data
        while len(self._stream) >= 8:
            transaction, protocol, length = struct.unpack_from(">HHH", self._stream)
            if len(self._stream) < 6 + length:
                return
            pdu, self._stream = self._stream[7 : 6 + length], self._stream[6 + length :]
            self._take(transaction, protocol, pdu)

    def _take(self, transaction: int, protocol: int, pdu: bytes) -> None:
        if not self._is_framed:
            return
        if not self._waiting or protocol != 0:
            self.complaints.append(f"I8: {self.name} was answered {pdu.hex()} without having asked")
            return
        asked = self._waiting.popleft()
        if asked.transaction != transaction or pdu[0] & 0x7F != asked.pdu[0]:
            self.complaints.append(
                f"I8: {self.name} asked {asked.transaction} {asked.pdu.hex()}, was answered {transaction} {pdu.hex()}"
            )
            return
        self.heard.append((self._outside.clock.now_s, pdu))
        del self.heard[:-64]
        self.on_start(asked.pdu, not pdu[0] & 0x80)
        if pdu[0] & 0x80:
            self._judge_refusal(asked, pdu[1])
        if pdu[0] in WRITES:
            self._judge_role(asked.pdu)
            self._tell(asked, True)
        self.note_answer(asked.pdu, pdu)

    def _tell(self, asked: Asked, is_answered: bool) -> None:
        """A write was taken, or nobody will hear whether it was."""
        if asked.pdu[0] in WRITES:
            self.on_pdu(asked.pdu, is_answered)
            self._on_write(asked.control, is_answered)

    def _judge_role(self, asked: bytes) -> None:
        """What its certificate does not let it write must not be taken (I7)."""
        name, role = self.badge
        address = written_address(asked)
        is_coil = asked[0] in (5, 15)
        if role == "monitor" or (role == "setpoint" and 1000 <= address < 1200 and not is_coil):
            self.complaints.append(f"I7: {name} with the role {role} wrote {asked.hex()}, which was taken")

    def _judge_refusal(self, asked: Asked, code: int) -> None:
        """Whoever may write at all may clear enable, and every refusal has a code that the map knows."""
        self.on_refusal()
        if code not in EXCEPTIONS:
            self.complaints.append(f"I8: {self.name} asked {asked.pdu.hex()}, was refused with {code}")
        if asked.pdu in READS and asked.unit in UNITS:
            self.complaints.append(f"I12: {self.name} asked {asked.pdu.hex()}, was refused with {code}")
        if asked.pdu in STOPS and asked.unit in UNITS and self.badge[1] != "monitor":
            self.complaints.append(f"stop: {self.name} clears enable by {asked.pdu.hex()}, was refused with {code}")

    def note_answer(self, asked: bytes, answer: bytes) -> None:
        """For those who want to know."""
