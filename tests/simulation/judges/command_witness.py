"""Whether the command block holds what masters have written, word for word, and nothing of a write that was refused (I7); and
whether a zero was taken as often as somebody has asked for it (I8). No code of the gateway is used here.
"""

import struct
from collections import deque
from itertools import chain
from math import isnan, nan

from tests.simulation.judges.observer import Observer
from tests.simulation.masters.spelling import word_of, written_address

WORDS, SETPOINT, FLOATS = 13, 1, 200
KEPT_S = 5.0
"""So long a write is kept: it may have waited for a machine that stood still."""
LATE_LOOKS = 3


class CommandWitness:
    """Told of each write that was taken or may have been, and of each look at the block."""

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self._written: deque[tuple[float, bytes]] = deque()
        self._looks: deque[tuple[float, tuple[int, ...]]] = deque()
        self._known = (0,) * WORDS

    def note_write(self, pdu: bytes, now_s: float) -> None:
        """A write was taken, or nobody knows whether it was."""
        self._written.append((now_s, pdu))

    def note(self, block: bytes, at_s: float) -> None:
        """Judge a look of some time ago: who hears no answer tells so late."""
        self._looks.append((at_s, struct.unpack(f">{WORDS}H", block)))
        if len(self._looks) > LATE_LOOKS:
            self._judge(*self._looks.popleft())

    def _judge(self, at_s: float, words: tuple[int, ...]) -> None:
        while self._written and self._written[0][0] < at_s - KEPT_S:
            self._written.popleft()
        for place in range(1, WORDS):  # of control_word single bits are written, and momentary ones read as 0
            word = words[place]
            if word not in (0, self._known[place]) and not self._is_written(place, word):
                told = f"word {place} of the command is {word}, which nobody has written"
                self._observer.complain("I7", told, at_s)
        self._known = words

    def _is_written(self, place: int, word: int) -> bool:
        """A setpoint may be lowered, by a calibration that allows less. What was written last is most often it."""
        found = chain((self._known[place],), (_word_of(pdu, place) for _, pdu in reversed(self._written)))
        return any(one == word or isnan(one) or (place == SETPOINT and word < one) for one in found if one is not None)


def _word_of(pdu: bytes, place: int) -> float | None:
    """A float says it in another unit: it may be any."""
    word = word_of(pdu, place)
    return nan if word is not None and written_address(pdu) >= FLOATS else word


class Counted:
    """How often something was asked for, and done. least, most: those that were answered, and those that nobody knows of."""

    def __init__(self, what: str) -> None:
        self._what = what
        self._least = self._most = self._done = 0

    def note_asked(self, *, is_sure: bool) -> None:
        """Somebody has asked for it. is_sure: and was told that it was taken."""
        self._least += is_sure
        self._most += 1

    def note_done(self) -> None:
        """It was done."""
        self._done += 1

    def judge(self) -> tuple[str, ...]:
        """Say what does not hold."""
        if self._least <= self._done <= self._most:
            return ()
        return (f"I8: {self._what} {self._done} times, asked for {self._least} to {self._most} times",)
