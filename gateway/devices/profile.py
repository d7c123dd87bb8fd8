"""A device profile: how one serial device speaks, as data. gateway.profiles builds it from YAML with these annotations.

One of three roles: an output (DAC or regulator), a load cell (amplifier) or a valve (relay). Everything the device says is a
template, or a register of a Modbus device; what neither can say is done by a Python codec, named by `codec`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import nan
from typing import Annotated, Final, Literal

from annotated_types import Ge, Gt, MaxLen, MinLen

from gateway.defaults import STRICT
from gateway.devices.binary.raw_bytes import byte_count
from gateway.devices.binary.register_access import VALUE, check_direction
from gateway.devices.checksum import ChecksumName
from gateway.devices.device_checks.identity import Identity
from gateway.devices.device_checks.watchdog import Watchdog
from gateway.devices.exchange import Exchange, PressureExchange, Refusals, Span, Step, VoltageExchange
from gateway.devices.fields import NUMBERS, Choice, Decimals, Field, Plain, RegisterNumber, Scientific, TemplateError
from gateway.devices.fields.field import ProfileMisfit
from gateway.devices.force_reading import ForceReading
from gateway.devices.line_settings import SerialSettings
from gateway.devices.template import compile_template, quote
from gateway.devices.valve_profile import ValveReading, ValveSettings

MODBUS_RTU: Final = "modbus-rtu"
RAW_BYTES: Final = "raw-bytes"
TEMPLATE: Final = "template"
ADDRESS: Final = "address"
"""Name of the constant that tells devices on one bus apart: of a Modbus device its unit."""

_NO_TCP: Final = "Modbus TCP is not spoken to devices, which are on serial lines"
_LONGEST_MODBUS_S: Final = 0.1  # later than this a Modbus answer is no use to a force loop
_LARGEST_UNIT: Final = 255  # 247 by the specification; some devices take all that fit into a byte
Terminator = Annotated[str, MaxLen(8)]


class Certainty(StrEnum):
    """Source of the grammar; none of it replaces a run on the device."""

    MANUAL = "manual"  # read in a maker's manual
    PUBLIC_DRIVER = "public driver"  # read in drivers that others have published
    COMPOSED = "composed"  # put together from fragments


class DeviceRole(StrEnum):
    """Purpose of a device."""

    OUTPUT = "output"
    LOAD_CELL = "load cell"
    VALVE = "valve"


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceProfile:
    """Language of one serial device. `watchdog: none` and `identity: none` are facts that the service must know."""

    __pydantic_config__ = STRICT
    name: Annotated[str, MinLen(1)]  # the file's name without .yaml
    description: str  # one line for people
    role: DeviceRole  # output: a DAC or regulator; load cell: an amplifier; valve: a relay that switches push and pull
    source: Annotated[str, MinLen(1)]  # where the grammar was taken from: manual and page, driver
    certainty: Certainty  # how good that source is
    hardware: Annotated[str, MinLen(1)]  # "never run on hardware", or who ran it on what, and when
    codec: str = TEMPLATE  # template, modbus-rtu, or the name of a Python codec in gateway/devices/codecs.py
    serial: SerialSettings  # the line as the device comes; a rig may set another baud
    terminator: Terminator = ""  # end of every line, both ways; a Modbus device has none
    question_terminator: Terminator | None = (
        None  # end of what the gateway says, where another; "": none, of a load cell
    )
    checksum: ChecksumName = "none"  # appended before the terminator
    constants: Mapping[str, int | str] = field(
        default_factory=dict
    )  # fields with one fixed value, such as an address; a rig may say another address and channel
    channels: Annotated[int, Ge(1)] | None = (
        None  # outputs that a rig's `channel` chooses from, counted from 0; on Modbus their registers follow; null: unknown
    )
    reply_timeout_s: Annotated[float, Gt(0)] = 0.1  # an answer later than this is overdue
    watchdog: Literal["none"] | Watchdog = "none"  # none: the device holds its last output when nobody talks to it
    identity: Literal["none"] | Identity = "none"  # none: the device cannot be asked what it is
    refusals: Refusals = field(default_factory=Refusals)  # the device's words for no
    set_voltage: VoltageExchange | None = None  # output: drive this voltage; without an answer, read_voltage is needed
    read_voltage: VoltageExchange | None = None  # output: what is the present setting? may be absent
    read_pressure: PressureExchange | None = None  # output: what pressure is measured? may be absent
    steps: tuple[Step, ...] = ()  # output: commands that the gateway never sends but the device knows
    stream: ForceReading | None = None  # load cell that talks by itself
    read_force: ForceReading | None = None  # load cell that is asked
    read_over: tuple[
        str, ...
    ] = ()  # sentences that it says besides: another sensor's, its program's; "": a line with nothing in it
    set_valve: ValveSettings | None = None  # valve: how each direction is set
    read_valve: ValveReading | None = None  # valve: which direction stands?

    def __post_init__(self) -> None:
        _check_codec(self)
        for text in filter(None, self.read_over):
            compile_template(text)
        if self.role is DeviceRole.VALVE:
            _check_valve(self)
        elif self.set_valve or self.read_valve:
            raise ProfileMisfit(("set_valve", "read_valve"), "set_valve and read_valve belong to a valve")
        elif self.role is DeviceRole.OUTPUT:
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
        """The bytes that end a line of the device."""
        return self.terminator.encode("ascii")

    @property
    def question_terminator_bytes(self) -> bytes:
        """The bytes that end a line to the device; none of a load cell that is asked with bare characters."""
        return (self.terminator if self.question_terminator is None else self.question_terminator).encode("ascii")

    @property
    def is_modbus(self) -> bool:
        """Decide whether the device speaks Modbus RTU."""
        return self.codec == MODBUS_RTU

    @property
    def is_raw(self) -> bool:
        """Decide whether the device, a valve, speaks in raw bytes."""
        return self.codec == RAW_BYTES

    @property
    def question_bytes(self) -> int:
        """The bytes of a question to a device that speaks in raw bytes: all have the same."""
        return byte_count(self.read_valve.ask) if self.read_valve else 0

    @property
    def unit_id(self) -> int:
        """Unit of a Modbus device: its address, 1 where the profile says none."""
        return int(self.constants.get(ADDRESS, 1))

    @property
    def own_watchdog(self) -> Watchdog | None:
        """The device's watchdog, None where it has none."""
        return None if isinstance(self.watchdog, str) else self.watchdog

    @property
    def own_identity(self) -> Identity | None:
        """Question for what the device is, None where it cannot be asked."""
        return None if isinstance(self.identity, str) else self.identity

    def number_in(self, template_text: str) -> Field | None:
        """Return the field that carries the number: the only one that is neither a constant nor a word, or {value:...}."""
        fields = compile_template(template_text).fields
        numbers = [one for one in fields if one.name not in self.constants and not isinstance(one, Choice)]
        numbers = [one for one in numbers if one.name == VALUE] or numbers
        if len(numbers) > 1 or any(not isinstance(one, NUMBERS) for one in numbers):
            raise TemplateError(
                f"{quote(template_text)} must carry one number beside constants and words; of several, call one {{value:...}}",
                written=template_text,
            )
        return numbers[0] if numbers else None

    def decimals_in(self, template_text: str) -> int:
        """Return the decimals of the number that a template carries; 0 for a whole number, or none."""
        number = self.number_in(template_text)
        if isinstance(number, Scientific):
            exchanges: tuple[Exchange | None, ...] = (self.set_voltage, self.read_voltage, self.read_pressure)
            spoken = [each.range.device for each in exchanges if each and template_text in (each.ask, each.answer)]
            return number.decimals_below(max((abs(end) for span in spoken for end in span), default=1.0))
        return number.decimals if isinstance(number, Decimals | Plain | RegisterNumber) else 0

    @property
    def reading(self) -> ForceReading:
        """The way in which a load cell reports its force; ValueError for an output."""
        reading = self.stream or self.read_force
        if reading is None:
            raise ValueError(f"{self.name} is not a load cell")
        return reading


def _check_codec(profile: DeviceProfile) -> None:
    """The codec and what the profile says in its language: templates with a line's end, or registers."""
    exchanges = (profile.set_voltage, profile.read_voltage, profile.read_pressure, profile.read_force, profile.stream)
    for name, exchange in zip(_EXCHANGES, exchanges, strict=True):
        if exchange and profile.is_modbus is (exchange.modbus is None):
            cure = _NO_TCP if "tcp" in profile.codec.lower() else f"say `codec: {MODBUS_RTU}`"
            wanted = "needs `modbus` with its registers" if profile.is_modbus else f"has `modbus`: {cure}"
            raise ProfileMisfit((name,), f"{name} of codec {profile.codec} {wanted}")
    if not (profile.is_modbus or profile.is_raw):
        if not profile.terminator:
            raise ProfileMisfit(("terminator", *_EXCHANGES), 'terminator is missing: a line\'s end such as "\\r\\n"')
        if not f"{profile.terminator}{profile.question_terminator or ''}".isascii():
            raise ProfileMisfit(("terminator",), "terminator and question_terminator are ASCII text")
        return
    if profile.terminator or profile.question_terminator or profile.checksum != "none" or profile.read_over:
        sentence = "a frame of Modbus RTU or of raw bytes has its own end: leave terminator, checksum and read_over out"
        raise ProfileMisfit(("terminator", "question_terminator", "checksum", "read_over"), sentence)
    if profile.is_raw:
        return
    if profile.reply_timeout_s > _LONGEST_MODBUS_S:
        most = f"reply_timeout_s of a Modbus device is at most {_LONGEST_MODBUS_S} s: the force loop waits for it"
        raise ProfileMisfit(("reply_timeout_s",), most)
    address = str(profile.constants.get(ADDRESS, 1))
    if not (address.isdecimal() and 1 <= int(address) <= _LARGEST_UNIT):
        raise ProfileMisfit(("constants",), f"address {address}: a Modbus unit is 1 to {_LARGEST_UNIT}")


_EXCHANGES: Final = ("set_voltage", "read_voltage", "read_pressure", "read_force", "stream")
_OF_OUTPUT: Final = (*_EXCHANGES[:3], "steps")


def _check_output(profile: DeviceProfile) -> None:
    if profile.set_voltage is None:
        raise ValueError("an output needs set_voltage")
    check_direction(profile.set_voltage.modbus, reads=False)
    check_direction(profile.read_voltage.modbus if profile.read_voltage else None, reads=True)
    if profile.stream or profile.read_force:
        raise ProfileMisfit(("stream", "read_force"), "stream and read_force belong to a load cell")
    _check_setting(profile, profile.set_voltage.ask)
    if profile.set_voltage.answer:
        profile.number_in(profile.set_voltage.answer)
    elif profile.read_voltage is None:
        raise ValueError(
            "set_voltage has no answer and there is no read_voltage: nothing would tell a device that is silent, refuses or "
            "alters a setting; say its acknowledgement in answer, or how to read the setting back"
        )
    _check_echo(profile, profile.set_voltage)
    for exchange in (profile.read_voltage, profile.read_pressure):
        if exchange and profile.number_in(exchange.ask) is not None:
            raise TemplateError(f"{quote(exchange.ask)} asks for a number and must not carry one but under `constants`")
        if exchange and (not exchange.answer or profile.number_in(exchange.answer) is None):
            raise TemplateError(f"{quote(exchange.answer)} carries no number", written=exchange.answer)


def _check_setting(profile: DeviceProfile, ask: str) -> None:
    """A setting carries one number; whatever else changes in it is known beforehand."""
    number = profile.number_in(ask)
    if number is None:
        raise TemplateError(f"{quote(ask)} carries no number", written=ask)
    for one in compile_template(ask).fields:
        if one != number and one.name not in profile.constants and not isinstance(one, Choice):
            raise TemplateError(
                f"{quote(ask)}: {{{one.name}:...}} would go out as nothing: say it under `constants`", written=ask
            )


def _check_echo(profile: DeviceProfile, setting: VoltageExchange) -> None:
    """An adapter that hears itself brings our own words back, whether or not there is a device."""
    is_echo = setting.ask == setting.answer and profile.question_terminator_bytes == profile.terminator_bytes
    if is_echo and not (profile.read_voltage or profile.read_pressure):
        raise ValueError(
            "set_voltage is answered by its own words and nothing is read: an adapter that echoes would answer for a device "
            "that is off; say read_voltage or read_pressure"
        )


def _check_valve(profile: DeviceProfile) -> None:
    if profile.set_valve is None or profile.read_valve is None:
        raise ValueError("a valve needs set_valve and read_valve: a direction that nobody reads back is not known")
    if profile.codec not in (TEMPLATE, MODBUS_RTU, RAW_BYTES):
        raise ValueError(f"codec {profile.codec} of a valve is not one of {TEMPLATE}, {MODBUS_RTU}, {RAW_BYTES}")
    if profile.is_raw:
        push, pull, reading = profile.set_valve.push, profile.set_valve.pull, profile.read_valve
        for answer in filter(None, (push.answer, pull.answer, reading.answer)):
            byte_count(answer)
        if len({byte_count(one.ask) for one in (push, pull, reading)}) > 1:
            raise ValueError(
                "the sentences to a device that speaks in raw bytes have one length: it tells them by that"
            )
    if any(getattr(profile, name) for name in _EXCHANGES) or profile.steps:
        raise ValueError("set_voltage, read_voltage, read_pressure, read_force, stream and steps belong to other roles")
    if profile.watchdog != "none":
        raise ProfileMisfit(("watchdog",), "watchdog belongs to an output")
    if profile.read_over:
        raise ProfileMisfit(("read_over",), "read_over belongs to an output or a load cell")
    _check_unasked(profile, "a valve")


def _check_unasked(profile: DeviceProfile, what: str) -> None:
    """Whoever wrote a question believes that it is asked."""
    if profile.identity != "none":
        cure = "leave identity out, for nobody would see another device"
        raise ProfileMisfit(("identity",), f"{what} is never asked what it is: {cure}")


def _check_load_cell(profile: DeviceProfile) -> None:
    if (profile.stream is None) == (profile.read_force is None):
        raise ProfileMisfit(("stream",), "a load cell has either stream or read_force")
    if profile.set_voltage or profile.read_voltage or profile.read_pressure or profile.steps:
        raise ProfileMisfit(_OF_OUTPUT, f"{', '.join(_OF_OUTPUT[:-1])} and {_OF_OUTPUT[-1]} belong to an output")
    if profile.watchdog != "none":
        raise ProfileMisfit(("watchdog",), "watchdog belongs to an output: a load cell drives nothing")
    if profile.stream and profile.stream.ask:
        raise ProfileMisfit(("stream",), "a stream is not asked: leave `ask` out, or say read_force in place of stream")
    if profile.stream and profile.stream.rate_hz <= 0:
        raise ProfileMisfit(("stream",), "rate_hz of stream is missing: how many readings a second it sends")
    if profile.stream:
        _check_unasked(profile, "a load cell that streams")
    if profile.read_force and not profile.read_force.ask:
        raise ProfileMisfit(("read_force",), "read_force needs an ask")
    for text, _ in profile.reading.beyond_range:
        free = (one for one in compile_template(text).fields if one.name not in profile.constants)
        if not all(isinstance(one, Choice) for one in free):
            why = "carries no number and no text: nothing changes in it but words and constants"
            raise TemplateError(f"{quote(text)} of overload or underload {why}", written=text)
