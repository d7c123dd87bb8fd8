"""From the bytes on a serial line to the requests for one unit on an RTU bus. No port, no clock.

On the wire 3.5 characters of silence end a frame. A program cannot see that silence truly: USB adapters hand over what they
have every 1 to 16 ms, so that a frame comes in two pieces with a pause between them, and two frames with their silence
come as one piece. So silence only says when to look; what is a frame, its length and its checksum say. Decisions:

- Nothing is executed before the line has been silent for 3.5 characters since the last read: the answer must wait that long
  anyway, and what follows a request may show that its master has given up.
- A frame whose length is known and that is incomplete gets 20 ms for its rest, unless a whole one that cannot lie inside of it
  begins after a silence. In many pieces it has these 20 ms once: an adapter delays them all alike. What is older is noise.
- Everything on the bus is followed, requests to other units and their answers, each skipped as a whole: what is inside of one
  is never taken for a request. An answer is longer (FC03) or shorter (FC16) than a request of its function would be.
- What is no frame is noise. A frame behind noise counts after a silence that was seen, one that only its checksum ends when
  nothing longer can still come; else only where nothing but whole frames follow up to the next silence, and where it cannot lie
  inside of what the noise may have begun: by its first three bytes a frame of another unit that was heard on this line. One or
  two bytes begin none: a line without bias puts them before each frame. In doubt nothing is done, for a master asks again.
- Another's answer that breaks off just behind a whole request to us, with an adapter's pause before that, cannot be told
  from a request behind a silence. It is executed: were it not, a neighbour that always breaks off would hide them all.
- Only the last frame is answered: behind an older request, executed as on TCP, its master or another slave has spoken since.
- An adapter may hear itself: rtu_echo.

Source: "MODBUS over Serial Line Specification and Implementation Guide V1.02", sections 2.2, 2.4 and 2.5.1.
"""

from bisect import bisect_right
from math import inf
from typing import Final, NamedTuple

from gateway.modbus.crc import checksum_end
from gateway.modbus.pdu import DIAGNOSTICS
from gateway.modbus.rtu import (
    BROADCAST_UNIT,
    LARGEST_UNIT,
    LONGEST_ADU,
    SHORTEST_ADU,
    answer_length,
    ends_in_silence,
    has_answer_length,
    has_request_length,
    is_broadcast_function,
    is_whole,
    request_length,
    silence_s,
)
from gateway.modbus.rtu_echo import RtuEcho

SPLIT_S: Final = 0.02
"""Longest pause inside of a frame: 16 ms is the slowest adapter's (FTDI as it comes), and a little for the machine."""
MOST_BYTES: Final = 512
"""Held without a silence: twice the longest frame. What comes before is dropped, but for the latest requests in it."""

_MOST_PASSED: Final = 8
_SLOWEST_CHARACTERS: Final = 2.5  # from one character of a frame to the next: it and a pause of 1.5 (section 2.5.1.1)
_MOST_PIECES: Final = 8  # of a frame, without a look at the time between them: a program may be late, too
_REST_PER_BYTE_S: Final = 40e-6
"""After looks that left noise, for each byte of it: a look takes an eighth of this at most, and noise no more of a core."""
_LOOKS_AHEAD_S: Final = 0.1  # as much may be looked at without a rest
_STRAY_BYTES: Final = 2  # before or behind a request that is answered: a line that floats makes one or two
_DIAGNOSTICS_BYTES: Final = 8  # the usual FC08: a sub-function with one word
_FRAMED: Final = frozenset(
    function for function in range(256) if has_request_length(function) or has_answer_length(function)
) | {DIAGNOSTICS}
"""Functions of frames that end by what they say themselves; those of noise are others, nine times in ten."""


class RtuRequest(NamedTuple):
    """A request for this unit or for all. is_answered: false for a broadcast, and where others have spoken since.
    is_in_doubt: rather to be refused, for it may be our own answer that has come back (rtu_echo)."""

    unit: int
    pdu: bytes
    is_answered: bool
    is_in_doubt: bool = False


class RtuReceiver:
    """What one unit hears. receive() what has arrived, then take() when deadline_s has come; tell note_sent() each answer.

    frames, noise_bytes: heard so far, foreign frames included. may_echo: false where the line cannot give our answers back.
    """

    __slots__ = (
        "_burst", "_character_s", "_echo", "_ends_s", "_last_s", "_marks", "_next_look_s", "_passed", "_silence_s", "_sizes",
        "_unit", "_units", "_wait_s", "frames", "noise_bytes",
    )  # fmt: skip

    def __init__(self, unit: int, baud: int, character_s: float, *, may_echo: bool) -> None:
        self._unit = unit
        self._units: set[int] = set()  # others that were heard on this line
        self._character_s = character_s
        self._silence_s = silence_s(baud, character_s)
        self._burst = bytearray()
        self._passed: list[RtuRequest] = []  # made out in what had to make room, and not taken yet
        self._sizes: dict[tuple[int, bool], int] = {}  # in one look, by place and whether a frame is known to begin
        self._marks: list[int] = []  # places in the burst that a visible silence lies before
        self._ends_s: list[float] = []  # when what lies before each of these silences had arrived
        self._last_s = 0.0
        self._wait_s = self._silence_s
        self._next_look_s = -inf
        self._echo = RtuEcho(character_s, self._silence_s, may_echo=may_echo)
        self.frames = 0
        self.noise_bytes = 0

    @property
    def deadline_s(self) -> float | None:
        """Time at which `take` has something to decide, if nothing arrives before; None: the line is silent."""
        return max(self._last_s + self._wait_s, self._next_look_s) if self._burst or self._passed else None

    def receive(self, data: bytes, now_s: float) -> None:
        """Append what has arrived by now."""
        if self._burst and now_s - self._last_s >= self._silence_s:
            self._marks.append(len(self._burst))
            self._ends_s.append(self._last_s)
        self._burst += data
        self._last_s, self._wait_s = now_s, self._silence_s
        if len(self._burst) > MOST_BYTES:
            self._shorten()

    def take(self, now_s: float) -> list[RtuRequest]:
        """Return the requests that the silence has ended, in order; none while more may belong to the last one."""
        if (deadline_s := self.deadline_s) is None or now_s < deadline_s:
            return []
        passed, self._passed = self._passed, []
        is_final = self._wait_s >= SPLIT_S  # not by the time alone: a program that was late first reads what has come
        found, noise, pending = self._scan(is_final=is_final)
        is_waiting = pending > (_STRAY_BYTES if found and self._burst[found[-1][0]] == self._unit else 0)
        if is_waiting and not is_final:
            self._wait_s = SPLIT_S
            rests_from_s = max(now_s, self._next_look_s + _LOOKS_AHEAD_S)
            self._next_look_s = rests_from_s + len(self._burst) * _REST_PER_BYTE_S - _LOOKS_AHEAD_S
            return passed + self._give_up(found)
        requests = self._requests(found)
        self.frames += len(found)
        self.noise_bytes += noise
        self._drop(len(self._burst))
        return passed + requests

    def note_sent(self, request: RtuRequest, answer: bytes, now_s: float) -> None:
        """Expect an answer (the whole frame) back on a line that hears itself."""
        self._echo.expect(answer, now_s, is_like_request=answer[1:-2] == request.pdu)
        if request.is_in_doubt:
            self._echo.note_refused()

    def forget(self) -> None:
        """Forget what has arrived: the port was lost."""
        self._drop(len(self._burst))
        self._passed.clear()
        self._echo.forget()
        self._units.clear()

    def _drop(self, count: int) -> None:
        del self._burst[:count]
        passed = bisect_right(self._marks, count)
        self._marks, self._ends_s = [mark - count for mark in self._marks[passed:]], self._ends_s[passed:]

    def _give_up(self, found: list[tuple[int, int]]) -> list[RtuRequest]:
        """Drop what began too long ago for a frame that is still coming, and return the requests among it. Noise that comes
        byte by byte would else be looked through with each byte by the half kilobyte, and took a whole core from control."""
        count, at = len(self._burst), 0
        for mark, end_s in zip(self._marks, self._ends_s, strict=True) if len(self._marks) > _MOST_PIECES else ():
            if self._last_s - end_s <= SPLIT_S + (count - mark) * _SLOWEST_CHARACTERS * self._character_s:
                break
            at = mark
        at = min([at, *(place for place, size in found if place < at < place + size)])
        gone = [(place, size) for place, size in found if place < at]
        requests = self._requests(gone)
        self.frames += len(gone)
        self.noise_bytes += at - sum(size for _, size in gone)
        self._drop(at)
        return [request._replace(is_answered=False) for request in requests]

    def _shorten(self) -> None:
        """Drop the frames that can be made out, then what is older than the longest frame. The latest requests among them are
        kept: where each hand-over of a busy bus ends in a frame no silence is seen, and no broadcast to stop is said again."""
        at, found = 0, list[tuple[int, int]]()
        self._sizes.clear()
        while at < len(self._burst) and (size := self._frame_size(at, is_start=True)):
            self._note_unit(at)
            found.append((at, size))
            at += size
        self.frames += len(found)
        self._passed += [request._replace(is_answered=False) for request in self._requests(found)]
        del self._passed[:-_MOST_PASSED]
        self._drop(at)
        if (surplus := len(self._burst) - LONGEST_ADU) > 0 and len(self._burst) > MOST_BYTES:
            self.noise_bytes += surplus
            self._drop(surplus)

    def _note_unit(self, at: int) -> None:
        if self._burst[at] != self._unit:
            self._units.add(self._burst[at])

    def _is_ours(self, at: int) -> bool:
        return self._burst[at] in (self._unit, BROADCAST_UNIT)

    def _requests(self, found: list[tuple[int, int]]) -> list[RtuRequest]:
        """Return those frames that are requests to us, in order; echoes are not, and are known before a master is noted."""
        requests: list[RtuRequest] = []
        ours = [(at, size, bytes(self._burst[at : at + size])) for at, size in found if self._is_ours(at)]
        heard = [one for one in ours if not self._echo.is_this(one[2], self._last_s)]
        for at, size, frame in heard:
            is_last = at == found[-1][0] and not self._echo.is_coming(size, self._last_s)
            is_answered = is_last and frame[0] == self._unit
            is_in_doubt = self._echo.is_in_doubt(frame, self._last_s)
            requests.append(RtuRequest(frame[0], frame[1:-2], is_answered, is_in_doubt and is_answered))
            if not is_in_doubt:
                self._echo.note_master(size, self._last_s)
        return requests

    def _scan(self, *, is_final: bool) -> tuple[list[tuple[int, int]], int, int]:
        """Return (the frames as place and size, bytes of noise, bytes at the end that may begin a frame)."""
        found: list[tuple[int, int]] = []
        at = noise = 0
        self._sizes.clear()
        while at < len(self._burst):
            if size := self._frame_size(at, is_start=True):
                found.append((at, size))
                self._note_unit(at)
                at += size
                continue
            resumed, is_pending = self._resume(at, is_final=is_final)
            if resumed is None:
                rest = len(self._burst) - at
                return found, noise + rest, rest if is_pending else 0
            noise, at = noise + resumed - at, resumed
        return found, noise, 0

    def _resume(self, noise_at: int, *, is_final: bool) -> tuple[int | None, bool]:
        """Return where the first frame behind noise begins, None for none, and whether the noise may yet become one."""
        end, at, start = len(self._burst), noise_at, noise_at
        longest = self._claimed_end(at)
        claimer, claimed = at, longest if self._burst[at] in self._units else at  # a frame that the noise may be of
        dead = set[int]()
        while (at := self._next_beginning(at + 1)) < end:
            is_marked = at in self._marks
            if size := self._frame_size(at, is_start=is_marked):
                is_apart = at <= claimer + _STRAY_BYTES or claimed < at + size
                is_decided = is_final or longest <= end
                has_length = not ends_in_silence(bytes(self._burst[at : at + SHORTEST_ADU]))
                is_sure = is_marked and (is_decided or (is_apart and has_length))
                if is_sure or (is_apart and is_decided and self._is_all_frames(at + size, dead)):
                    return at, False
                if self._burst[at] in self._units:
                    at += size - 1  # whole, but inside of something else: what is in it is no frame either
                continue
            end_here = self._claimed_end(at)
            longest = max(longest, end_here)
            start = at if is_marked else start
            is_known = self._burst[at] in self._units
            is_anew = is_marked and (is_final or claimed <= end)
            if is_anew or (is_known and at <= start + _STRAY_BYTES and end_here > claimed):
                claimer, claimed = at, end_here if is_known else at
        return None, longest > end

    def _next_beginning(self, at: int) -> int:
        """Return the next place at which a frame may begin, or may be claimed to. Most bytes of noise are told by themselves
        and the one behind them: half a kilobyte of it must not take the time of a control step."""
        burst, marks = self._burst, self._marks
        echoed = self._echo.frame[0] if self._echo.frame else None
        for place in range(at, len(burst) - 1):
            unit = burst[place]
            if unit == echoed or place in marks or (unit <= LARGEST_UNIT and burst[place + 1] in _FRAMED):
                return place
        return max(at, len(burst) - 1)

    def _is_all_frames(self, at: int, dead: set[int]) -> bool:
        """Decide whether whole frames and nothing else follow, up to a silence that was seen or the end. dead: places from
        which they do not, and this adds to them: walked again from each frame of a row, half a kilobyte took 33 ms."""
        passed: list[int] = []
        while at < len(self._burst) and at not in self._marks:
            passed.append(at)
            if at in dead or not (size := self._frame_size(at, is_start=True)):
                dead.update(passed)
                return False
            at += size
        return at == len(self._burst) or at in self._marks

    def _frame_size(self, at: int, *, is_start: bool) -> int:
        """Return what `_measure_frame` does, once in one look: frames inside of frames, each behind a silence, doubled the work
        with each more of them, and 22 in 188 bytes held up control for 13 s."""
        size = self._sizes.get((at, is_start))
        if size is None:
            size = self._sizes[at, is_start] = self._measure_frame(at, is_start=is_start)
        return size

    def _measure_frame(self, at: int, *, is_start: bool) -> int:
        """Return the size of the whole frame that begins here; 0 for none. is_start: a frame is known to begin here, so that
        one of an unknown function ends where a checksum fits; to everybody it would act nowhere, and zeros, which many
        requests are full of, are no broadcast of function 0. Chance makes frames of noise and the beginning of a request: a
        frame that begins behind a silence comes before one that goes across it, unless it lies wholly inside of that one: an
        answer to another master may hold a request, and an adapter's pause may fall just there."""
        frame = bytes(self._burst[at : at + LONGEST_ADU])
        if len(frame) < SHORTEST_ADU or frame[0] > LARGEST_UNIT:
            return 0
        lengths = [request_length(frame)]
        if frame[0] != self._unit:
            if has_answer_length(frame[1]):
                lengths.append(answer_length(frame))
        elif self._echo.frame and frame.startswith(self._echo.frame):
            return len(self._echo.frame)
        if frame[1] == DIAGNOSTICS:
            lengths.append(_DIAGNOSTICS_BYTES)
        if is_start and frame[0] != BROADCAST_UNIT and ends_in_silence(frame):
            silence_at = next((mark for mark in self._marks if mark > at), len(self._burst))
            lengths.append(checksum_end(frame[: silence_at - at], SHORTEST_ADU))
        size = next((size for size in lengths if size and is_whole(frame, size)), 0)
        if not size:
            return 0
        end = at + size
        ends = (mark + self._frame_size(mark, is_start=True) for mark in self._marks if at < mark < end)
        return 0 if any(mark_end >= end for mark_end in ends) else size

    def _claimed_end(self, at: int) -> int:
        """Return where a frame would end that begins here, by its first bytes: `at` when none can, beyond the end of the
        burst while it may still come."""
        frame = bytes(self._burst[at : at + LONGEST_ADU])
        unit, beyond = frame[0], len(self._burst) + 1
        if unit > LARGEST_UNIT:
            return at
        if len(frame) == 1 or self._echo.frame.startswith(frame):
            return beyond
        lengths: list[int | None] = [_DIAGNOSTICS_BYTES] if frame[1] == DIAGNOSTICS and unit != BROADCAST_UNIT else []
        if has_request_length(frame[1]) and (unit != BROADCAST_UNIT or is_broadcast_function(frame[1])):
            lengths.append(request_length(frame))
        if unit not in (self._unit, BROADCAST_UNIT) and has_answer_length(frame[1]):
            lengths.append(answer_length(frame))
        return max((at + size if size else beyond for size in lengths), default=at)
