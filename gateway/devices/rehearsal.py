"""Both ends of a profile's wire talk once: what could never work is told to its author, not to a running cell.

The types of a profile say that each template means something. Whether the templates fit each other, nothing but a try can
say: a number that outgrows its width at the end of its range, two questions that read alike, an answer that looks like a
refusal, a display without room for a minus sign.
"""

from collections.abc import Iterable, Iterator
from math import inf
from typing import Final

from gateway.devices.codecs import cell_device, cell_host, output_device, output_host
from gateway.devices.device_checks.ranges import unfit_ranges
from gateway.devices.device_checks.sentences import Found, misspelt
from gateway.devices.fields import Choice, HexNumber, Text, ValueRefused
from gateway.devices.force_reading import FORCE, STATUS, UNIT, ForceReading
from gateway.devices.framing import LONGEST_LINE_BYTES
from gateway.devices.grammar import Grammar
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    DeviceStep,
    ForceSample,
    Garbage,
    OutputReply,
    OutputRequest,
    Pressure,
    Quality,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
)
from gateway.devices.profile import DeviceProfile, DeviceRole
from gateway.devices.roles import CellDevice, CellHost
from gateway.devices.template import compile_template, quote
from gateway.devices.valve import ValveDevice, ValveHost
from gateway.devices.valve_profile import ValveDirection

_NOW_S: Final = 0.0
_NO_ROUND_PART: Final = 0.7361  # of the range: an answer with fewer digits than the setting shows it here
_LONGEST_SHOWN: Final = 60  # of a line, in a sentence


def rehearse(profile: DeviceProfile) -> Found:
    """Return what keeps the two ends of this profile from understanding each other; nothing when they do."""
    if wrong := [*misspelt(profile)]:
        yield from wrong
        return
    talk = {DeviceRole.OUTPUT: _output, DeviceRole.LOAD_CELL: _cell, DeviceRole.VALVE: _valve}
    yield from talk[profile.role](profile)


def _valve(profile: DeviceProfile) -> Found:
    host, device, settings = ValveHost(profile), ValveDevice(profile), profile.set_valve
    assert settings  # a valve's profile was checked for it
    for direction in ValveDirection:
        for place, question in (("set_valve", direction), ("read_valve", None)):
            asked = [question] if question is None or settings.of(question).answer else [question, None]
            try:
                is_known = device.receive(host.request(question)) == asked
                is_understood = host.receive(b"".join(device.reply(one, direction) for one in asked)) == [direction]
            except ValueRefused as error:
                yield (place,), str(error)
                return
            if not is_known:
                yield (place,), f"{direction}: the device's end takes our question for another"
            elif not is_understood:
                yield (place,), f"{direction}: our end does not understand the answer"


def _output(profile: DeviceProfile) -> Found:
    low_v, high_v = profile.voltage_range_v
    for voltage_v in (low_v, 0.5 * (low_v + high_v), low_v + _NO_ROUND_PART * (high_v - low_v), high_v):
        if complaint := _talk(profile, SetVoltage(voltage_v), Accepted(voltage_v)):
            yield ("set_voltage",), f"{voltage_v:g} V: {complaint}"
            return
    yield from unfit_ranges(profile)
    for place, question, answers in _readings(profile):
        complaint = next(filter(None, (_talk(profile, question, answer) for answer in answers)), "")
        if complaint:
            yield (place,), complaint
    yield from _refusals(profile)
    yield from _checks(profile)


def _readings(profile: DeviceProfile) -> Iterator[tuple[str, OutputRequest, tuple[OutputReply, ...]]]:
    """The questions that the device can be asked, and answers at both ends of their ranges."""
    if profile.read_voltage:
        yield "read_voltage", ReadVoltage(), tuple(map(Accepted, profile.read_voltage.range.voltage_v))
    if profile.read_pressure:
        yield "read_pressure", ReadPressure(), tuple(map(Pressure, profile.read_pressure.range.pressure_pa))


def _checks(profile: DeviceProfile) -> Found:
    """Identity and watchdog: each question must be known at the far end, and its answer here."""
    for step in output_host(profile).checks:
        place = "identity" if step is DeviceStep.IDENTITY else "watchdog"
        if complaint := _talk(profile, AskDevice(step), DeviceAnswer(step, is_right=True)):
            yield (place,), f"{step}: {complaint}"
            return


def _talk(profile: DeviceProfile, request: OutputRequest, answer: OutputReply) -> str:
    """Ask, obey, answer, understand; why that fails, or nothing."""
    host, device = output_host(profile), output_device(profile)
    try:
        frame = host.request(request)
        answered = b""
        for understood in device.receive(frame, _NOW_S):
            is_read_back = isinstance(request, SetVoltage) and isinstance(understood, ReadVoltage)
            if isinstance(understood, Garbage) or not (is_read_back or isinstance(understood, type(request))):
                return f"the device reads {_line(frame)} as {_name(understood)}{_too_long(frame)}"
            answered += device.reply(answer, to=understood)
    except (ValueRefused, UnicodeEncodeError) as error:
        return str(error)
    replies = host.receive(answered, _NOW_S)
    if len(replies) != 1 or not _means(replies[0], answer):
        names = _names(replies)
        return f"the answer {_line(answered)} to {_line(frame)} is read as {names}{_too_long(frame, answered)}"
    if (
        isinstance(request, SetVoltage)
        and isinstance(replies[0], Accepted)
        and not host.confirms(request.voltage_v, replies[0], request)
    ):
        return f"{_line(frame)} is confirmed as {replies[0].voltage_v:g} V by {_line(answered)}: the ranges do not fit"
    return ""


def _means(reply: OutputReply, meaning: OutputReply) -> bool:
    return type(reply) is type(meaning)


def _refusals(profile: DeviceProfile) -> Found:
    for template in profile.refusals.texts():
        host, text = output_host(profile), template
        try:
            text = Grammar(profile).words(template)
            host.request(SetVoltage(profile.voltage_range_v[0]))
            replies = host.receive(output_device(profile).reply(Refused(text)), _NOW_S)
        except (ValueRefused, UnicodeEncodeError) as error:
            replies, text = [], str(error)
        if replies != [Refused(text)]:
            yield (
                ("refusals",),
                f"{quote(text)} as an answer is read as {_names(replies)}",
            )


def _cell(profile: DeviceProfile) -> Found:
    reading, place = profile.reading, ("stream" if profile.stream else "read_force",)
    if told := _read_over(profile):
        yield (*place, "frame"), told
        return
    if _is_reading(profile, reading.before_answer):
        yield (*place, "before_answer"), f"{quote(reading.before_answer)} is a reading of {quote(reading.frame)}, too"
        return
    unit = None if reading.unit or reading.template.field(UNIT) else "N"
    host, device = cell_host(profile, unit=unit), cell_device(profile, unit)
    try:
        question = host.poll() or host.start
        if device.receive(question, _NOW_S) != bool(reading.ask):
            yield place, f"the device does not know its own question {_line(question)}{_too_long(question)}"
            return
        if complaints := list(_beyond_range(profile, unit, place)):
            yield from complaints
            return
        needs_minus = reading.newton_per_unit is not None or reading.template.field(
            UNIT
        )  # else the rig knows their zero
        counts = (0, 1, -1) if needs_minus else (0, 1)
        if complaint := next(filter(None, (_shown(host, device, reading, one) for one in counts)), ""):
            yield place, complaint
        elif reading.end is not None and not _tells_its_end(host, device):
            yield (*place, "end_count"), f"{reading.end_count:g} does not fit into {_shown_by(reading)}"
        elif profile.question_terminator == "" and _is_sample(echoed := question + device.frame(0.0), host):
            told = f"{_line(echoed)}, through an adapter that hears itself, is read as another number: give it a width"
            yield (*place, "frame"), told
    except (ValueRefused, UnicodeEncodeError) as error:
        yield place, str(error)


def _is_reading(profile: DeviceProfile, text: str) -> bool:
    grammar = Grammar(profile)
    return bool(text) and grammar.read(profile.reading.frame, grammar.encode(text)) is not None


def _shown(host: CellHost, device: CellDevice, reading: ForceReading, counts: int) -> str:
    """Return why so many counts are not read as they are shown, or nothing."""
    force_n = counts * host.resolution_n
    frame = device.frame(force_n)
    samples = host.receive(frame, _NOW_S)
    if len(samples) != 1 or not isinstance(sample := samples[0], ForceSample):
        names = _names(samples)
        return f"{force_n:.3g} N, shown as {_line(frame)}, is read as {names}{_too_long(frame)}"
    if sample.quality is Quality.OVERLOAD or abs(sample.force_n - force_n) > 0.6 * host.resolution_n:
        return f"{force_n:.3g} N cannot be shown by {_shown_by(reading)}: {_why_not(reading, counts)}"
    return ""


def _shown_by(reading: ForceReading) -> str:
    return f"a weight of type {reading.modbus.type}" if reading.modbus else quote(reading.frame)


def _why_not(reading: ForceReading, counts: int) -> str:
    if counts >= 0:
        return "it needs more digits"
    cure = ""
    if reading.modbus:
        cure = f": say {reading.modbus.type.removeprefix('u')}, or which bit is the sign in `negative`"
        if reading.newton_per_count:
            cure = f": say which count is 0 N in `zero_count`, else {reading.modbus.type.removeprefix('u')}"
    elif isinstance(number := reading.template.field(FORCE), HexNumber):
        cure = f": {{force:+0{number.width}{number.letter}}} is the two's complement"
    return f"there is no room for a minus sign, and noise needs it{cure}"


def _tells_its_end(host: CellHost, device: CellDevice) -> bool:
    try:
        samples = host.receive(device.frame(inf), _NOW_S)
    except ValueRefused:
        return False
    return [isinstance(one, ForceSample) and one.quality is Quality.OVERLOAD for one in samples] == [True]


def _is_sample(data: bytes, host: CellHost) -> bool:
    return any(isinstance(one, ForceSample) for one in host.receive(data, _NOW_S))


def _read_over(profile: DeviceProfile) -> str:
    """Return why words and single characters that nobody listens to may not be read over: one of them may be all that tells an
    overload. Longer text, a time or a number of the device, may."""
    reading = profile.reading
    if reading.modbus or reading.quality or reading.says_overload:
        return ""
    over = reading.read_over(profile.constants)
    unheard = [one for one in over if isinstance(one, Choice) or (isinstance(one, HexNumber | Text) and one.width == 1)]
    if not unheard:
        return ""
    return (
        f"{{{unheard[0].name}:...}} is read over, and nothing here tells an overload, which would be believed: give its words "
        f"as {{{STATUS}:...}} and say in quality what each means, say `overload`, or write as text what never changes"
    )


def _beyond_range(profile: DeviceProfile, unit: str | None, place: tuple[str, ...]) -> Found:
    """Each sentence that means an overload must mean nothing else."""
    grammar = Grammar(profile)
    for key, sign in (("overload", 1.0), ("underload", -1.0)):
        for index, text in enumerate(getattr(profile.reading, key)):
            for body in _spellings(grammar, text):
                if complaint := _other_meaning(grammar, text, body) or _misread(
                    cell_host(profile, unit=unit), grammar.line(body), sign * inf
                ):
                    yield (*place, key, index), complaint
                    break


def _spellings(grammar: Grammar, template: str) -> Iterator[bytes]:
    """Return the sentence with each of its words once."""
    fields = compile_template(template).fields
    yield grammar.encode(template)
    for one in fields:
        if isinstance(one, Choice) and one.name not in grammar.profile.constants:
            yield from (grammar.encode(template, {one.name: word}) for word in one.words[1:])


def _other_meaning(grammar: Grammar, text: str, body: bytes) -> str:
    """Return what a sentence of overload means besides, empty where it means nothing else."""
    reading = grammar.profile.reading
    if grammar.read(reading.frame, body, reading.may_be_blank):
        what_to_do = "leave it out where that means an overload already, else narrow the frame"
        return f"{_quote_as(text, body)} is an ordinary reading of {quote(reading.frame)}, too: {what_to_do}"
    others = [one for one, _ in reading.beyond_range if grammar.read(one, body) is not None]
    if len(others) > 1:
        return f"{_quote_as(text, body)} stands here twice: it can mean one side only, leave the other out"
    return ""


def _quote_as(template: str, body: bytes) -> str:
    """Return a template as a message shows it, and what it says here where that is something else."""
    said = body.decode("ascii")
    return quote(template) if said == template else f"{quote(template)}, as {quote(said)},"


def _misread(host: CellHost, line: bytes, force_n: float) -> str:
    """Return why this line is not the overload that it should be, empty where it is."""
    samples = host.receive(line, _NOW_S)
    if samples == [ForceSample(force_n, force_n, Quality.OVERLOAD, _NOW_S)]:
        return ""
    return f"{_line(line)} is read as {_names(samples)}{_too_long(line)}"


def _line(data: bytes) -> str:
    text = quote(data.decode("ascii", "replace"))
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}...'"


def _too_long(*lines: bytes) -> str:
    longest = max(map(len, lines))
    return f": a line has at most {LONGEST_LINE_BYTES} characters" if longest > LONGEST_LINE_BYTES else ""


def _names(messages: Iterable[object]) -> str:
    """Return what a line was read as; pieces that are all garbage are none the clearer for their number."""
    names = [_name(one) for one in messages]
    return names[0] if names and {*names} == {_name(Garbage(b""))} else " and ".join(names) or "nothing"


def _name(message: object) -> str:
    """`SetVoltage` as people say it."""
    return {
        "Garbage": "nothing that it knows",
        "SetVoltage": "a setting",
        "ReadVoltage": "the question of read_voltage",
        "ReadPressure": "the question of read_pressure",
        "Accepted": "a voltage",
        "Pressure": "a pressure",
        "Refused": "a refusal",
        "ForceSample": "a force",
        "AskDevice": "a question about the device",
        "DeviceAnswer": "an answer about the device",
        "WatchdogTripped": "a tripped watchdog",
        "RepeatedSample": "a reading that is no new one",
    }[type(message).__name__]
