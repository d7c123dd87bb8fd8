"""What is said on a serial line, apart from how it is spelled: requests down, replies and samples up."""

from dataclasses import dataclass
from enum import StrEnum


@dataclass(frozen=True, slots=True)
class SetVoltage:
    """Host -> output device: drive this voltage, V (the regulator's input scale)."""

    voltage_v: float


@dataclass(frozen=True, slots=True)
class ReadPressure:
    """Host -> output device: what pressure do you measure?"""


@dataclass(frozen=True, slots=True)
class ReadVoltage:
    """Host -> output device: what is your present setting?"""


@dataclass(frozen=True, slots=True)
class Accepted:
    """Output device -> host: this voltage stands, V, in the device's own resolution."""

    voltage_v: float


@dataclass(frozen=True, slots=True)
class Pressure:
    """Output device -> host: measured pressure, Pa (gauge)."""

    pressure_pa: float


@dataclass(frozen=True, slots=True)
class Refused:
    """Output device -> host: the request was understood or not, but not done; `text` is the device's own word."""

    text: str


@dataclass(frozen=True, slots=True)
class Garbage:
    """Bytes that mean nothing in this device's grammar: dropped and counted."""

    data: bytes


class Quality(StrEnum):
    """Quality of a force reading: how far it can be believed."""

    OK = "ok"
    UNSTABLE = "unstable"  # the device's own motion flag; normal under moving force
    OVERLOAD = "overload"  # beyond the cell's or the converter's range: counts as over-force


@dataclass(frozen=True, slots=True)
class ForceSample:
    """One reading of the load cell.

    raw: in the device's own unit; force_n: converted to N with the sign of the wiring, before tare; nan when overload
    carries no digits. time_s: monotonic arrival time of the last byte.
    """

    raw: float
    force_n: float
    quality: Quality
    time_s: float


OutputRequest = SetVoltage | ReadPressure | ReadVoltage
OutputReply = Accepted | Pressure | Refused | Garbage
