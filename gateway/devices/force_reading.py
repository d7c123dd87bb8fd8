"""What a profile says of the readings of a load cell.

Checked when built: what a frame carries beside the force is either known (its sign, its unit, its health) or read over, and a
sign or a unit that would be read over is refused, for it would make a number that is believed and wrong.
"""

import re
from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from itertools import dropwhile, islice, pairwise
from math import inf
from typing import Annotated, Final, Literal

from annotated_types import Ge, Gt, Le

from gateway.defaults import STRICT
from gateway.devices.binary.weight_registers import WeightRegisters
from gateway.devices.fields import (
    Choice,
    Decimals,
    Field,
    HexNumber,
    Plain,
    RegisterNumber,
    Scientific,
    TemplateError,
    WholeNumber,
)
from gateway.devices.messages import Quality
from gateway.devices.template import Template, compile_template, quote
from gateway.units import NEWTON_PER_UNIT

ForceUnit = Literal["N", "kg", "g", "lb"]

FORCE: Final = "force"
SIGN: Final = "sign"
STATUS: Final = "status"
UNIT: Final = "unit"
MINUS: Final = "-"

_SPELT_UNITS: Final = {
    **{unit: unit for unit in NEWTON_PER_UNIT},
    **dict.fromkeys(("Kg", "KG", "kgf", "kgF", "KGF"), "kg"),
    **dict.fromkeys(("gf", "gF"), "g"),
    **dict.fromkeys(("Lb", "LB", "lbs", "LBS", "lbf", "lbF", "LBF"), "lb"),
    **dict.fromkeys(("MN", "kN", "daN", "cN", "mN", "t", "oz", "ozf", "ozF"), "another unit"),
}
"""What the word behind a force stands for, as devices spell it. A lone K or L is none: it may be a mode."""


def unit_meant(word: str) -> str:
    """Return the unit that a device's word stands for, blanks around it left out; the word itself where it is none."""
    return _SPELT_UNITS.get(word.strip(), word.strip())


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceReading:
    """One reading of a load cell: streamed, or the answer to `ask`.

    frame: template with the number {force:...}, perhaps a word {status:...}, a word {unit:...}, and a word {sign:...} where
    the minus stands apart from the digits. Where the frame says its unit, that unit counts; `unit` is what the simulated
    device is set to, and what a frame without one means. Raw counts of a converter have no unit but newton_per_count and
    zero_count, which a rig has measured. before: a sentence that is sent ahead of each question, that of identity too, or of
    the start. modbus: registers, in place of frame and ask. overload, underload: what the device says in place of the frame
    where it has no number to show; words in them change, and the profile's constants.
    """

    __pydantic_config__ = STRICT
    frame: str = ""  # template of the reading, with the number {force:...}
    ask: str = ""  # empty for a stream
    start: str = ""  # of a stream that begins when it is told to: sent at each opening, and again while nothing comes
    before: str = ""  # sent ahead of ask or start: such as the command to all devices to sample, or to one to listen
    before_answer: str = ""  # what is said to `before`, and read over; empty: nothing
    modbus: WeightRegisters | None = None  # of a Modbus device, instead of frame and ask
    unit: ForceUnit | None = None  # absent: the frame says it, or the rig must
    newton_per_count: Annotated[float, Gt(0)] | None = None  # of raw counts: one count in newtons, usually the rig's
    zero_count: float = 0.0  # of raw counts: reading without a force
    end_count: Annotated[float, Gt(0)] | None = None  # where the converter ends, as it is sent; counts as an overload
    quality: Mapping[str, Quality] = field(
        default_factory=dict
    )  # word of {status:...} -> how far to believe the reading
    negative: tuple[str, ...] = ()  # words of {status:...} that are a minus besides: of a character whose bits are both
    blank_is_overload: bool = False  # blanks instead of digits mean beyond the range
    overload: tuple[str, ...] = ()  # sentences of their own that mean beyond the range: ["S +"]
    underload: tuple[str, ...] = ()  # beyond its other end: ["S -"]; without it the device says overload there, too
    rate_hz: Annotated[float, Ge(0), Le(10_000)] = 0.0  # readings per second; with ask: the most, 0: as the wire allows

    def __post_init__(self) -> None:
        if self.modbus:
            if (self.ask, self.frame) not in (("", ""), self.modbus.templates()):
                raise ValueError("`modbus` stands for question and answer: leave `ask` and `frame` out")
            object.__setattr__(self, "ask", self.modbus.templates()[0])
            object.__setattr__(self, "frame", self.modbus.templates()[1])
        elif not self.frame:
            raise ValueError("`frame` is missing: the sentence with {force:...}, or `modbus` with the registers")
        if self.before and not (self.ask or self.start):
            raise ValueError("`before` is sent ahead of a question: there is no `ask`, nor a `start`")
        if self.before_answer and not self.before:
            raise ValueError("`before_answer` answers `before`: there is none")
        if self.start and self.ask:
            raise ValueError("`start` begins a stream: a cell that is asked needs none")
        if self.unit and self.newton_per_count:
            raise ValueError(f"unit {self.unit} and newton_per_count are two units for one number: leave one out")
        if self.modbus and self.beyond_range:
            raise ValueError(
                "`overload` and `underload` are sentences: beside `modbus` say the bits in `modbus.overload`"
            )
        said = filter(None, (self.ask, self.before, self.before_answer, self.start))
        for text in (*said, *self.overload, *self.underload):
            compile_template(text)
        _check_reading(compile_template(self.frame), self)

    @property
    def newton_per_unit(self) -> float | None:
        """Force of one unit of the device's number, N; None where neither unit nor counts say it."""
        return NEWTON_PER_UNIT[self.unit] if self.unit else self.newton_per_count

    @property
    def says_overload(self) -> bool:
        """Decide whether the device tells by itself that it is beyond its range."""
        return (
            self.blank_is_overload
            or bool(self.overload)
            or Quality.OVERLOAD in self.quality.values()
            or bool(self.modbus and self.modbus.overload)
        )

    @property
    def beyond_range(self) -> tuple[tuple[str, float], ...]:
        """The sentences that mean beyond the range, each with the number that it stands for: inf or -inf."""
        return tuple((text, inf) for text in self.overload) + tuple((text, -inf) for text in self.underload)

    @property
    def template(self) -> Template:
        """The compiled template of the cell's frame."""
        return compile_template(self.frame)

    @property
    def may_be_blank(self) -> str:
        """Name of the field that the cell leaves blank when overloaded; empty where it does not."""
        return FORCE if self.blank_is_overload else ""

    @property
    def decimals(self) -> int:
        """Number of digits behind the point of the cell's force, 0 for whole numbers."""
        number = self.template.field(FORCE)
        if self.modbus:
            return self.modbus.shown_decimals
        return number.decimals if isinstance(number, Decimals | Scientific | Plain) else 0

    @property
    def end(self) -> float | None:
        """End of the converter, in the device's unit: a count of registers is sent without its point."""
        if self.end_count is None:
            return None
        return self.end_count / 10.0**self.modbus.decimals if self.modbus else self.end_count

    @property
    def step(self) -> float:
        """One count of the display, in the device's unit."""
        return float(10.0**-self.decimals)

    @property
    def largest_shown(self) -> float:
        """The largest number that the display has digits for, with room for a sign, in the device's unit."""
        if self.end is not None:
            return self.end
        if self.modbus:
            return self.modbus.largest_shown
        number = self.template.field(FORCE)
        if isinstance(number, HexNumber):
            return float(16**number.width // (2 if number.is_signed else 1) - 1)
        width = number.width if isinstance(number, Decimals | WholeNumber) else 0
        if not width:
            return 999999.0
        digits = width - (not self.has_sign_apart) - (self.decimals + 1 if self.decimals else 0)
        return max(0.0, float(10.0**digits) - self.step)

    @property
    def has_sign_apart(self) -> bool:
        """Decide whether the minus stands in a word of its own, or in that of the status."""
        return bool(self.negative) or self.template.field(SIGN) is not None

    def word(self, quality: Quality, *, is_negative: bool = False) -> str | None:
        """Return the status word that means this, None where the frame has none; a device may know unstable readings only."""
        qualities = (quality, Quality.UNSTABLE) if quality is Quality.OK else (quality,)
        words = [word for one in qualities for word, meaning in self.quality.items() if meaning == one]
        return next((word for word in words if (word in self.negative) is is_negative), next(iter(words), None))

    def sign_word(self, number: float) -> str | None:
        """Return the word that says which sign a number has, None where its digits do."""
        field = self.template.field(SIGN)
        words = field.words if isinstance(field, Choice) else ()
        return next((word for word in words if (word.strip() == MINUS) is (number < 0.0)), None)

    def unit_word(self, unit: str) -> str:
        """Return the frame's own word for a unit, which may be padded."""
        field = self.template.field(UNIT)
        words = field.words if isinstance(field, Choice) else ()
        return next((word for word in words if unit_meant(word) == unit), unit)

    def read_over(self, constants: Container[str]) -> tuple[Field, ...]:
        """Return the fields whose words, digits or text change nothing in what is believed."""
        known = (FORCE, SIGN, STATUS, UNIT)
        return tuple(one for one in self.template.fields if one.name not in known and one.name not in constants)


def units_of(field: Field | None) -> tuple[str, ...]:
    """Return the units that the words of a field stand for, each as a device spells it; none where it has no words."""
    return tuple(map(unit_meant, field.words)) if isinstance(field, Choice) else ()


def _check_reading(template: Template, reading: ForceReading) -> None:
    number = template.field(FORCE)
    if not isinstance(number, Decimals | WholeNumber | HexNumber | Scientific | Plain | RegisterNumber):
        raise TemplateError(f"{quote(template.text)} has no number {{force:...}}")
    if reading.blank_is_overload and (number.is_open or not isinstance(number, Decimals)):
        raise TemplateError(f"{quote(template.text)}: blank_is_overload needs decimals of fixed width")
    _check_units(template, reading)
    _check_signs(template, number, reading)
    status = template.field(STATUS)
    if status and not isinstance(status, Choice):
        raise TemplateError(
            f"{quote(template.text)}: {{{STATUS}:...}} is words, each with its meaning in quality: ST|OL"
        )
    words = set(status.words if isinstance(status, Choice) else ())
    if odd := sorted(words ^ set(reading.quality)):
        told = ", ".join(f"{word!r} is {'not named' if word in words else 'no word of it'}" for word in odd)
        raise TemplateError(f"{quote(template.text)}: quality names the words of {{status:...}}: {told}")
    if reading.quality and set(reading.quality.values()) <= {Quality.OVERLOAD, Quality.REPEATED}:
        raise TemplateError(f"{quote(template.text)}: quality has no word for a good reading (ok, unstable)")


def _check_units(template: Template, reading: ForceReading) -> None:
    unit, units = template.field(UNIT), units_of(template.field(UNIT))
    if unit and reading.newton_per_count:
        raise TemplateError(f"{quote(template.text)} says its unit: newton_per_count is a second one for one number")
    if unit and not (units and set(units) <= set(NEWTON_PER_UNIT)):
        raise TemplateError(
            f"{quote(template.text)}: units are {', '.join(NEWTON_PER_UNIT)}; another is text, with `unit`"
        )
    if units and reading.unit and reading.unit not in units:
        raise TemplateError(f"{quote(template.text)} never says {reading.unit}: unit is one of {', '.join(units)}")
    _check_spelt_unit(template, reading)
    for one in template.fields:
        if one.name not in (UNIT, STATUS) and units_of(one) and set(units_of(one)) <= set(NEWTON_PER_UNIT):
            raise TemplateError(
                f"{quote(template.text)}: the words of {{{one.name}:...}} are units, and would be read over: call it "
                f"{{{UNIT}:...}}"
            )
        if isinstance(one, Choice) and not unit:
            _check_said_unit(template, one, reading)


def _check_said_unit(template: Template, words: Choice, reading: ForceReading) -> None:
    """A unit that goes while the weight moves is a word beside blanks: not read, but believed to be `unit`."""
    said = _units_beside_blanks(words)
    told = f"{quote(template.text)}: the words of {{{words.name}:...}} say {' and '.join(said)}"
    if len(said) > 1:
        raise TemplateError(f"{told}, and are not read as units: leave those out that the device is not set to")
    if said and not reading.newton_per_count and reading.unit not in said:
        cure = f"unit: {said[0]}" if said[0] in NEWTON_PER_UNIT else "leave unit out and say newton_per_count"
        raise TemplateError(f"{told}, which is not {f'unit: {reading.unit}' if reading.unit else 'said yet'}; {cure}")


def _units_beside_blanks(field: Choice) -> list[str]:
    """Return the units among a field's words, each once; of other words than the status only where all are units. A lone letter
    is one beside another unit only: N may be net, and g gross."""
    words = [word.strip() for word in field.words if word.strip()]
    known = [word for word in words if word in _SPELT_UNITS]
    all_are = len(known) == len(words)
    if not (all_are or field.name == STATUS):
        return []
    return list(dict.fromkeys(_SPELT_UNITS[word] for word in known if word[1:] or (all_are and len(words) > 1)))


def _check_spelt_unit(template: Template, reading: ForceReading) -> None:
    """The word behind the force is that of `unit`: kilonewtons are not to be believed as newtons."""
    word = _word_behind_force(template)
    said = _SPELT_UNITS.get(word)
    if said and reading.unit and said != reading.unit:
        cure = "leave unit out and say newton_per_count" if said not in NEWTON_PER_UNIT else f"unit: {said}"
        raise TemplateError(f"{quote(template.text)} says {word}, which is not unit: {reading.unit}; {cure}")


def _word_behind_force(template: Template) -> str:
    """Return the word that follows the number, empty where something else does. Behind a comma or a mark, such as that of
    rest, a lone letter is no unit: N may be net, and g gross."""
    behind = dropwhile(lambda one: one is not template.field(FORCE), template.pieces)
    is_next = True
    for one in islice(behind, 1, None):
        if isinstance(one, str) and (word := re.match(r"([ ,;]*)([A-Za-z]+)", one)):
            is_next &= not word[1].strip()
            return word[2] if is_next or word[2][1:] else ""
        if not (isinstance(one, Choice) or (isinstance(one, str) and not one.strip(" ,;"))):
            return ""
        is_next = False
    return ""


def _check_signs(template: Template, number: Field, reading: ForceReading) -> None:
    """A minus apart from its digits is read where the field is called `sign`, and nowhere else."""
    sign = template.field(SIGN)
    if sign and (not isinstance(sign, Choice) or [word.strip() for word in sign.words].count(MINUS) != 1):
        raise TemplateError(
            f"{quote(template.text)}: {{{SIGN}:...}} is the sign of the force: one of its words is a minus. Where that is "
            f"another character call it {{{STATUS}:...}}, and say which in `negative`"
        )
    if odd := sorted(set(reading.negative) - set(reading.quality)):
        raise TemplateError(f"{quote(template.text)}: negative names words of {{{STATUS}:...}}, and {odd[0]!r} is none")
    says_itself = isinstance(number, Decimals | WholeNumber | Scientific | Plain) and number.sign
    if (sign and reading.negative) or (reading.has_sign_apart and says_itself):
        raise TemplateError(f"{quote(template.text)}: the sign of the force stands here twice")
    ahead = next((text for text, one in pairwise(template.pieces) if one is number), "")
    if isinstance(ahead, str) and ahead[-1:] in ("+", MINUS):
        raise TemplateError(
            f"{quote(template.text)}: the sign of the force is text here, {ahead[-1]!r}, and always that one: write it into "
            "the number, such as {force:+07.2f}"
        )
    for one in template.fields:
        signs = {word.strip() for word in one.words} if isinstance(one, Choice) else set()
        if one.name != SIGN and MINUS in signs and signs <= {MINUS, "+", ""}:
            raise TemplateError(
                f"{quote(template.text)}: the minus in {{{one.name}:...}} would be read over, and a pull taken for a push: "
                f"call it {{{SIGN}:...}}"
            )
