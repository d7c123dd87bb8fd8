"""The load cell's line. A stream talks by itself; a cell that must be asked is asked here, at most one question on the wire.

The next question follows the answer, so a slow wire is used whole. Where the wire is faster than the device's own rate, or
than anything the loop could use, the question waits for that period. An answer that does not come in its time is given up and
asked for again. It may still come then, and a number does not say what it answers: it is taken, for it is a true reading of
this moment all the same. But the line is left alone until the later answer is here or overdue too, for on a bus of two wires
a third question would garble it. Time comes in as an argument.
"""

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import Final

from gateway import defaults
from gateway.control.inputs import WireCounts
from gateway.devices import CellHost, DeviceProfile
from gateway.devices.messages import ForceSample, Garbage, RepeatedSample
from gateway.ports.port import CHUNK_BYTES
from gateway.service.running_rig.lines.cell_identity import CellIdentity
from gateway.service.running_rig.lines.unread_lines import UnreadLines
from gateway.service.running_rig.lines.waiting_bytes import WaitingBytes

_START_AGAIN_S: Final = (
    1.0  # a stream that has been silent for so long is begun anew: the amplifier had no power, perhaps
)
_AWAY_S: Final = 0.5  # of silence of a cell that is asked, beyond its period: what answers then may be another one
_NO_NAME: Final = (
    "it does not say what it is: power, wires, address, or a device without words for `identity` of its profile?"
)
_JITTER_S: Final = 1e-3  # of ticks
_JITTER_SHARE: Final = 0.1  # of the period, at most
_FASTEST_HZ: Final = 250.0  # the loop's fastest tick: more readings would only cost processor time


class CellExchange:
    """Asks through `write` what has to be asked, and tells what came. counts: since the start, whatever reset in between; what
    was heard of readings, and what was garbled, its owner counts. stall_s: a longer pause of the loop is a standstill."""

    def __init__(
        self,
        host: CellHost,
        write: Callable[[bytes], None],
        profile: DeviceProfile,
        stall_s: float = defaults.STALL_S,
    ) -> None:
        self._host, self._waiting = host, WaitingBytes(stall_s)
        self.unread = UnreadLines(profile)
        self.identity = CellIdentity(profile)
        self._write = write
        self.counts = WireCounts()
        self._question, self._start = host.poll(), host.start
        self._reply_timeout_s = profile.reply_timeout_s
        self._period_s = 1.0 / min(profile.reading.rate_hz or inf, _FASTEST_HZ)
        self.reset()

    @property
    def is_stream(self) -> bool:
        """Decide whether the cell talks by itself."""
        return not self._question

    def says(self, now_s: float) -> str:
        """Return what it says in place of readings, or that it does not say what it is; empty where it has been silent."""
        return self.unread.words(now_s) or (_NO_NAME if self.identity.is_due and self._sent_s is not None else "")

    def reset(self) -> None:
        """Forget all that was received before: the port has been opened (again)."""
        self._waiting = WaitingBytes(self._waiting.longest_s)
        self._host.forget()
        self.unread.forget()
        self.identity.begin()
        self._sent_s: float | None = None
        self._next_s = self._due_s = self._start_s = -inf  # the wire is free, and the device has had its period
        self._heard_s = inf  # before the first answer: what it is, is asked anyway
        self._is_overdue = False  # an answer is missing, and may still come
        self._is_heard = False  # one has come since the question that is out: its own, or the one that was missing

    def clear_faults(self) -> None:
        """Ask again what is behind the port where another device seemed to be: somebody has reset."""
        if self.identity.fault:
            self.reset()

    def receive(self, chunk: bytes, now_s: float) -> list[ForceSample | Garbage | RepeatedSample]:
        """Return what these bytes complete; the next question goes out at once where it is due and the wire needs no pause."""
        came_s = self._waiting.came_s(now_s, is_rest_left=len(chunk) >= CHUNK_BYTES)
        if self.identity.is_due:
            return self._receive_identity(chunk, now_s)
        messages = self._host.receive(chunk, now_s)
        if came_s < now_s:
            messages = [replace(one, time_s=came_s) if isinstance(one, ForceSample) else one for one in messages]
        self.unread.hear(messages, now_s)
        if not self._question:  # a stream
            if self._start and any(not isinstance(one, Garbage) for one in messages):
                self._start_s = now_s + _START_AGAIN_S
            return messages
        if any(not isinstance(one, Garbage) for one in messages):
            self._heard_s, self._next_s = now_s, max(self._next_s, now_s + self._host.gap_s)
            if self._is_overdue:
                self._is_overdue, self._is_heard = False, True  # the question that is out has its time all the same
            else:
                self._sent_s = None
        self._send_next(now_s)
        return messages

    def _receive_identity(self, chunk: bytes, now_s: float) -> list[ForceSample | Garbage | RepeatedSample]:
        garbage = self.identity.receive(chunk)
        if not self.identity.is_due:
            self.counts.heard += 1
            self._sent_s, self._is_overdue, self._next_s = None, False, now_s + self._host.gap_s
            self._due_s = -inf
            self._send_next(now_s)
        return [*garbage]

    def tick(self, now_s: float) -> None:
        """Give up waiting for an overdue answer, and ask again; begin a stream that does not begin by itself."""
        self._waiting.note_tick(now_s)
        if self._start and now_s >= self._start_s:
            self._start_s = now_s + _START_AGAIN_S
            self._write(self._start)
        if self._sent_s is not None and now_s - self._sent_s > self._reply_timeout_s:
            self._host.forget()
            self._sent_s, self._is_overdue, self._next_s = None, not self._is_heard, now_s
            self._due_s = now_s
            if now_s - self._heard_s > _AWAY_S + self._period_s:
                self._heard_s = inf
                self.identity.begin()
        self._send_next(now_s, min(_JITTER_S, _JITTER_SHARE * self._period_s))

    def _send_next(self, now_s: float, early_s: float = 0.0) -> None:
        """early_s: so much sooner than its period a device may be asked: a tick seldom comes to the microsecond, and the next
        is a whole one later."""
        is_due = now_s >= max(self._next_s, self._due_s - early_s)
        if self._question and self._sent_s is None and is_due and not self.identity.fault:
            # from when it was due, not from this tick, so that the rate is met between ticks
            began_s = self._due_s if now_s - self._due_s < self._period_s else now_s
            self._sent_s, self._due_s, self._is_heard = now_s, began_s + self._period_s, False
            self.counts.asked += 1
            self._write(self.identity.question if self.identity.is_due else self._question)
