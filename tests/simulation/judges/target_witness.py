"""Whether it is said that a force does not come, and that one has come, whatever is disturbed: a target that is not reached for
so long is told as that, and `in_band` is what the readings say. No code of the gateway is used here.
"""

import struct

from tests.simulation.judges.observer import STATUS_WORDS, Observer
from tests.simulation.masters.spelling import ENABLE, control_of, word_of

IN_BAND, SWITCHING, UNREACHABLE = 1 << 3, 1 << 9, 1 << 1
COUNT_N = 0.01
BAND, BAND_TIME = 11, 12
WEIGHTS = 6, 9
"""Tilt and payload."""
LEAST_N, HELD_OFF_S = 5.0, 3.5
"""A target of so much, missed for so long: two seconds, and what a smoothed reading takes."""
BAND_N, MORE_N, LOOKS = 1.0, 1.0, 4
"""Of the rig's own band; what readings and their mean differ by; for so many looks on end."""
SHARE, COME_S = 0.4, 1.5
LONGEST_BAND_MS = 200
LONGEST_GAP_S = 0.5
HOLDING, NOTHING = 3, (-1, -1)


class TargetWitness:
    """Told of each look at the status block, and at the command block for the band."""

    _band = 0, 0
    _told_s: float | None = None  # when another band was written, which has not been read since
    _held, _writer = NOTHING, ""
    _last_s = _off_s = _out_s = 0.0
    _false = 0

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self._weights = dict[int, float]()

    def note_write(self, writer: str, pdu: bytes, at_s: float) -> None:
        """Note whose write was taken at at_s: two masters who take the force from each other, or let it go, each have theirs
        between two looks; what is in another band is not judged by the one before; and by another weight a force is read as
        another one, which is missed anew."""
        control = control_of(pdu)
        words = {place: word for place in WEIGHTS if (word := word_of(pdu, place)) is not None}
        is_other = any(word != self._weights.get(place, 0.0) for place, word in words.items())
        self._weights |= words
        if writer != self._writer or (control is not None and not control & ENABLE) or is_other:
            self._writer, self._held = writer, NOTHING
        if any(
            word_of(pdu, place) not in (None, word) for place, word in zip((BAND, BAND_TIME), self._band, strict=True)
        ):
            self._told_s = at_s

    def note_band(self, band: int, band_ms: int, at_s: float) -> None:
        """Note what the command block says of the band at at_s, in its counts; 0 for the rig's own."""
        self._band = band, band_ms
        if self._told_s is not None and at_s > self._told_s:
            self._told_s = None

    def forget(self) -> None:
        """Another gateway begins, which has its own time until it tells that a target is missed."""
        self._held = NOTHING

    def note(self, block: bytes, at_s: float) -> None:
        """Judge the status block as it was at at_s. A voltage that is driven has no target, and a band of its own."""
        words = struct.unpack(f">{STATUS_WORDS}h", block)
        if at_s - self._last_s > LONGEST_GAP_S:  # another gateway may have begun
            self.forget()
        held, self._last_s = (words[4], words[5]), at_s
        is_held = (
            self._told_s is None
            and words[1] in (1, 2, HOLDING)
            and not words[0] & SWITCHING
            and words[2] != -32768
            and held == self._held
        )
        self._held = held
        error_n = abs(abs(words[2]) - words[4]) * COUNT_N
        is_missed = error_n > max(BAND_N, self._band[0] * COUNT_N) + MORE_N and words[4] * COUNT_N >= LEAST_N
        self._judge_unreached(words, at_s, is_off=is_held and is_missed)
        self._judge_in_band(words, error_n, at_s, is_held=is_held and 0 < words[4] == words[5])

    def _judge_unreached(self, words: tuple[int, ...], at_s: float, *, is_off: bool) -> None:
        if not is_off or words[11] & UNREACHABLE:
            self._off_s = at_s
        if at_s - self._off_s > HELD_OFF_S:
            self._complain("unreached", words, at_s)
            self._off_s = at_s

    def _judge_in_band(self, words: tuple[int, ...], error_n: float, at_s: float, *, is_held: bool) -> None:
        band_n, is_shown = self._band[0] * COUNT_N or BAND_N, bool(words[0] & IN_BAND)
        self._false = self._false + 1 if is_held and is_shown and error_n > band_n + MORE_N else 0
        is_in = is_held and words[1] == HOLDING and error_n < SHARE * band_n and self._band[1] <= LONGEST_BAND_MS
        if not is_in or is_shown:
            self._out_s = at_s
        if self._false >= LOOKS or at_s - self._out_s > COME_S:
            self._complain("in band" if is_shown else "not in band", words, at_s)
            self._false, self._out_s = 0, at_s

    def _complain(self, what: str, words: tuple[int, ...], at_s: float) -> None:
        force, target = words[2] * COUNT_N, words[4] * COUNT_N
        self._observer.complain("target", f"{what}: {force:.2f} N of {target:.2f} N, status {words[0]:#x}", at_s)
