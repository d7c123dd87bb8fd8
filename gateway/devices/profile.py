"""A device profile: how one serial device speaks, as data. gateway.profiles builds it from YAML with these annotations.

One of two roles: an output (DAC or regulator) or a load cell (amplifier). Everything the device says is a template; what
templates cannot say is done by a Python codec, named by `codec`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import nan
from typing import Annotated, Literal

from annotated_types import Gt, MinLen

from gateway.defaults import STRICT
from gateway.devices.checksum import ChecksumName
from gateway.devices.exchange import (
    ForceReading,
    PressureExchange,
    Refusals,
    Span,
    Step,
    VoltageExchange,
)
from gateway.devices.fields import Choice, Decimals, Field, TemplateError, WholeNumber
from gateway.devices.line_settings import SerialSettings
from gateway.devices.template import compile_template


class Certainty(StrEnum):
    """Source of the grammar; none of it replaces a run on the device."""

    MANUAL = "manual"  # read in a maker's manual
    PUBLIC_DRIVER = "public driver"  # read in drivers that others have published
    COMPOSED = "composed"  # put together from fragments


class Role(StrEnum):
    """Purpose of a device."""

    OUTPUT = "output"
    LOAD_CELL = "load cell"


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceProfile:
    """Language of one serial device. `watchdog: none` and `identity: none` are facts that the service must know."""

    __pydantic_config__ = STRICT
    name: Annotated[str, MinLen(1)]  # the file's name without .yaml
    description: str  # one line for people
    role: Role  # output: a DAC or regulator; load cell: an amplifier
    source: Annotated[str, MinLen(1)]  # where the grammar was taken from: manual and page, driver
    certainty: Certainty  # how good that source is
    hardware: Annotated[str, MinLen(1)]  # "never run on hardware", or who ran it on what, and when
    codec: str = "template"  # template, or the name of a Python codec in gateway/devices/codecs.py
    serial: SerialSettings  # the line as the device comes; a rig may set another baud
    terminator: Literal["\r\n", "\r", "\n"]  # end of every line, both ways
    checksum: ChecksumName = "none"  # appended before the terminator
    constants: Mapping[str, int | str] = field(default_factory=dict)  # fields with one fixed value, such as an address
    reply_timeout_s: Annotated[float, Gt(0)] = 0.1  # an answer later than this is overdue
    watchdog: Literal["none"] = "none"  # none: the device holds its last output when nobody talks to it
    identity: Literal["none"] = "none"  # none: the device cannot be asked what it is
    refusals: Refusals = field(default_factory=Refusals)  # the device's words for no
    set_voltage: VoltageExchange | None = None  # output: drive this voltage; without an answer, read_voltage is needed
    read_voltage: VoltageExchange | None = None  # output: what is the present setting? may be absent
    read_pressure: PressureExchange | None = None  # output: what pressure is measured? may be absent
    steps: tuple[Step, ...] = ()  # output: commands that the gateway never sends but the device knows
    stream: ForceReading | None = None  # load cell that talks by itself
    read_force: ForceReading | None = None  # load cell that is asked

    def __post_init__(self) -> None:
        if self.role is Role.OUTPUT:
            _check_output(self)
        else:
            _check_load_cell(self)

    @property
    def rate_hz(self) -> float:
        """Readings per second of a streaming load cell, 0 for anything else."""
        return self.stream.rate_hz if self.stream else 0.0

    @property
    def confirmation(self) -> VoltageExchange:
        """The exchange whose answer tells that a setting stands: its own, or the reading after it. ValueError: a load cell."""
        exchange = self.set_voltage if self.set_voltage and self.set_voltage.answer else self.read_voltage
        if exchange is None:
            raise ValueError(f"{self.name} is not an output")
        return exchange

    @property
    def voltage_range_v(self) -> Span:
        """Voltages that the output can be set to, V; (0, 0) for a load cell."""
        return self.set_voltage.range.voltage_v if self.set_voltage else (0.0, 0.0)

    @property
    def pressure_pa_per_v(self) -> float:
        """Pressure per volt of a regulator whose ranges of both have one end, as its profile says; nan without a pressure."""
        top_v = self.voltage_range_v[1]
        return self.read_pressure.range.pressure_pa[1] / top_v if self.read_pressure and top_v else nan

    @property
    def terminator_bytes(self) -> bytes:
        """The bytes that end a line."""
        return self.terminator.encode("ascii")

    def number_in(self, template_text: str) -> Field | None:
        """Return the field that carries the number: the only one that is neither a constant nor a word."""
        fields = compile_template(template_text).fields
        numbers = [one for one in fields if one.name not in self.constants and not isinstance(one, Choice)]
        if len(numbers) > 1 or any(not isinstance(one, WholeNumber | Decimals) for one in numbers):
            raise TemplateError(f"{template_text!r} must carry one number beside constants and words")
        return numbers[0] if numbers else None

    def decimals_in(self, template_text: str) -> int:
        """Return the decimals of the number that a template carries; 0 for a whole number, or none."""
        number = self.number_in(template_text)
        return number.decimals if isinstance(number, Decimals) else 0

    @property
    def reading(self) -> ForceReading:
        """The way in which a load cell reports its force; ValueError for an output."""
        reading = self.stream or self.read_force
        if reading is None:
            raise ValueError(f"{self.name} is not a load cell")
        return reading


def _check_output(profile: DeviceProfile) -> None:
    if profile.set_voltage is None:
        raise ValueError("an output needs set_voltage")
    if profile.stream or profile.read_force:
        raise ValueError("stream and read_force belong to a load cell")
    if profile.number_in(profile.set_voltage.ask) is None:
        raise TemplateError(f"{profile.set_voltage.ask!r} carries no number")
    if profile.set_voltage.answer:
        profile.number_in(profile.set_voltage.answer)
    elif profile.read_voltage is None:
        raise ValueError(
            "set_voltage has no answer and there is no read_voltage: nothing would tell a device that is silent, refuses or "
            "alters a setting; say its acknowledgement in answer, or how to read the setting back"
        )
    for exchange in (profile.read_voltage, profile.read_pressure):
        if exchange and profile.number_in(exchange.ask) is not None:
            raise TemplateError(f"{exchange.ask!r} asks for a number and must not carry one")
        if exchange and (not exchange.answer or profile.number_in(exchange.answer) is None):
            raise TemplateError(f"{exchange.answer!r} carries no number")


def _check_load_cell(profile: DeviceProfile) -> None:
    if (profile.stream is None) == (profile.read_force is None):
        raise ValueError("a load cell has either stream or read_force")
    if profile.set_voltage or profile.read_voltage or profile.read_pressure or profile.steps:
        raise ValueError("set_voltage, read_voltage, read_pressure and steps belong to an output")
    if profile.stream and (profile.stream.ask or profile.stream.rate_hz <= 0):
        raise ValueError("stream has a rate_hz and no ask")
    if profile.read_force and not profile.read_force.ask:
        raise ValueError("read_force needs an ask")
