"""Warnings of a rate: noise on a serial line (A341), a loop whose ticks come late (A342).

One broken message or one late tick is judged elsewhere (a stale sample, a failed echo, `stall_s`); what keeps happening
deserves a look before it becomes a fault. It is counted over 10 s, told once when it begins, and over after 10 s without any.

From three on: opening a port in the middle of a message breaks one, a burst on the wire two, and one stall is one event. Above
1 %: losses at that rate, each by itself, make the five in a row that stale a 100 Hz sample (50 ms) once in three years, at 10 %
every quarter of an hour. So the warning comes long before the fault, and a line or loop that is well stays far below it.
"""

from collections import deque
from collections.abc import Callable, Sequence
from math import ceil, inf
from operator import add
from typing import Final

from gateway.codes.explanation import BUSY_CURE, is_cause
from gateway.codes.warning_bits import WarningBit
from gateway.control.blame_for_silence import NOT_HELD, Held, cure_for_waiting
from gateway.devices.messages import Garbage
from gateway.processes.scheduling.scheduler_counters import ProcessorTime
from gateway.units import format_ms

WINDOW_S: Final = 10.0
LEAST: Final = 3
SHARE: Final = 0.01
LATE_PERIODS: Final = 0.5  # a tick this late is nearer to the next one's time than to its own
_BIN_S: Final = 1.0
_TORN_S: Final = 0.1  # that a simulated rig was late in sum: from there on answers are overdue again and again
_NOISE: Final = (
    "a motor cable beside it, no ground, a marginal baud rate? separate the cables, ground the shield at one end"
)
_BUSY: Final = (
    "our own loop is late (A342), which tears answers, too: end other programs, or `run --realtime`, then look again"
)
_NOISY, _SLOW = int(WarningBit.SERIAL_NOISE), int(WarningBit.SLOW_LOOP)
_NONE_READ: Final = "none could be read: another speed, another device or profile? force-gateway check the rig"


class _RecentSums:
    """Sums of several amounts over the last 10 s, in bins of 1 s."""

    def __init__(self, amounts: int) -> None:
        self._none = [0.0] * amounts
        self._bins: deque[tuple[float, list[float]]] = deque(maxlen=ceil(WINDOW_S / _BIN_S))
        self._begun_s, self._sums = -inf, self._none

    def add(self, now_s: float, *amounts: float) -> None:
        if now_s - self._begun_s >= _BIN_S:
            self._begun_s, self._sums = now_s, self._none.copy()
            self._bins.append((now_s, self._sums))
        self._sums[: len(amounts)] = map(add, self._sums, amounts)

    def totals(self, now_s: float) -> list[float]:
        recent = (sums for begun_s, sums in self._bins if now_s - begun_s < WINDOW_S)
        return [sum(column) for column in zip(*recent, strict=True)]


class _RateWarning:
    """Begins in its subclasses; ends here."""

    def __init__(self) -> None:
        self.is_on = False
        self._last_s = 0.0

    def lasts(self, now_s: float) -> bool:
        """Whether it is on; it goes off after 10 s without anything to warn of."""
        if self.is_on and now_s - self._last_s >= WINDOW_S:
            self.is_on = False
        return self.is_on


class LineNoise(_RateWarning):
    """Messages of one serial line, and those of them that nobody can read. line: whose it is; explain: what one that
    nobody can read does say, empty where it is no text."""

    def __init__(self, line: str, explain: Callable[[bytes], str] = lambda line: "") -> None:
        super().__init__()
        self._line, self._explain = line, explain
        self.forget()

    def forget(self) -> None:
        """Begin anew: another device may be behind the port, and what the one before said well says nothing of this one."""
        self.is_on, self._recent = False, _RecentSums(3)

    def hear(self, messages: Sequence[object], now_s: float, late_words: Callable[[], str] = lambda: "") -> str:
        """Return a sentence where noise begins with these messages, else an empty one. late_words: of answers, who was late:
        what our loop gave up as overdue, and comes then, is read from its middle on; empty where nobody was.
        """
        dropped = [one.data for one in messages if isinstance(one, Garbage)]
        if not dropped:
            if messages:
                self._recent.add(now_s, 0, len(messages))
            return ""
        self._recent.add(now_s, len(dropped), len(messages), sum(map(len, dropped)))
        self._last_s = now_s
        count, total, size = self._recent.totals(now_s)
        if self.is_on or count < LEAST or count <= SHARE * total:
            return ""
        self.is_on = True
        observation = f"{count:.0f} of {total:.0f} messages ({size:.0f} bytes) within {WINDOW_S:g} s could not be read"
        cause = late_words() or self._cause(total - count, dropped[-1])
        return f"A341 {self._line} line: {observation} and were dropped; {cause}"

    def _cause(self, whole: float, line: bytes) -> str:
        return _NOISE if whole else self._explain(line) or _NONE_READ


class SlowLoop(_RateWarning):
    """Ticks of the loop, and those of them that were missed or late. period_s: of the tick; withheld: processor time that was
    kept from us from outside in the last second or two, s, and by whom, in words; None where nobody counts it."""

    def __init__(self, period_s: float, withheld: Callable[[], tuple[float, str]] | None = None) -> None:
        super().__init__()
        self._period_s, self._withheld = period_s, withheld
        self._recent = _RecentSums(6)

    def tick(
        self, now_s: float, expirations: int, late_s: float, processor_time: Callable[[], ProcessorTime | None]
    ) -> str:
        """Return a sentence where the loop becomes slow with this tick, else an empty one.

        expirations, late_s: as of `ClockTick`. processor_time: what this process has had since the tick before; None where
        the kernel does not count that. Asked only for a late tick.
        """
        bad = expirations - 1 + (late_s > LATE_PERIODS * self._period_s)
        if not bad:
            self._recent.add(now_s, 0, expirations)
            return ""
        self._last_s = now_s
        behind_s, used = (expirations - 1) * self._period_s + late_s, processor_time()
        waited_s, ran_s = (used.waited_s, used.on_cpu_s) if used else (0.0, 0.0)
        self._recent.add(now_s, bad, expirations, 1, behind_s, min(waited_s, behind_s), min(ran_s, behind_s))
        missed, ticks, stalls, *spent_s = self._recent.totals(now_s)
        if self.is_on or stalls < LEAST or missed <= SHARE * WINDOW_S / self._period_s:
            return ""
        self.is_on = True
        bound = format_ms(LATE_PERIODS * self._period_s)
        observation = f"{missed:.0f} of {ticks:.0f} ticks within {WINDOW_S:g} s were missed or over {bound} late"
        withheld_s, by_whom = self._withheld() if self._withheld else (0.0, "")
        if is_cause(withheld_s, spent_s[0]):
            return f"A342 {observation}, {format_ms(spent_s[0])} in all: {by_whom}"
        return f"A342 {observation}, {_cause_of_lateness(*spent_s, is_counted=used is not None)}"


def _cause_of_lateness(late_s: float, waited_s: float, ran_s: float, *, is_counted: bool) -> str:
    """The machine or the program, by what took most of the lateness; all in seconds."""
    if not is_counted:
        return f"{format_ms(late_s)} in all, not counted why: end other programs, or `run --realtime`"
    times_text = (
        f"{format_ms(late_s)} in all, {format_ms(waited_s)} of them waiting for a processor, {format_ms(ran_s)} at work"
    )
    if is_cause(waited_s, late_s):
        return f"{times_text}: {BUSY_CURE}"
    if is_cause(ran_s, late_s):
        return f"{times_text}: the gateway's own work takes too long here; a slower loop_hz, fewer clients, or a faster machine"
    hosts = "a virtual one on a busy host, a paused container, a CPU in deep sleep"
    return f"{times_text}: this machine stood still or slept ({hosts})"


def _late_rig_words(held: Held) -> str:
    """Why the process behind a simulated rig has answered late, empty where it has not, or where the rig is a real one."""
    rig = "the simulated rig's process"
    if held.rig_stopped_s >= _TORN_S:
        return f"{rig} was stopped for {format_ms(held.rig_stopped_s)} in that time (a signal, a debugger), which tears answers"
    if held.rig_waited_s >= _TORN_S:
        waited = f"{rig} waited {format_ms(held.rig_waited_s)} for a processor in that time, which tears answers"
        return f"{waited}: {cure_for_waiting(held, held.rig_waited_s)}"
    return ""


class RateWarnings:
    """Those of one rig. bits: the warnings that are on, those among them that others have set and that stay; tell: a sentence
    when one begins; slow_loop, cell, output: where their ticks and messages are counted; held: what kept processes from
    running between two times, as of `Lateness`."""

    def __init__(self, slow_loop: SlowLoop, cell: LineNoise, output: LineNoise, tell: Callable[[str], None]) -> None:
        self.bits = WarningBit(0)
        self.held: Callable[[float, float], Held] = lambda then_s, now_s: NOT_HELD
        self._slow_loop, self._cell, self._output, self._tell = slow_loop, cell, output, tell

    def hear_cell(self, messages: Sequence[object], now_s: float, *, is_stream: bool) -> None:
        """Count messages of the load cell. is_stream: they come of their own accord, and a slow loop tears none."""
        if sentence := self._cell.hear(messages, now_s, lambda: "" if is_stream else self._late_words(now_s)):
            self._begin(WarningBit.SERIAL_NOISE, sentence)

    def hear_output(self, messages: Sequence[object], now_s: float) -> None:
        """Count answers of the output device."""
        if sentence := self._output.hear(messages, now_s, lambda: self._late_words(now_s)):
            self._begin(WarningBit.SERIAL_NOISE, sentence)

    def _late_words(self, now_s: float) -> str:
        return _BUSY if self._slow_loop.is_on else _late_rig_words(self.held(now_s - WINDOW_S, now_s))

    def tick(
        self, now_s: float, expirations: int, late_s: float, processor_time: Callable[[], ProcessorTime | None]
    ) -> None:
        """Count a tick of the loop, as `SlowLoop.tick` has it, and end what is over."""
        if sentence := self._slow_loop.tick(now_s, expirations, late_s, processor_time):
            self._begin(WarningBit.SLOW_LOOP, sentence)
        bits = int(self.bits)
        if bits & _NOISY:
            lasts = [line.lasts(now_s) for line in (self._cell, self._output)]
            if not any(lasts):
                self.bits &= ~WarningBit.SERIAL_NOISE
        if bits & _SLOW and not self._slow_loop.lasts(now_s):
            self.bits &= ~WarningBit.SLOW_LOOP

    def forget_cell(self) -> None:
        """Begin anew with the load cell's line."""
        self._cell.forget()

    def forget_output(self) -> None:
        """Begin anew with the output's line."""
        self._output.forget()

    def _begin(self, bit: WarningBit, sentence: str) -> None:
        self.bits |= bit
        self._tell(sentence)
