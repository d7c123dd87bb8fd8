"""What a profile says about one exchange with a device: question, answer, and how its number maps to a physical value.

Checked when built: a template that means nothing is told to its author, not to a running cell.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, floor
from typing import Annotated, Final

from annotated_types import MinLen

from gateway.defaults import STRICT
from gateway.devices.binary.register_access import RegisterAccess, check_direction, templates_of
from gateway.devices.fields import TemplateError
from gateway.devices.template import compile_template, quote

Span = tuple[float, float]
_GRAIN: Final = 1e-6  # of a step: what binary fractions are off


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

    def carries(self, number: float, slack: float) -> bool:
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


@lru_cache  # asked for at each exchange, of the few ranges of a rig's devices
def _scale(device: Span, physical: Span) -> Scale:
    if device[0] >= device[1] or physical[0] >= physical[1]:
        sides = " and ".join(f"{low:g} .. {high:g}" for low, high in (device, physical))
        raise ValueError(f"{sides} must rise on both sides: the lower end comes first, and the ends differ")
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
        return _scale(self.device, self.voltage_v)


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
        return _scale(self.device, self.pressure_pa)


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
    others: tuple[Annotated[str, MinLen(1)], ...] = ()  # further sentences: busy, operated by hand, checksum wrong

    def __post_init__(self) -> None:
        for text in self.texts():
            if not text.isascii():
                raise ValueError(f"refusals are ASCII text, {text!r} is not")
            compile_template(text)

    def texts(self) -> tuple[str, ...]:
        """Return the texts by which the device refuses."""
        texts = (self.unknown, self.out_of_range.text if self.out_of_range else "", *self.others)
        return tuple(text for text in texts if text)
