"""Both ends of the wire to a directional valve: our questions and the device's answers. Bytes in, directions out."""

import re
from collections import deque
from typing import Final

from gateway.devices.binary.raw_bytes import ByteSplitter, byte_count
from gateway.devices.binary.rtu_framing import exception_text, quiet_s
from gateway.devices.framing import Line
from gateway.devices.grammar import Grammar
from gateway.devices.messages import Garbage
from gateway.devices.profile import DeviceProfile, DeviceRole
from gateway.devices.template import TEXT_CHARACTERS, quote
from gateway.devices.valve_profile import STATE, ValveDirection, ValveReading, ValveSettings

Question = ValveDirection | None
"""A direction to take, or None: which one stands?"""

_DIRECTIONS: Final = tuple(ValveDirection)
_TEXT: Final = re.compile(f"[{TEXT_CHARACTERS}]{{1,40}}".encode("ascii"))


def _words_of(profile: DeviceProfile) -> tuple[ValveSettings, ValveReading]:
    if profile.role is not DeviceRole.VALVE or profile.set_valve is None or profile.read_valve is None:
        raise ValueError(f"{profile.name} is of role {profile.role}, valve is needed here")
    return profile.set_valve, profile.read_valve


class ValveHost:
    """Our end: at most one question is out. said: what the device has said last in place of an answer, until somebody empties
    it; empty where that is nothing, or no text. ValueError for a profile of another role."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._settings, self._reading = _words_of(profile)
        self._grammar = Grammar(profile)
        self._lines = self._grammar.answers()
        self._expected: deque[Question] = deque(maxlen=1)
        self.said, self._function, self._asked = "", b"", b""
        self.gap_s = quiet_s(profile.serial.character_s) if profile.is_modbus else 0.0

    def request(self, question: Question) -> bytes:
        """Return the bytes to write; their answer is expected from now on."""
        self._lines.forget()
        self._expected.append(question)
        asks = [self._settings.of(question).ask] if question else []
        answer = self._settings.of(question).answer if question else ""
        if not answer:
            asks.append(self._reading.ask)
        self._function = asks[-1][:2].encode("ascii")
        if isinstance(self._lines, ByteSplitter):
            self._lines.length = byte_count(answer or self._reading.answer)
        self._asked = b"".join(self._grammar.question_line(self._grammar.encode(ask)) for ask in asks)
        self._grammar.expect_own_words(self._lines, self._asked)
        return self._asked

    def receive(self, chunk: bytes) -> list[ValveDirection | Garbage]:
        """Return the directions that these bytes tell: an obeyed setting, or what stands. Never raises. Our own words, which
        an adapter may hear, are left out."""
        found = [self._answer(line) for line in self._lines.feed(chunk)]
        own = self._grammar.own_lines(self._asked)
        return [one for one in found if not (isinstance(one, Garbage) and one.data in own)]

    def forget(self) -> None:
        """Drop half-received bytes and the expected answer."""
        self._lines.forget()
        self._expected.clear()

    def _answer(self, line: Line) -> ValveDirection | Garbage:
        body = self._grammar.body(line, self._asked)
        if not self._expected:
            return Garbage(line.data)
        question = self._expected[0]
        if question is not None and (answer := self._settings.of(question).answer):
            is_obeyed = self._grammar.read(answer, body) is not None
            told = question if is_obeyed else None
        else:
            values = self._grammar.read(self._reading.answer, body)
            told = self._reading.words.get(str(values[STATE])) if values else None
        if told is None:
            if line.data not in self._grammar.own_lines(self._asked):
                self.said = self._text_of(line, body)
            return Garbage(line.data)
        self._expected.clear()
        return told

    def _text_of(self, line: Line, body: bytes | None) -> str:
        if self._grammar.profile.is_modbus:
            is_answer = body is not None and body[:2] == self._function  # else it is late
            return exception_text(body or b"") or (quote(body.decode("ascii")) if body and is_answer else "")
        return quote(line.body.decode("ascii")) if _TEXT.fullmatch(line.body) else ""


class ValveDevice:
    """The device's end, for the simulated rig and for tests. ValueError for a profile of another role."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._settings, self._reading = _words_of(profile)
        self._grammar = Grammar(profile)
        self._lines = self._grammar.questions()

    def receive(self, chunk: bytes) -> list[Question | Garbage]:
        """Return the questions in the order of arrival."""
        return [self._question(line) for line in self._lines.feed(chunk)]

    def reply(self, question: Question, stands: ValveDirection) -> bytes:
        """Return the answer to a question, with the direction that stands."""
        if question is not None:
            answer = self._settings.of(question).answer
            return self._grammar.line(self._grammar.encode_filled(answer, {})) if answer else b""
        return self._grammar.line(
            self._grammar.encode_filled(self._reading.answer, {STATE: self._reading.word_of(stands)})
        )

    def _question(self, line: Line) -> Question | Garbage:
        body = self._grammar.body(line)
        for direction in _DIRECTIONS:
            if self._grammar.read(self._settings.of(direction).ask, body) is not None:
                return direction
        return None if self._grammar.read(self._reading.ask, body) is not None else Garbage(line.data)
