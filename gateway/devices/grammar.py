"""A profile's templates at work: numbers into whole lines and back, for both ends of a wire."""

from dataclasses import dataclass, field
from typing import Final

from gateway.devices.binary.raw_bytes import ByteSplitter, TextSplitter
from gateway.devices.binary.rtu_framing import RtuSplitter, answers, requests, rtu_frame
from gateway.devices.checksum import add_checksum, strip_checksum
from gateway.devices.exchange import Exchange, VoltageExchange
from gateway.devices.fields import Choice, Field, Plain, RegisterNumber, Scientific, Text, Value, ValueRefused
from gateway.devices.framing import Line, LineSplitter
from gateway.devices.messages import OutputRequest, ReadPressure, ReadVoltage, SetVoltage
from gateway.devices.profile import DeviceProfile
from gateway.devices.template import compile_template

Splitter = LineSplitter | RtuSplitter | ByteSplitter
_MOST_LINES: Final = 64


@dataclass(frozen=True, slots=True)
class Grammar:
    """Remembers which number each template carries: a setpoint passes here on its way to the wire."""

    profile: DeviceProfile
    _numbers: dict[str, tuple[Field | None, int]] = field(default_factory=dict, compare=False)
    _around: dict[str, dict[str, Value]] = field(default_factory=dict, compare=False)
    _lines: dict[tuple[str, float], bytes] = field(default_factory=dict, compare=False)

    @property
    def set_voltage(self) -> VoltageExchange:
        """The exchange that sets the voltage; an output's profile always has one."""
        assert self.profile.set_voltage  # an output's profile was checked for it
        return self.profile.set_voltage

    def exchange(self, message: OutputRequest) -> Exchange:
        """Return how this is asked and answered; ValueRefused when the device has no words for it."""
        exchange: Exchange | None = None
        match message:
            case SetVoltage():
                exchange = self.profile.set_voltage
            case ReadVoltage():
                exchange = self.profile.read_voltage
            case ReadPressure():
                exchange = self.profile.read_pressure
        if exchange is None:
            raise ValueRefused(f"{self.profile.name} has no words for {type(message).__name__}")
        return exchange

    def number_in(self, template: str) -> tuple[Field | None, int]:
        """Return the field that carries a template's number, and its decimals."""
        if template not in self._numbers:
            self._numbers[template] = self.profile.number_in(template), self.profile.decimals_in(template)
        return self._numbers[template]

    def answers(self) -> Splitter:
        """Return what cuts the device's bytes into sentences."""
        profile = self.profile
        if profile.is_raw:
            return ByteSplitter(profile.question_bytes)
        return answers(profile.unit_id) if profile.is_modbus else LineSplitter(profile.terminator_bytes)

    def questions(self) -> Splitter:
        """Return what cuts the gateway's bytes into sentences, at the device's end."""
        profile = self.profile
        if profile.is_raw:
            return ByteSplitter(profile.question_bytes)
        if profile.question_terminator == "":
            sentence = self.words(profile.reading.ask or profile.reading.start)
            return TextSplitter(len(self.question_line(sentence.encode("ascii"))))
        return requests(profile.unit_id) if profile.is_modbus else LineSplitter(profile.question_terminator_bytes)

    def line(self, body: bytes) -> bytes:
        """Return a sentence of the device with its checksum and terminator: what goes on the wire."""
        return self._framed(body, self.profile.terminator_bytes)

    def question_line(self, body: bytes) -> bytes:
        """Return a sentence to the device with its checksum and terminator."""
        return self._framed(body, self.profile.question_terminator_bytes)

    def cell_question(self, text: str) -> bytes:
        """Return a sentence to a load cell with the one ahead of it, which opens it on its bus; nothing without it."""
        texts = filter(None, (self.profile.reading.before, text)) if text else ()
        return b"".join(self.question_line(self.encode(one)) for one in texts)

    def no_answers(self, asked: bytes) -> frozenset[bytes]:
        """Return the lines that come behind a question to a load cell and are no noise: our own words, and what is said to the
        sentence ahead of it."""
        acknowledged = self.profile.reading.before_answer
        return self.own_lines(asked) | ({self.line(self.encode(acknowledged))} if acknowledged else set())

    @property
    def is_bare(self) -> bool:
        """Decide whether a sentence is followed by its terminator, and has neither checksum nor frame."""
        return not self.profile.is_modbus and self.profile.checksum == "none"

    def _framed(self, body: bytes, terminator: bytes) -> bytes:
        if self.profile.is_modbus:
            return rtu_frame(self.profile.unit_id, body)
        if self.profile.is_raw:
            return bytes.fromhex(body.decode("ascii"))
        return add_checksum(body, self.profile.checksum) + terminator

    def own_lines(self, asked: bytes) -> frozenset[bytes]:
        """Return what comes of our own words through an adapter that hears itself: all at once, or each line."""
        if self.profile.is_modbus or self.profile.is_raw:
            return frozenset((asked,))
        end = self.profile.question_terminator_bytes
        if not end:
            return frozenset()
        return frozenset((asked, *(line + end for line in asked.split(end)[:-1])))

    def expect_own_words(self, lines: Splitter, asked: bytes) -> None:
        """Tell what cuts the device's bytes what went out, where no end of a line parts it from the answer."""
        if isinstance(lines, RtuSplitter):
            lines.asked = asked

    def body(self, line: Line, asked: bytes = b"") -> bytes | None:
        """Return the sentence in a line that arrived, None when it is overlong or its checksum is wrong.
        asked: our own words, which an adapter that hears itself puts ahead of an answer; where they end as an answer does,
        they are a line of their own, and bare characters may be the first of the answer's number."""
        own = asked if self.profile.question_terminator != "" else b""
        return strip_checksum(line.body.removeprefix(own), self.profile.checksum) if line.is_whole else None

    def is_read_over(self, line: Line) -> bool:
        """Decide whether a line is one of those that the device says besides, and that mean nothing here."""
        texts = self.profile.read_over
        body = self.body(line) if texts else None
        return (body == b"" and "" in texts) or any(self.read(text, body) is not None for text in texts)

    def number_body(self, template: str, number: float) -> bytes:
        """Return the sentence with this number in it, nearest on the template's own grid; others in it are 0."""
        values = self.fill(template)
        number_field, decimals = self.number_in(template)
        if number_field is not None:
            values = {**values, number_field.name: round(number, decimals)}
        return compile_template(template).encode(values)

    def fill(self, template: str) -> dict[str, Value]:
        """Return the values of all fields that nobody asks about: the profile's constants, else 0; of words the first."""
        if template not in self._around:
            self._around[template] = _fill(template) | dict(self.profile.constants)
        return self._around[template]

    def number_line(self, template: str, number: float) -> bytes:
        """Return the device's line with this number in it; of what stands still it is the same again and again."""
        if (template, number) not in self._lines:
            if len(self._lines) >= _MOST_LINES:
                self._lines.clear()
            self._lines[template, number] = self.line(self.number_body(template, number))
        return self._lines[template, number]

    def words(self, template: str) -> str:
        """Return a sentence as text, with the profile's constants; its other numbers are 0. An empty one is none."""
        return self.encode_filled(template, dict(self.profile.constants)).decode("ascii") if template else ""

    def refusal(self, body: bytes) -> str:
        """Return the words by which the device refuses, empty where this sentence is no refusal."""
        is_refusal = any(self.read(text, body) is not None for text in self.profile.refusals.texts())
        return body.decode("ascii") if is_refusal else ""

    def encode_filled(self, template: str, values: dict[str, Value]) -> bytes:
        """Return the sentence with these values; what else it carries is nothing in particular, as a simulated device says."""
        return self.encode(template, _fill(template) | values)

    def encode(self, template: str, values: dict[str, Value] | None = None) -> bytes:
        """Return the sentence with these values and the profile's constants."""
        return compile_template(template).encode({**(values or {}), **self.profile.constants})

    def answer_line(self, exchange: Exchange, value: float) -> bytes:
        """Return the answer with this physical value in it; a sensor or a setting stops at the ends of its range."""
        number = exchange.range.scale.on_grid(exchange.range.scale.to_number(value), self.number_in(exchange.answer)[1])
        return self.number_line(exchange.answer, number)

    def read(self, template: str, body: bytes | None, may_be_blank: str = "") -> dict[str, Value] | None:
        """Return the field values, None unless body is this sentence with this profile's constants.
        A sentence with another address belongs to another device."""
        values = compile_template(template).decode(body, may_be_blank) if body is not None and template else None
        constants = self.profile.constants
        if values and constants and any(values.get(name, fixed) != fixed for name, fixed in constants.items()):
            return None
        return values

    def number(self, template: str, values: dict[str, Value]) -> float | None:
        """Return the number among the values, None when the template carries none."""
        number_field, _ = self.number_in(template)
        return float(values[number_field.name]) if number_field else None

    def step(self, exchange: Exchange, template: str) -> float:
        """Return the widest gap between the numbers that this template of the exchange tells apart, in the device's unit:
        half of it is lost where a number is rounded. 0 where it carries none."""
        number, decimals = self.number_in(template)
        if isinstance(number, Scientific | Plain | RegisterNumber):
            return number.step_below(max(map(abs, exchange.range.device)))
        return float(10.0**-decimals) if number is not None else 0.0


def _fill(template: str) -> dict[str, Value]:
    """What the simulated device says in the fields that nobody asks about."""
    fields = compile_template(template).fields
    return {one.name: "-" if isinstance(one, Text) else 0 for one in fields if not isinstance(one, Choice)}
