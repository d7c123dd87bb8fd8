"""What `check --probe`, `ports --listen` and `init` ask of serial ports, and how they tell it."""

import asyncio
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Literal

from gateway.cli.errors import CliError
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from gateway.devices import DeviceProfile, SerialSettings
    from gateway.ports import PortError
    from gateway.profiles import CellLine, OutputLine, Rig
    from gateway.profiles.rigs.rig import ValveLine
    from gateway.service.probing.port_probe import PortReport, ProbeAnswer

    AnyLine = OutputLine | CellLine | ValveLine

HARMLESS: Final = (
    "asks only what changes nothing: readings, settings as they stand, what a device is; no voltage is written"
)
PATIENCE_S: Final = 0.5  # for a device that was named: a busy machine or a slow adapter is no wrong device
_SLOW_BAUDS: Final = (1200, 2400, 4800)  # as many scales are delivered: heard, but too slow to be asked for
_DATA_BITS: Final = 8  # with which a port is listened to
_OF_TEXT: Final = frozenset(b"\r\n\x02\x03") | frozenset(range(0x20, 0x7F))
_IN_A_PROFILE: Final = "a profile says so under serial"
_MOST: Final = 0.95  # of what is heard: a character may be torn
_LEAST_HZ: Final = 20.0  # what the pneumatics of a force loop need


def known_profiles(role: str) -> "list[DeviceProfile]":
    """Return the shipped device profiles of a role."""
    from gateway.profiles import list_shipped, load_device

    profiles = [load_device(name) for name in list_shipped("device")]
    return [one for one in profiles if one.role.value == role]


def probe_path(
    path: str, profiles: "list[DeviceProfile]", patience_s: float = 0.0, *, is_speed_known: bool = False
) -> "PortReport":
    """Ask one port what is behind it, at each usual speed or at those of the profiles alone. CliError with the port's own code
    where it does not open."""
    from gateway.ports import PortError
    from gateway.service.probing.port_probe import BAUDS, probe_port

    try:
        return asyncio.run(probe_port(path, profiles, () if is_speed_known else BAUDS, patience_s=patience_s))
    except PortError as error:
        raise port_failure(error) from None


def port_failure(error: "PortError") -> CliError:
    """Return a port's failure as a message of the command line."""
    return CliError(str(error), error.exit_code)


def probe_line(line: "AnyLine", others_of_rig: "Iterable[AnyLine]") -> "PortReport":
    """Ask the port of a rig's line: its own device at its own speed first, then at others, then the rig's other devices, whose
    ports may be exchanged, then every shipped profile of its role."""
    assert line.port
    report = probe_path(line.port, [_as_set(line)], PATIENCE_S)
    if report.answers:
        return report
    for other in others_of_rig:
        exchanged = probe_path(line.port, [_as_set(other)], PATIENCE_S, is_speed_known=True)
        if exchanged.answers:
            return exchanged
    others = [one for one in known_profiles(line.device.role.value) if one.name != line.device.name]
    second = probe_path(line.port, others)
    second.heard = {**second.heard, **report.heard}
    second.strangers = report.strangers + second.strangers
    second.unasked, second.refusals = report.unasked, report.refusals
    return second


def _as_set(line: "AnyLine") -> "DeviceProfile":
    return replace(line.device, serial=line.settings)


def is_as_named(line: "AnyLine", report: "PortReport") -> bool:
    """Decide whether the rig's own device answered at the rig's own speed."""
    return any(_fits(line, one) for one in report.answers)


def _fits(line: "AnyLine", answer: "ProbeAnswer") -> bool:
    return answer.profile.name == line.device.name and answer.settings.baud == line.baud


def tell_report(report: "PortReport", line: "AnyLine | None" = None, *, is_own_file: bool = False) -> "Iterator[str]":
    """Yield lines for people: what answered and how fast, or what was heard instead. is_own_file: one device's file is asked
    for, whose speed is then no rig's."""
    for answer in report.answers:
        yield from _tell_answer(answer)
        if is_own_file and answer.settings != answer.profile.serial:
            yield f"  the file says {answer.profile.serial}: correct it, or say `baud: {answer.settings.baud}` in the rig"
        if line and not _fits(line, answer):
            cure = f"write device: {answer.profile.name}, baud: {answer.settings.baud}, or exchange the ports"
            if answer.profile.role is not line.device.role:
                cure = f"this one is of role {answer.profile.role}: exchange the ports"
            yield f"E113 the rig names {line.device.name} at {line.baud}: {cure}"
    for other in () if report.answers else report.strangers:
        known = ", ".join(map(str, other.profile.own_identity.models)) if other.profile.own_identity else ""
        yield (
            f"E113 {report.path}: a device answers {other.profile.name}'s question at {other.settings} and says that it is "
            f"{other.said}, the profile knows {known}: another device, or a name to add to `models`"
        )
    if not report.answers and not report.strangers:
        yield f"E112 {report.path}: no known device answered; {_tell_silence(report)}"
    yield from _tell_latency(report)


def _tell_answer(answer: "ProbeAnswer") -> "Iterator[str]":
    from gateway.profiles.rigs.checks.wire_times import wire_cycle_s
    from gateway.service.probing.port_probe import show_bytes

    yield f"{answer.profile.name} answers at {answer.settings}: {answer.said}"
    if answer.profile.set_valve:
        yield f"  asked {show_bytes(answer.asked)}, heard {show_bytes(answer.heard)}: {answer.took_s * 1e3:.1f} ms"
        return
    cycle_s = wire_cycle_s(answer.profile, answer.settings)
    if not answer.asked:
        yield f"  streams {show_bytes(answer.heard)}, {answer.rate_hz:.0f} readings/s; the wire carries {1 / cycle_s:.0f}"
        return
    yield f"  asked {show_bytes(answer.asked)}, heard {show_bytes(answer.heard)}"
    wire_s = (len(answer.asked) + len(answer.heard)) * answer.settings.character_s
    around_s = max(0.0, answer.took_s - wire_s)  # of the device and its adapter
    talks = 2 if answer.profile.set_voltage else 1
    possible_hz = 1.0 / (cycle_s + talks * around_s)
    what = "settings with a reading" if talks == 2 else "readings"
    slow = f": slower than the {_LEAST_HZ:.0f} that a force loop needs" if possible_hz < _LEAST_HZ else ""
    yield (
        f"  a question takes {answer.took_s * 1e3:.1f} ms ({wire_s * 1e3:.1f} ms on the wire alone): about {possible_hz:.0f} "
        f"{what} a second{slow}; the wire alone would carry {1 / cycle_s:.0f}"
    )


def _tell_silence(report: "PortReport") -> str:
    names, is_heard = ", ".join(report.unasked), any(report.heard.values())
    cure = "`run` tells it the safe voltage, and what it answers"
    unasked = f"{names} has no question that changes nothing, so it was not asked: {cure}" if names else ""
    return "; ".join(filter(None, (_tell_heard(report) if is_heard or not names else "", unasked)))


def _tell_heard(report: "PortReport") -> str:
    from gateway.devices.template import quote
    from gateway.service.probing.port_probe import is_text, show_bytes

    heard = {settings: data for settings, data in report.heard.items() if data}
    if not heard:
        return f"not one byte at {', '.join(report.heard)}: power, crossed wires, another port?"
    if refused := next(
        (f"{words} at {settings}" for settings, data in heard.items() if (words := _exception_of(data))), ""
    ):
        return (
            f"{refused}: it is there, and has no such register or function; a manual's 40008 is register 7 on the wire"
        )
    if report.refusals:
        refused_as, line, said = report.refusals[0]
        refused = f"one says no in the words of {refused_as.name} at {line}, {quote(said)}"
        return f"{refused}: it is there, and has no answer to what it was asked"
    settings, data = max(
        heard.items(), key=lambda one: (is_text(one[1]), len(one[1]))
    )  # noise comes at every other speed
    if parity := next(filter(None, map(_parity_of, heard.values())), None):
        settings, data = next(one for one in heard.items() if _parity_of(one[1]) == parity)
        text = show_bytes(_seven_bits(data))
        return (
            f"{len(data)} bytes at {settings} that are text of 7 data bits and {parity} parity: {text}; {_IN_A_PROFILE}"
        )
    return f"{len(data)} bytes at {settings} that no profile understands: {show_bytes(data)}"


def _exception_of(data: bytes) -> str:
    """Return what a Modbus device says to a register that it does not have; empty for any other bytes."""
    from gateway.devices.binary.rtu_framing import answers, exception_text

    frame = next(iter(answers(data[0]).feed(data)), None)
    text = exception_text(frame.body) if frame and frame.is_whole else ""
    return f"a Modbus unit {data[0]} answers {text}" if text else ""


def _tell_latency(report: "PortReport") -> "Iterator[str]":
    from gateway.ports.latency import SLOW_MS, latency_ms

    if report.warning:
        yield f"W332 {report.warning}"
    elif (latency := latency_ms(report.path) or 0) >= SLOW_MS:
        yield f"W332 {report.path} waits up to {latency} ms before it hands over what it received; 1 ms is usual"


def lines_to_probe(rig: "Rig") -> "Iterator[tuple[str, AnyLine]]":
    """Yield each line of a real rig. CliError for a simulated one."""
    if rig.simulated or rig.output.port is None or rig.load_cell.port is None:
        raise CliError(f"E114 rig {rig.name} is simulated: it has no ports to probe", exit_codes.CONFIGURATION)
    yield "output", rig.output
    yield "load_cell", rig.load_cell
    if rig.valve and rig.valve.port is not None:
        yield "valve", rig.valve


def report_fields(report: "PortReport") -> dict[str, Any]:
    """Return a probe as JSON."""
    return {
        "port": report.path,
        "answers": [
            {
                "device": one.profile.name,
                "serial": str(one.settings),
                "baud": one.settings.baud,
                "said": one.said,
                "question_s": round(one.took_s, 6),
                "rate_hz": round(one.rate_hz, 2),
            }
            for one in report.answers
        ],
        "strangers": [
            {"device": one.profile.name, "serial": str(one.settings), "said": one.said} for one in report.strangers
        ],
        "heard": {settings: len(data) for settings, data in report.heard.items()},
        "warning": report.warning,
    }


@dataclass(frozen=True, slots=True)
class Heard:
    """What came through a port by itself: lines for people, fields for programs."""

    lines: tuple[str, ...]
    fields: dict[str, Any]


def listen_at(path: str, seconds: float) -> Heard:
    """Listen at a port at each usual speed, without sending a byte. CliError where it does not open."""
    from gateway.devices import SerialSettings
    from gateway.ports import PortError
    from gateway.service.probing.port_probe import BAUDS, listen_to_port, show_bytes

    speeds = [SerialSettings(baud=baud) for baud in (*_SLOW_BAUDS, *BAUDS)]
    try:
        report = asyncio.run(listen_to_port(path, speeds, seconds))
    except PortError as error:
        raise port_failure(error) from None
    heard = [_as_sent(settings, report.heard[str(settings)]) for settings in speeds]
    readers = {settings: _readers(data) for settings, data in heard}
    lines = [
        f"{settings}: {len(data) / seconds:.0f} bytes/s {show_bytes(data)}" + _named(readers[settings], seconds)
        for settings, data in heard
        if data
    ]
    shown = ", ".join(str(settings.baud) for settings in speeds)
    if not lines:
        lines = [f"silent at {shown} baud: it may wait to be asked (check RIG --probe), or is not powered"]
    elif not any(readers.values()):
        lines.append("no shipped profile reads this; the speed whose bytes look like text is probably the right one")
    lines += [
        f"at {settings.baud} it sends 7 data bits and {settings.parity} parity: {_IN_A_PROFILE}"
        for settings, _ in heard
        if settings.data_bits < _DATA_BITS
    ]
    fields = {
        "port": path,
        "heard": [
            {"serial": str(settings), "bytes_per_s": round(len(data) / seconds, 1), "devices": readers[settings]}
            for settings, data in heard
        ],
    }
    return Heard((*lines, *_tell_latency(report)), fields)


def _as_sent(settings: "SerialSettings", data: bytes) -> "tuple[SerialSettings, bytes]":
    """Return what was heard with 8 data bits as the device sent it: perhaps with 7 and a parity bit."""
    parity = _parity_of(data)
    return (replace(settings, data_bits=7, parity=parity), _seven_bits(data)) if parity else (settings, data)


def _parity_of(data: bytes) -> Literal["even", "odd"] | None:
    """Return which parity the eighth bits of a text are, None where they are none: without it the right speed looks like
    noise, too."""
    text = _seven_bits(data)
    if data.isascii() or sum(one in _OF_TEXT for one in text) < _MOST * len(text):
        return None
    odd = sum(one.bit_count() % 2 for one in data)
    is_neither = (1.0 - _MOST) * len(data) < odd < _MOST * len(data)
    return None if is_neither else "odd" if 2 * odd > len(data) else "even"


def _seven_bits(data: bytes) -> bytes:
    return bytes(one & 0x7F for one in data)


def _readers(data: bytes) -> dict[str, int]:
    """Streams whose profile reads these bytes, and how many readings they are."""
    from gateway.service.probing.harmless_questions import count_readings

    streams = [one for one in known_profiles("load cell") if one.stream]
    counts = {one.name: count_readings(one, data) for one in streams}
    return {name: count for name, count in counts.items() if count}


def _named(readers: dict[str, int], seconds: float) -> str:
    return "".join(f" - {name}, {count / seconds:.0f} readings/s" for name, count in readers.items())
