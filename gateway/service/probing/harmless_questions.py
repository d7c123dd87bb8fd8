"""What a device may be asked by somebody who does not know yet what it is: nothing that could move anything.

Of an output: what it is, its setting, its pressure. Of a load cell: a reading. Of a valve: how it stands. Never a setting, an
arming or a clearing; a device whose profile has no such question is not asked at all. A stream is only listened to, and
begun where it does not begin by itself. Pure.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from gateway.devices import CellHost, DeviceProfile, DeviceRole, ValveDirection, ValveHost, cell_host, output_host
from gateway.devices.device_checks.spelling import CheckSpelling
from gateway.devices.force_reading import UNIT
from gateway.devices.grammar import Grammar
from gateway.devices.messages import (
    Accepted,
    DeviceAnswer,
    DeviceStep,
    ForceSample,
    OutputRequest,
    Pressure,
    Quality,
    ReadPressure,
    ReadVoltage,
    RepeatedSample,
)

_MEANS_SOMETHING: Final = (Accepted, Pressure, ForceSample, RepeatedSample)


def _nobody(received: bytes) -> str:
    return ""


@dataclass(frozen=True, slots=True)
class HarmlessQuestion:
    """data: bytes to send, empty for a stream; understands: whether the bytes that came since are the right answer, and what
    it says, empty where they are not. stranger: what the device calls itself where it is another one, else empty. is_enough:
    its answer alone tells the device; else the next question is asked as well."""

    data: bytes
    understands: Callable[[bytes], str]
    stranger: Callable[[bytes], str] = _nobody
    is_enough: bool = True


def harmless_questions(profile: DeviceProfile) -> Iterator[HarmlessQuestion]:
    """Yield what this device may be asked, what tells most first."""
    if profile.role is DeviceRole.OUTPUT:
        yield from _of_output(profile)
    elif profile.role is DeviceRole.LOAD_CELL:
        yield from _of_cell(profile)
    else:
        yield _of_valve(profile)


def _of_output(profile: DeviceProfile) -> Iterator[HarmlessQuestion]:
    if profile.own_identity:
        yield _who_it_is(profile, is_enough=True)
    questions: list[OutputRequest] = [ReadVoltage()] if profile.read_voltage else []
    questions += [ReadPressure()] if profile.read_pressure else []
    for question in questions:
        yield HarmlessQuestion(output_host(profile).request(question), _understand_output(profile, question))


def _who_it_is(profile: DeviceProfile, *, is_enough: bool) -> HarmlessQuestion:
    grammar = Grammar(profile)
    spelling = CheckSpelling(grammar)

    def answer(received: bytes) -> DeviceAnswer | None:
        lines = grammar.answers()
        grammar.expect_own_words(lines, data)
        answers = (spelling.answer(DeviceStep.IDENTITY, grammar.body(line, data)) for line in lines.feed(received))
        return next((one for one in answers if one), None)

    def understands(received: bytes) -> str:
        found = answer(received)
        return f"it says that it is {found.text}" if found and found.is_right else ""

    def stranger(received: bytes) -> str:
        found = answer(received)
        return found.text if found and not found.is_right else ""

    is_cell = profile.role is DeviceRole.LOAD_CELL
    data = spelling.ask_cell_identity() if is_cell else grammar.question_line(spelling.ask(DeviceStep.IDENTITY))
    return HarmlessQuestion(data, understands, stranger, is_enough)


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


def _of_cell(profile: DeviceProfile) -> Iterator[HarmlessQuestion]:
    if profile.own_identity and profile.read_force:
        yield _who_it_is(profile, is_enough=False)

    def understands(received: bytes) -> str:
        host = _cell_host(profile)
        host.poll()
        return _first_words(host.receive(received, 0.0), knows_unit=_knows_unit(profile))

    yield HarmlessQuestion(_cell_host(profile).poll(), understands)


def _cell_host(profile: DeviceProfile) -> CellHost:
    """Our end; where only a rig could say the unit, as if it were newtons. What it hears first of a stream may be cut."""
    host = cell_host(profile, unit=None if _knows_unit(profile) else "N")
    host.forget()
    return host


def _knows_unit(profile: DeviceProfile) -> bool:
    return bool(profile.reading.newton_per_unit or profile.reading.template.field(UNIT))


def _first_words(messages: Sequence[object], *, knows_unit: bool = False) -> str:
    return next((_words(one, knows_unit=knows_unit) for one in messages if isinstance(one, _MEANS_SOMETHING)), "")


def _words(message: object, *, knows_unit: bool) -> str:
    match message:
        case Accepted(voltage_v):
            return f"set to {voltage_v:.3f} V"
        case Pressure(pressure_pa):
            return f"{pressure_pa / 1e3:.1f} kPa"
        case ForceSample(quality=Quality.OVERLOAD):
            return "reads beyond its range"
        case ForceSample(raw, force_n):
            return f"reads {raw:g}" + (f", {force_n:.4g} N" if knows_unit else "")
        case _:
            return "a reading"


def start_of_stream(profile: DeviceProfile) -> bytes:
    """Return what begins the stream of a load cell; empty where nothing has to."""
    return _cell_host(profile).start if profile.stream else b""


def count_readings(profile: DeviceProfile, received: bytes) -> int:
    """Return how many readings of a stream these bytes hold; 0 where more of it makes no sense than makes some."""
    messages = _cell_host(profile).receive(received, 0.0)
    count = sum(isinstance(one, ForceSample) for one in messages)
    return count if 2 * count > len(messages) else 0


def refusal_among(profile: DeviceProfile, received: bytes) -> str:
    """Return the first sentence of these bytes by which this device says no; empty where there is none."""
    grammar = Grammar(profile)
    bodies = map(grammar.body, grammar.answers().feed(received))
    return next(filter(None, (grammar.refusal(body) for body in bodies if body)), "")
