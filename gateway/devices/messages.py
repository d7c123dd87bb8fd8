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


class DeviceStep(StrEnum):
    """Question to an output device that is no part of its work."""

    IDENTITY = "identity"
    STATUS = "watchdog status"
    VERIFY = "watchdog verification"
    SET_TIME = "watchdog time"
    ARM = "watchdog arming"
    DISARM = "watchdog disarming"
    CLEAR = "watchdog clearing"


@dataclass(frozen=True, slots=True)
class AskDevice:
    """Host -> output device: what are you, and does your watchdog watch?"""

    step: DeviceStep


@dataclass(frozen=True, slots=True)
class DeviceAnswer:
    """Output device -> host: is_right tells whether the answer is the wanted one; text is what the device said: its model,
    or the state of its watchdog."""

    step: DeviceStep
    is_right: bool
    text: str = ""


@dataclass(frozen=True, slots=True)
class WatchdogTripped:
    """Output device -> host: its watchdog has tripped, it stands at its own safe value and obeys no setting."""


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
    REPEATED = "repeated"  # the device says that it has measured nothing since its last answer: no sample


@dataclass(frozen=True, slots=True)
class ForceSample:
    """One reading of the load cell.

    raw: in the device's own unit; force_n: converted to N with the sign of the wiring, before tare. Where an overload carries
    no digits both are nan, or inf of the side that the device has told. time_s: monotonic arrival time of the last byte.
    """

    raw: float
    force_n: float
    quality: Quality
    time_s: float


@dataclass(frozen=True, slots=True)
class RepeatedSample:
    """Load cell -> host: an answer that repeats the reading before: the device has measured nothing since."""


OutputRequest = SetVoltage | ReadPressure | ReadVoltage | AskDevice
OutputReply = Accepted | Pressure | Refused | Garbage | DeviceAnswer | WatchdogTripped
