"""A person who uploads models while the robot works, and the witness of what is then in use (I9).

The set in use is read back, one number of it is changed and the whole committed, each time with another number. Whatever
happens meanwhile: what is in use is one of the sets that were committed, whole; and once a commit was acknowledged, that one,
after a kill, too.
"""

import struct
from zlib import crc32

from tests.simulation.masters.spelling import read_pdu, write_pdu
from tests.simulation.masters.tcp_master import Master

STAGING, ACTIVE = 1000, 1500
HEAD_WORDS, TAIL_FROM = 140, 150
COMMIT, STATUS = 1145, 1146
HANDLES_AT = 6  # of the rising branch, two words each, behind order, an unused word and the range
COMMITTED, FAILED = 3, 4
STEP_N = 0.001
MARKS = 50  # a plant has so many recipes, and not another one each time
LOOK_S, ASK_S = 1.0, 0.1
_HALVES = (read_pdu(ACTIVE, 100), read_pdu(ACTIVE + 100, 100))


class Integrator(Master):
    """complaints: broken answers, and what was in use although nobody had committed it. committed: how many were."""

    committed = 0
    _first: bytes | None = None
    _sent: bytes | None = None
    _mark = 0

    def watch(self) -> None:
        """Look at what is in use, from now on."""
        self._allowed: set[bytes] = set()
        self._known: set[bytes] = set()
        self._seen: list[bytes] = []
        self._look()

    def upload(self) -> None:
        """Commit a set of which one number is another one than in the MARKS - 1 before."""
        if self._first is None or self._sent is not None or not self.connect():
            return
        self._mark = self._mark % MARKS + 1
        words = with_mark(self._first, self._mark)
        block = words[: 2 * HEAD_WORDS] + struct.pack(">H2xI", len(words) // 2, crc32(words)) + bytes(2)
        for address, part in ((0, block[:200]), (100, block[200:]), (TAIL_FROM, words[2 * HEAD_WORDS :])):
            self.ask(write_pdu(STAGING + address, *struct.unpack(f">{len(part) // 2}H", part)))
        self._sent, self._before = words, self._allowed
        self._known.add(words)
        self._allowed = self._allowed | {words}
        self.ask(write_pdu(COMMIT, 1))

    def expect_any(self) -> None:
        """Somebody else takes one of the sets that there are into use."""
        self._allowed, self._sent = set(self._known), None

    def lose(self) -> None:
        """Nobody knows now how a commit went: either set may be in use."""
        super().lose()
        self._sent = None

    def _look(self) -> None:
        for pdu in (*_HALVES, _HALVES[0]):
            self.ask(pdu)
        self._outside.call_later(LOOK_S, self._look)

    # -- what was answered

    def note_answer(self, asked: bytes, answer: bytes) -> None:
        """Follow the commit, and judge what is in use."""
        if asked in _HALVES:
            self._note_half(asked, answer)
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
        words = block[: 2 * HEAD_WORDS] + block[2 * TAIL_FROM :]
        if self._first is None:
            self._first = words
            self._allowed.add(words)
            self._known.add(words)
        elif words not in self._allowed:
            which = f"the set with the CRC-32 {crc32(words):08x}"
            self.complaints.append(f"I9 at {self._outside.time():.4f}: {which} is in use, which nobody committed")

    def _note_commit(self, sent: bytes, answer: bytes) -> None:
        if answer[0] == 3 and answer[3] == COMMITTED:
            self._allowed, self._sent = {sent}, None
            self.committed += 1
        elif answer[0] & 0x80 or (answer[0] == 3 and answer[3] == FAILED):
            self._allowed, self._sent = self._before, None
        else:
            self._outside.call_later(ASK_S, lambda: self._sent is sent and self.ask(read_pdu(STATUS, 1)))


def with_mark(words: bytes, mark: float) -> bytes:
    """The same set, its highest force on the rising branch a little higher."""
    place = 2 * (HANDLES_AT + 2 * words[1])
    top_n = struct.unpack_from(">f", words, place)[0] + mark * STEP_N
    return words[:place] + struct.pack(">f", top_n) + words[place + 4 :]
