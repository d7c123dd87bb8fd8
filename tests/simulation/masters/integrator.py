"""A person who uploads models while the robot works, and the witness of what is then in use (I9).

The set in use is read back, one number of it is changed and the whole committed, each time with another number. Whatever
happens meanwhile, another one's upload, too: what is in use is one of the sets that were committed, whole; and once a commit
was acknowledged, that one, after a kill, too.
"""

import struct
from collections.abc import Callable
from zlib import crc32

from tests.simulation.masters.spelling import read_pdu, write_pdu
from tests.simulation.masters.tcp_master import Master

STAGING, ACTIVE = 1000, 1500
HEAD_WORDS, TAIL_FROM = 140, 150
COMMIT, STATUS = 1145, 1146
HANDLES_AT = 6  # of the rising branch, two words each, behind order, an unused word and the range
MOST_AT = 2 * 136  # the largest force that may be asked for
LESS_N = 40.0
COMMITTED, FAILED = 3, 4
ROLLBACK = 3
STEP_N = 0.001
MARKS = 50  # a plant has so many recipes, and not another one each time
LOOK_S, ASK_S = 1.0, 0.1
_HALVES = (read_pdu(ACTIVE, 100), read_pdu(ACTIVE + 100, 100))


class Sets:
    """What everybody who uploads knows together. allowed: sets one of which must be in use; known: all that were ever sent;
    first: what was in use in the beginning; stored_before: marks of what was stored by then; under_way: who uploads what now,
    with all that it may be mixed up with."""

    def __init__(self, stored_before: tuple[int, ...] = ()) -> None:
        self.allowed: set[bytes] = set()
        self.known: set[bytes] = set()
        self.first: bytes | None = None
        self.mark = 0
        self.stored_before = stored_before
        self._is_any = False
        self._under_way: dict[str, set[bytes]] = {}

    def begin_with(self, words: bytes) -> None:
        """Look for the first time at what is in use."""
        self.first = words
        self.allowed.add(words)
        self.known.add(words)
        for mark in self.stored_before:
            self.expect_mark(mark)

    def next_set(self) -> bytes:
        """A set that differs in one number from the MARKS - 1 before."""
        assert self.first is not None
        self.mark = self.mark % MARKS + 1
        return with_mark(self.first, self.mark)

    def begin(self, who: str, words: bytes) -> None:
        """Somebody begins to stage a set: whoever commits meanwhile may commit this one, if it is whole by then."""
        self.known.add(words)
        self._before = set(self.allowed)
        self.allowed.add(words)
        self._under_way[who] = {words}
        everything = set().union(*self._under_way.values())
        for name in self._under_way:
            self._under_way[name] = set(everything)

    def end(self, who: str, *, is_committed: bool) -> None:
        """It is told as committed, or not. While somebody else uploads, too, either may be in use."""
        may_be = self._under_way.pop(who, set())
        if is_committed:
            self.allowed, self._is_any = may_be, False
        elif len(may_be) == 1:
            self.allowed = self._before

    def forget(self, who: str) -> None:
        """Nobody knows now how it went."""
        self._under_way.pop(who, None)

    def expect_mark(self, mark: int) -> None:
        """A set with this mark is stored, so that somebody may take it into use, or has asked for it already."""
        if self.first is not None:
            words = with_mark(self.first, mark)
            self.known.add(words)
            if self._is_any:
                self.allowed.add(words)

    def expect_any(self) -> None:
        """Somebody takes one of the sets that there are into use."""
        self.allowed, self._is_any = set(self.known), True
        self._under_way.clear()


class Integrator(Master):
    """complaints: broken answers, and what was in use although nobody had committed it. committed: how many were;
    on_model: another set may be in use from now on."""

    committed = 0
    sets: Sets
    on_model: Callable[[], None] = staticmethod(lambda: None)
    _sent: bytes | None = None

    def watch(self) -> None:
        """Look at what is in use, from now on."""
        self._seen: list[bytes] = []
        self._look()

    def upload(self, pause_s: float = 0.0) -> None:
        """Commit a set of which one number is another one than in those before; pause_s: between its requests."""
        if self.sets.first is None or self._sent is not None or not self.connect():
            return
        words = self._sent = self.sets.next_set()
        block = words[: 2 * HEAD_WORDS] + struct.pack(">H2xI", len(words) // 2, crc32(words)) + bytes(2)
        parts = ((0, block[:200]), (100, block[200:]), (TAIL_FROM, words[2 * HEAD_WORDS :]))
        asked = [write_pdu(STAGING + at, *struct.unpack(f">{len(part) // 2}H", part)) for at, part in parts]
        self.sets.begin(self.name, words)
        self._stage([*asked, write_pdu(COMMIT, 1)], words, pause_s)

    def _stage(self, requests: list[bytes], words: bytes, pause_s: float) -> None:
        """Ask one after the other, unless the connection was lost meanwhile, or somebody has taken another set into use."""
        while requests and self._sent is words:
            self.ask(requests.pop(0))
            if pause_s:
                self._outside.call_later(pause_s, self._stage, requests, words, pause_s)
                return

    def recall(self) -> None:
        """Take the set before into use, whichever that is."""
        if self.connect():
            self.on_model()
            self.ask(write_pdu(COMMIT, ROLLBACK))

    def forget(self) -> None:
        """Somebody else takes a set into use: how an upload ends then tells nothing."""
        self._sent = None

    def lose(self) -> None:
        """Nobody knows now how a commit went: either set may be in use."""
        super().lose()
        self._sent = None
        self.sets.forget(self.name)

    def _look(self) -> None:
        for pdu in (*_HALVES, _HALVES[0]):
            self.ask(pdu)
        self._outside.call_later(LOOK_S, self._look)

    # -- what was answered

    def note_answer(self, asked: bytes, answer: bytes) -> None:
        """Follow the commit, and judge what is in use."""
        if asked in _HALVES:
            self._note_half(asked, answer)
        elif self._sent is not None and answer[0] == 0x90 and asked[1:3] != write_pdu(COMMIT, 1)[1:3]:
            self._sent = None  # what is staged is not this set: a person stops here, or has committed already
            self.sets.forget(self.name)
        elif self._sent is not None and asked in (write_pdu(COMMIT, 1), read_pdu(STATUS, 1)):
            self._note_commit(self._sent, answer)

    def _note_half(self, asked: bytes, answer: bytes) -> None:
        if asked == _HALVES[0] and len(self._seen) == 2:
            first, second = self._seen
            self._seen = []
            if first == answer:  # else another one was taken into use between the two
                self._judge(first[2:] + second[2:])
        elif answer[0] == 3 and (asked == _HALVES[0]) == (not self._seen):
            self._seen.append(answer)
        else:
            self._seen = []

    def _judge(self, block: bytes) -> None:
        words, sets = block[: 2 * HEAD_WORDS] + block[2 * TAIL_FROM :], self.sets
        if sets.first is None:
            sets.begin_with(words)
        elif words not in sets.allowed:
            which = f"the set with the CRC-32 {crc32(words):08x}"
            self.complaints.append(f"I9 at {self._outside.clock.now_s:.4f}: {which} is in use, which nobody committed")

    def _note_commit(self, sent: bytes, answer: bytes) -> None:
        is_committed = answer[0] == 3 and answer[3] == COMMITTED
        if is_committed or answer[0] & 0x80 or (answer[0] == 3 and answer[3] == FAILED):
            self._sent = None
            self.sets.end(self.name, is_committed=is_committed)
            self.committed += is_committed
        else:
            self._outside.call_later(ASK_S, lambda: self._sent is sent and self.ask(read_pdu(STATUS, 1)))


def with_mark(words: bytes, mark: float) -> bytes:
    """The same set, its highest force on the rising branch a little higher; with a mark below 0 one for less force."""
    place = 2 * (HANDLES_AT + 2 * words[1])
    top_n = struct.unpack_from(">f", words, place)[0] + mark * STEP_N
    words = words[:place] + struct.pack(">f", top_n) + words[place + 4 :]
    return words if mark >= 0 else words[:MOST_AT] + struct.pack(">f", LESS_N) + words[MOST_AT + 4 :]
