"""What a device may be asked by somebody who does not know yet what it is: nothing that could move anything.

Of an output: what it is, its setting, its pressure. Of a load cell: a reading. Of a valve: how it stands. Never a setting, an
arming or a clearing; a device whose profile has no such question is not asked at all. A stream is only listened to. Pure.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from gateway.devices import DeviceProfile, DeviceRole, ValveDirection, ValveHost, cell_host, output_host
from gateway.devices.exchange import UNIT
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    DeviceStep,
    ForceSample,
    OutputRequest,
    Pressure,
    ReadPressure,
    ReadVoltage,
    RepeatedSample,
)

_MEANS_SOMETHING: Final = (Accepted, Pressure, ForceSample, RepeatedSample)


@dataclass(frozen=True, slots=True)
class HarmlessQuestion:
    """data: bytes to send, empty for a stream; understands: whether the bytes that came since are the right answer, and what
    it says, empty where they are not."""

    data: bytes
    understands: Callable[[bytes], str]


def harmless_questions(profile: DeviceProfile) -> Iterator[HarmlessQuestion]:
    """Yield what this device may be asked, what tells most first."""
    if profile.role is DeviceRole.OUTPUT:
        yield from _of_output(profile)
    elif profile.role is DeviceRole.LOAD_CELL:
        yield _of_cell(profile)
    else:
        yield _of_valve(profile)


def _of_output(profile: DeviceProfile) -> Iterator[HarmlessQuestion]:
    questions: list[OutputRequest] = [AskDevice(DeviceStep.IDENTITY)] if profile.own_identity else []
    questions += [ReadVoltage()] if profile.read_voltage else []
    questions += [ReadPressure()] if profile.read_pressure else []
    for question in questions:
        yield HarmlessQuestion(output_host(profile).request(question), _understand_output(profile, question))


def _understand_output(profile: DeviceProfile, question: OutputRequest) -> Callable[[bytes], str]:
    def understands(received: bytes) -> str:
        host = output_host(profile)
        host.request(question)
        return _first_words(host.receive(received, 0.0))

    return understands


def _of_valve(profile: DeviceProfile) -> HarmlessQuestion:
    def understands(received: bytes) -> str:
        host = ValveHost(profile)
        host.request(None)
        return next((f"stands at {one.value}" for one in host.receive(received) if isinstance(one, ValveDirection)), "")

    return HarmlessQuestion(ValveHost(profile).request(None), understands)


def _of_cell(profile: DeviceProfile) -> HarmlessQuestion:
    unit = None if profile.reading.newton_per_unit or profile.reading.template.field(UNIT) else "N"

    def understands(received: bytes) -> str:
        return _first_words(cell_host(profile, unit=unit).receive(received, 0.0))

    return HarmlessQuestion(cell_host(profile, unit=unit).poll(), understands)


def _first_words(messages: Sequence[object]) -> str:
    return next((_words(one) for one in messages if _is_right(one)), "")


def _is_right(message: object) -> bool:
    return message.is_right if isinstance(message, DeviceAnswer) else isinstance(message, _MEANS_SOMETHING)


def _words(message: object) -> str:
    match message:
        case DeviceAnswer(_, _, text):
            return f"it says that it is {text}"
        case Accepted(voltage_v):
            return f"set to {voltage_v:.3f} V"
        case Pressure(pressure_pa):
            return f"{pressure_pa / 1e3:.1f} kPa"
        case ForceSample(raw):
            return f"reads {raw:g}"
        case _:
            return "a reading"


def count_readings(profile: DeviceProfile, received: bytes) -> int:
    """Return how many readings of a stream these bytes hold; 0 where more of it makes no sense than makes some."""
    unit = None if profile.reading.newton_per_unit or profile.reading.template.field(UNIT) else "N"
    messages = cell_host(profile, unit=unit).receive(received, 0.0)
    count = sum(isinstance(one, ForceSample) for one in messages)
    return count if 2 * count > len(messages) else 0
