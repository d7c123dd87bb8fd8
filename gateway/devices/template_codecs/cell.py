"""Both ends of the line from a load-cell amplifier whose readings are templates: a stream, or answers to polls.

The frame's own unit counts, so kilograms never pass for newtons. Blanks instead of digits are an overload whatever the
status word says: a display that shows nothing has no valid reading, and saturation counts as over-force. So are the sentences
that a device says in place of a number.
"""

from math import isfinite, isnan, nan
from typing import Final, NamedTuple

from gateway.devices.binary.rtu_framing import quiet_s
from gateway.devices.device_checks.spelling import CheckSpelling
from gateway.devices.device_checks.watchdog import WatchdogState
from gateway.devices.fields import Choice, Field, Text, Value, ValueRefused
from gateway.devices.force_reading import FORCE, MINUS, SIGN, STATUS, UNIT, ForceReading, unit_meant, units_of
from gateway.devices.framing import Line, LineSplitter
from gateway.devices.grammar import Grammar
from gateway.devices.messages import ForceSample, Garbage, Quality, RepeatedSample
from gateway.devices.profile import DeviceProfile
from gateway.units import NEWTON_PER_UNIT


def _own_unit(reading: ForceReading) -> str | None:
    """The unit that the device is set to: the profile's, else the first that its frames can say."""
    return reading.unit or next(iter(units_of(reading.template.field(UNIT))), None)


def newton_per_unit(profile: DeviceProfile, unit: str | None) -> float:
    """Return the force of one unit of the device's numbers, N. ValueError where neither profile nor rig says it."""
    unit = unit or _own_unit(profile.reading)
    per_unit = NEWTON_PER_UNIT[unit] if unit else profile.reading.newton_per_count
    if per_unit is None:
        raise ValueError(
            f"{profile.name} does not say its unit: the rig must, as unit, or newton_per_count for raw counts"
        )
    return per_unit


def _nothing(field: Field) -> Value:
    """What the simulated device says in a field that is not the force: a reader drops it."""
    if isinstance(field, Choice):
        return field.words[0]
    return "-" if isinstance(field, Text) else 0


_MOST_KNOWN: Final = 64  # sentences


class _KnownReading(NamedTuple):
    """What a sentence says, whenever it comes."""

    raw: float
    force_n: float
    quality: Quality

    def at(self, now_s: float) -> ForceSample | RepeatedSample:
        if self.quality is Quality.REPEATED:
            return RepeatedSample()
        return ForceSample(self.raw, self.force_n, self.quality, now_s)


class TemplateCellHost:
    """See roles.CellHost. sign -1: the wiring shows a push as negative. unit: only where frames leave it out."""

    def __init__(self, profile: DeviceProfile, sign: int = 1, unit: str | None = None) -> None:
        self._grammar = Grammar(profile)
        self._reading = profile.reading
        if unit and self._reading.template.field(UNIT):
            raise ValueError(f"{profile.name} says its unit in each frame: the rig's unit ({unit}) is one too many")
        self._newton_per_unit = newton_per_unit(profile, unit)
        self._sign, self._end = sign, self._reading.end
        self._lines = self._grammar.answers()
        self._asked, self._read_over = b"", frozenset[bytes]()
        self._known: dict[bytes, _KnownReading] = {}  # a force at rest says the same few sentences
        self._beyond_range = tuple(
            (text, _KnownReading(raw, self._newtons(raw, {}), Quality.OVERLOAD))
            for text, raw in self._reading.beyond_range
        )
        self.resolution_n = self._reading.step * self._newton_per_unit
        self.gap_s = quiet_s(profile.serial.character_s) if profile.is_modbus else 0.0

    def poll(self) -> bytes:
        """Return the question for one sample, empty for a cell that streams."""
        return self._remember(self._reading.ask)

    @property
    def start(self) -> bytes:
        """The sentence that begins the stream, empty where it needs none."""
        return self._remember(self._reading.start)

    def _remember(self, text: str) -> bytes:
        asked = self._grammar.cell_question(text)
        if asked:
            self._asked, self._read_over = asked, self._grammar.no_answers(asked)
            self._grammar.expect_own_words(self._lines, asked)
        return asked

    def forget(self) -> None:
        """Drop half a frame: what comes next of a stream may begin in the middle of a number, and so does the rest of a late
        answer: of `+00032.100` a reading of 2.100."""
        dropped, first = self._lines.forget(), self._reading.template.pieces[0]
        is_cut = dropped or not self._reading.ask
        if is_cut and not isinstance(first, str) and first.is_open and isinstance(self._lines, LineSplitter):
            self._lines.skip()

    def receive(self, chunk: bytes, now_s: float) -> list[ForceSample | Garbage | RepeatedSample]:
        """Return the samples and the garbage that these bytes complete, without our own words, which an adapter may hear, and
        the answer to `before`, nor what is read over. now_s: time of their arrival."""
        known = self._known.get(chunk)
        if known is not None and self._lines.is_between_lines:
            return [known.at(now_s)]  # one whole sentence, and one of the few
        lines = [line for line in self._lines.feed(chunk) if line.data not in self._read_over]
        said = ((line, self._sample(line, now_s)) for line in lines)
        return [one for line, one in said if not (isinstance(one, Garbage) and self._grammar.is_read_over(line))]

    def _sample(self, line: Line, now_s: float) -> ForceSample | Garbage | RepeatedSample:
        if not line.is_whole:
            return Garbage(line.data)
        meaning = self._known.get(line.data) or self._understand(line)
        return Garbage(line.data) if meaning is None else meaning.at(now_s)

    def _understand(self, line: Line) -> _KnownReading | None:
        body = self._grammar.body(line, self._asked)
        meaning = self._read(body) or self._read_beyond_range(body)
        if meaning is not None:
            if len(self._known) >= _MOST_KNOWN:
                self._known.clear()
            self._known[line.data] = meaning
        return meaning

    def _read(self, body: bytes | None) -> _KnownReading | None:
        values = self._grammar.read(self._reading.frame, body, self._reading.may_be_blank)
        if values is None:
            return None
        if self._reading.has_sign_apart and float(values[FORCE]) < 0.0:  # a minus behind a sign: which one counts?
            return None
        raw = self._raw(values)
        return _KnownReading(raw, self._newtons(raw, values), self._quality(raw, values))

    def _read_beyond_range(self, body: bytes | None) -> _KnownReading | None:
        """One of the sentences that the device says in place of a number; a word in them may be any of its words."""
        return next((one for text, one in self._beyond_range if self._grammar.read(text, body) is not None), None)

    def _raw(self, values: dict[str, Value]) -> float:
        """The number of the device, in its own unit."""
        number = float(values[FORCE])
        is_negative = str(values.get(SIGN, "")).strip() == MINUS or values.get(STATUS) in self._reading.negative
        return -number if is_negative else number

    def _newtons(self, raw: float, values: dict[str, Value]) -> float:
        per_unit = NEWTON_PER_UNIT[unit_meant(str(values[UNIT]))] if UNIT in values else self._newton_per_unit
        return self._sign * (raw - self._reading.zero_count) * per_unit

    def _quality(self, raw: float, values: dict[str, Value]) -> Quality:
        if isnan(raw) or (self._end is not None and abs(raw) >= self._end):
            return Quality.OVERLOAD
        return self._reading.quality[str(values[STATUS])] if STATUS in values else Quality.OK


class TemplateCellDevice:
    """See roles.CellDevice. unit: the rig's, where neither frame nor profile says one."""

    def __init__(self, profile: DeviceProfile, unit: str | None = None) -> None:
        self._grammar = Grammar(profile)
        self._reading = profile.reading
        self._unit = unit or _own_unit(self._reading) or "N"
        self._newton_per_unit = newton_per_unit(
            profile, unit or (None if self._reading.newton_per_count else self._unit)
        )
        nothing = {field.name: _nothing(field) for field in self._reading.template.fields}
        self._around: dict[str, Value] = {**nothing, **profile.constants, UNIT: self._reading.unit_word(self._unit)}
        self._beside: dict[tuple[Quality, bool], tuple[dict[str, Value], bool]] = {}
        self._known: dict[tuple[float, Quality], bytes] = {}  # as the host's: a force at rest shows the same few frames
        self._largest, self._decimals = self._reading.largest_shown, self._reading.decimals
        self._lines = self._grammar.questions()
        self._checks, self._answers = CheckSpelling(self._grammar), b""

    def receive(self, chunk: bytes, now_s: float) -> int:
        """Return how many questions these bytes complete."""
        reading, encode = self._reading, self._grammar.encode
        if not (reading.ask or reading.before_answer):
            return 0
        bodies = [self._grammar.body(line) for line in self._lines.feed(chunk)]
        for body in bodies:
            if reading.before_answer and body == encode(reading.before):
                self._answers += self._grammar.line(encode(reading.before_answer))
            if asked := self._checks.asked(body):
                self._answers += self._grammar.line(self._checks.reply(asked.step, WatchdogState.OFF, 0))
        return bodies.count(encode(reading.ask)) if reading.ask else 0

    def take_answers(self) -> bytes:
        """Return the answers to questions that are none for a reading, such as for its identity; each once."""
        answers, self._answers = self._answers, b""
        return answers

    def frame(self, force_n: float, quality: Quality = Quality.OK) -> bytes:
        """Return the frame that shows this force, or overload where the display is too small for it."""
        raw = force_n / self._newton_per_unit + self._reading.zero_count
        if quality is not Quality.OVERLOAD and isfinite(raw) and abs(raw) <= self._largest:
            try:
                return self._encode_frame(raw, quality)
            except ValueRefused:  # more digits than the display has
                pass
        if sentences := (self._reading.underload if force_n < 0.0 else ()) or self._reading.overload:
            return self._grammar.line(self._grammar.encode(sentences[0]))
        return self._encode_frame(nan if self._reading.blank_is_overload else self._largest, Quality.OVERLOAD)

    def _encode_frame(self, raw: float, quality: Quality) -> bytes:
        number = round(raw, self._decimals) if isfinite(raw) else raw
        known = self._known.get((number, quality))
        if known is None:
            if len(self._known) >= _MOST_KNOWN:
                self._known.clear()
            known = self._known[number, quality] = self._spell_frame(number, quality)
        return known

    def _spell_frame(self, number: float, quality: Quality) -> bytes:
        words, has_sign = self._words_beside(quality, is_negative=number < 0.0)
        values = {**self._around, **words, FORCE: abs(number) if has_sign else number}
        if self._reading.modbus:
            self._tell_registers(values, quality)
        return self._grammar.line(self._reading.template.encode(values, self._reading.may_be_blank))

    def _words_beside(self, quality: Quality, *, is_negative: bool) -> tuple[dict[str, Value], bool]:
        """Return the words for sign and status beside a number, and whether the minus is in them; looked for once for each."""
        if (quality, is_negative) not in self._beside:
            sign = self._reading.sign_word(-1.0 if is_negative else 1.0)
            status = self._reading.word(quality, is_negative=is_negative)
            words: dict[str, Value] = {
                name: word for name, word in ((SIGN, sign), (STATUS, status)) if word is not None
            }
            self._beside[quality, is_negative] = words, bool(sign or self._reading.negative)
        return self._beside[quality, is_negative]

    def _tell_registers(self, values: dict[str, Value], quality: Quality) -> None:
        """Put sign, decimals and health of a Modbus device into its registers: see ModbusCellDevice."""
