"""What a profile says about one exchange with a device: question, answer, and how its number maps to a physical value.

Checked when built: a template that means nothing is told to its author, not to a running cell.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import ceil, floor, inf
from typing import Annotated, Final, Literal

from annotated_types import Ge, Gt, Le, MinLen

from gateway.defaults import STRICT
from gateway.devices.binary.register_access import RegisterAccess, check_direction, templates_of
from gateway.devices.binary.weight_registers import WeightRegisters
from gateway.devices.fields import Choice, Decimals, HexNumber, RegisterNumber, TemplateError, WholeNumber
from gateway.devices.messages import Quality
from gateway.devices.template import Template, compile_template, quote
from gateway.units import NEWTON_PER_UNIT

Span = tuple[float, float]
_GRAIN: Final = 1e-6  # of a step: what binary fractions are off
ForceUnit = Literal["N", "kg", "g", "lb"]

FORCE: Final = "force"
STATUS: Final = "status"
UNIT: Final = "unit"


@dataclass(frozen=True, slots=True)
class Scale:
    """A straight line between the device's numbers and physical values. Both spans rise."""

    device: Span
    physical: Span

    @property
    def physical_per_number(self) -> float:
        """Slope of the scale: physical units per number of the device."""
        return (self.physical[1] - self.physical[0]) / (self.device[1] - self.device[0])

    def to_physical(self, number: float) -> float:
        """Return the physical value of a number on the wire."""
        return self.physical[0] + (number - self.device[0]) * self.physical_per_number

    def to_number(self, value: float) -> float:
        """Return the number on the wire for a physical value, not rounded."""
        return self.device[0] + (value - self.physical[0]) / self.physical_per_number

    def carries(self, number: float, slack: float = 0.0) -> bool:
        """Decide whether the scale spans this number of the device.
        slack: in the device's numbers; half a step where the number was rounded before it was sent."""
        return self.device[0] - slack <= number <= self.device[1] + slack

    def on_grid(self, number: float, decimals: int) -> float:
        """Return the nearest number with so many decimals that lies within the range, where one does."""
        per_unit: int = 10**decimals
        lowest, highest = self.grid(decimals)
        return float(min(highest, max(lowest, round(number * per_unit)))) / per_unit

    def grid(self, decimals: int) -> tuple[int, int]:
        """Return the first and the last number with so many decimals within the range, in units of the last one."""
        per_unit: int = 10**decimals
        return ceil(self.device[0] * per_unit - _GRAIN), floor(self.device[1] * per_unit + _GRAIN)


def _scale(device: Span, physical: Span) -> Scale:
    if device[0] >= device[1] or physical[0] >= physical[1]:
        raise ValueError(f"range {device} <-> {physical} must rise on both sides")
    return Scale(device, physical)


@dataclass(frozen=True, slots=True, kw_only=True)
class VoltageRange:
    """The device's numbers `device` mean the voltages `voltage_v`, V; linear between."""

    __pydantic_config__ = STRICT
    device: Span  # [low, high] in the device's numbers
    voltage_v: Span  # [low, high], V

    def __post_init__(self) -> None:
        _scale(self.device, self.voltage_v)

    @property
    def scale(self) -> Scale:
        """The scale between the device's numbers and volts."""
        return Scale(self.device, self.voltage_v)


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureRange:
    """The device's numbers `device` mean the gauge pressures `pressure_pa`, Pa; linear between."""

    __pydantic_config__ = STRICT
    device: Span  # [low, high] in the device's numbers
    pressure_pa: Span  # [low, high], Pa

    def __post_init__(self) -> None:
        _scale(self.device, self.pressure_pa)

    @property
    def scale(self) -> Scale:
        """The scale between the device's numbers and pascals."""
        return Scale(self.device, self.pressure_pa)


@dataclass(frozen=True, slots=True, kw_only=True)
class VoltageExchange:
    """Set or read the output voltage. ask, answer: templates; the one number in them is scaled by range. Where a sentence
    carries several numbers, {value:...} is the one. modbus: registers, in place of ask and answer.

    The answer is how the gateway knows that the device has obeyed: an echo of the number, or a word. A device that says
    nothing to a setting (no `answer`) is asked with `read_voltage` after each; one that has neither is refused.
    """

    __pydantic_config__ = STRICT
    ask: str = ""  # template of the question, without terminator
    answer: str = ""  # template of the answer, without terminator; empty in set_voltage: the device says nothing
    modbus: RegisterAccess | None = None  # of a Modbus device, instead of ask and answer
    range: VoltageRange  # what the number means

    def __post_init__(self) -> None:
        ask, answer = templates_of(self.modbus, self.ask, self.answer)
        object.__setattr__(self, "ask", ask)
        object.__setattr__(self, "answer", answer)
        compile_template(ask)
        if answer:
            compile_template(answer)


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureExchange:
    """Read the measured pressure."""

    __pydantic_config__ = STRICT
    ask: str = ""  # template of the question, without terminator
    answer: str = ""  # template of the answer, without terminator
    modbus: RegisterAccess | None = None  # of a Modbus device, instead of ask and answer
    range: PressureRange  # what the number means

    def __post_init__(self) -> None:
        check_direction(self.modbus, reads=True)
        ask, answer = templates_of(self.modbus, self.ask, self.answer)
        if not answer:
            raise ValueError("`answer` is missing: the sentence that carries the pressure")
        object.__setattr__(self, "ask", ask)
        object.__setattr__(self, "answer", answer)
        compile_template(ask)
        compile_template(answer)


Exchange = VoltageExchange | PressureExchange


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A command that moves the setting by a fixed number. Only the device role knows it: the host always sets."""

    __pydantic_config__ = STRICT
    ask: Annotated[str, MinLen(1)]  # the command, a bare word
    by: float  # in the device's numbers

    def __post_init__(self) -> None:
        if compile_template(self.ask).fields:
            raise TemplateError(f"{quote(self.ask)}: a step is a bare word")


@dataclass(frozen=True, slots=True, kw_only=True)
class OutOfRange:
    """What the device answers to a number beyond its range, and up to which number it does (else: unknown)."""

    __pydantic_config__ = STRICT
    text: Annotated[str, MinLen(1)]  # the device's words
    numbers: Span  # [first, last] number that is answered so; any other is unknown


@dataclass(frozen=True, slots=True, kw_only=True)
class Refusals:
    """The device's words for no, with its address in them where it says one. Empty or absent: it stays silent."""

    __pydantic_config__ = STRICT
    unknown: str = ""  # to what it does not understand; empty: silence
    out_of_range: OutOfRange | None = None  # to a setting that it understands and cannot do

    def __post_init__(self) -> None:
        for text in self.texts():
            if not text.isascii():
                raise ValueError(f"refusals are ASCII text, {text!r} is not")
            compile_template(text)

    def texts(self) -> tuple[str, ...]:
        """Return the texts by which the device refuses."""
        texts = (self.unknown, self.out_of_range.text if self.out_of_range else "")
        return tuple(text for text in texts if text)


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceReading:
    """One reading of a load cell: streamed, or the answer to `ask`.

    frame: template with the number {force:...}, perhaps a word {status:...} and a word {unit:...}. Where the frame says its
    unit, that unit counts; `unit` is what the simulated device is set to, and what a frame without one means. Raw counts
    of a converter have no unit but newton_per_count and zero_count, which a rig has measured. before: a sentence that is
    sent ahead of each question and not answered. modbus: registers, in place of frame and ask. overload, underload: what
    the device says in place of the frame where it has no number to show; nothing in them changes but the profile's constants.
    """

    __pydantic_config__ = STRICT
    frame: str = ""  # template of the reading, with the number {force:...}
    ask: str = ""  # empty for a stream
    before: str = ""  # sent ahead of ask, unanswered: such as the command to all devices to sample
    modbus: WeightRegisters | None = None  # of a Modbus device, instead of frame and ask
    unit: ForceUnit | None = None  # absent: the frame says it, or the rig must
    newton_per_count: Annotated[float, Gt(0)] | None = None  # of raw counts: one count in newtons, usually the rig's
    zero_count: float = 0.0  # of raw counts: reading without a force
    end_count: Annotated[float, Gt(0)] | None = None  # of raw counts: where the converter ends; counts as an overload
    quality: Mapping[str, Quality] = field(
        default_factory=dict
    )  # word of {status:...} -> how far to believe the reading
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
        if self.before and not self.ask:
            raise ValueError("`before` is sent ahead of a question: there is no `ask`")
        if self.unit and self.newton_per_count:
            raise ValueError(f"unit {self.unit} and newton_per_count are two units for one number: leave one out")
        if self.modbus and self.beyond_range:
            raise ValueError(
                "`overload` and `underload` are sentences: beside `modbus` say the bits in `modbus.overload`"
            )
        for text in (*filter(None, (self.ask, self.before)), *self.overload, *self.underload):
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
        return number.decimals if isinstance(number, Decimals) else 0

    @property
    def step(self) -> float:
        """One count of the display, in the device's unit."""
        return float(10.0**-self.decimals)

    @property
    def largest_shown(self) -> float:
        """The largest number that the display has digits for, with room for a sign, in the device's unit."""
        if self.end_count:
            return self.end_count
        if self.modbus:
            return self.modbus.largest_shown
        number = self.template.field(FORCE)
        if isinstance(number, HexNumber):
            return float(16**number.width - 1)
        width = number.width if isinstance(number, Decimals | WholeNumber) else 0
        if not width:
            return 999999.0
        digits = width - 1 - (self.decimals + 1 if self.decimals else 0)
        return max(0.0, float(10.0**digits) - self.step)

    def word(self, quality: Quality) -> str | None:
        """Return the status word that means this, None where the frame has none; a device may know unstable readings only."""
        qualities = (quality, Quality.UNSTABLE) if quality is Quality.OK else (quality,)
        return next((word for one in qualities for word, meaning in self.quality.items() if meaning == one), None)


def _check_reading(template: Template, reading: ForceReading) -> None:
    number = template.field(FORCE)
    if not isinstance(number, Decimals | WholeNumber | HexNumber | RegisterNumber):
        raise TemplateError(f"{quote(template.text)} has no number {{force:...}}")
    if reading.blank_is_overload and (number.is_open or not isinstance(number, Decimals)):
        raise TemplateError(f"{quote(template.text)}: blank_is_overload needs decimals of fixed width")
    unit = template.field(UNIT)
    if unit and not (isinstance(unit, Choice) and set(unit.words) <= set(NEWTON_PER_UNIT)):
        raise TemplateError(
            f"{quote(template.text)}: units are {', '.join(NEWTON_PER_UNIT)}; another is text, with `unit`"
        )
    if isinstance(unit, Choice) and reading.unit and reading.unit not in unit.words:
        raise TemplateError(f"{quote(template.text)} never says {reading.unit}: unit is one of {', '.join(unit.words)}")
    status = template.field(STATUS)
    words = set(status.words if isinstance(status, Choice) else ())
    if odd := sorted(words ^ set(reading.quality)):
        told = ", ".join(f"{word!r} is {'not named' if word in words else 'no word of it'}" for word in odd)
        raise TemplateError(f"{quote(template.text)}: quality names the words of {{status:...}}: {told}")
    if reading.quality and set(reading.quality.values()) <= {Quality.OVERLOAD, Quality.REPEATED}:
        raise TemplateError(f"{quote(template.text)}: quality has no word for a good reading (ok, unstable)")
