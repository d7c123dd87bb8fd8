"""Why does a device say nothing that makes sense? Listen at every usual speed, and say what was heard in numbers.

Opens the port by itself, so the caller closes its own first. Used when a line stays without valid words at the start.
"""

import asyncio
import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from gateway.devices import DeviceProfile, SerialSettings, cell_host, output_host
from gateway.devices.messages import (
    Accepted,
    DeviceAnswer,
    DeviceStep,
    ForceSample,
    Garbage,
    OutputRequest,
    Pressure,
    Refused,
    SetVoltage,
)
from gateway.ports import PortError, PortEvents, SerialPort
from gateway.profiles import CellLine, OutputLine
from gateway.service.running_rig.lines.cell_identity import CellIdentity
from gateway.service.running_rig.lines.unread_lines import UnreadLines

BAUDS: Final = (9600, 19200, 38400, 57600, 115200)
_LISTEN_S: Final = 0.4  # forty frames of a 100 Hz stream, or several questions and answers at 9600 baud
_LONG_TALK: Final = 40  # characters of a question and its answer: on a slow wire they take longer than that
_QUESTIONS: Final = 2
_ENOUGH: Final = 3
_VALID: Final = (
    Accepted,
    Pressure,
    Refused,
    ForceSample,
    DeviceAnswer,
)  # a device that refuses in its own words is heard


@dataclass(frozen=True, slots=True)
class ProbeResult:
    """Answer at one speed: bytes in all, lines that the device's grammar knows, and what another line says where it is text."""

    baud: int
    bytes: int
    valid: int
    says: str = ""


async def explain_silent_device(line: OutputLine | CellLine, path: str, safe_v: float = 0.0) -> str:
    """Return one sentence, E110 or E111 (or E10x when the port cannot be opened). safe_v: the rig's safe voltage."""
    bauds = (line.baud, *(baud for baud in BAUDS if baud != line.baud))
    try:
        probes = [await listen_at(line, path, baud, safe_v) for baud in bauds]
    except PortError as error:
        return str(error)
    return _sentence(path, probes[0], probes[1:])


def _sentence(path: str, here: ProbeResult, elsewhere: list[ProbeResult]) -> str:
    if here.valid:
        return f"{path}: valid lines at {here.baud}; the device was silent a moment ago"
    saw = f"{here.bytes} bytes, 0 valid lines at {here.baud}"
    best = max(elsewhere, key=lambda probe: probe.valid)
    if best.valid:
        return f"E110 {path}: {saw}; at {best.baud} the same device gives valid lines: set baud: {best.baud} in the rig"
    if text := next((probe for probe in (here, *elsewhere) if probe.says), None):
        where = "" if text is here else f"at {text.baud} "
        return f"E110 {path}: {saw}; {where}{text.says}"
    if here.bytes or any(probe.bytes for probe in elsewhere):
        tried = ", ".join(str(probe.baud) for probe in elsewhere)
        return f"E110 {path}: {saw}, nor at {tried}: another device on this port, or another parity?"
    return f"E111 {path}: silence at every speed; power, crossed wires, stream mode? force-gateway explain E111"


async def listen_at(line: OutputLine | CellLine, path: str, baud: int, safe_v: float = 0.0) -> ProbeResult:
    """Open the port, ask or listen at this speed, and return what came. PortError where it does not open."""
    ask, receive = _question_and_receiver(line, safe_v)
    enough = asyncio.Event()
    total, valid, question = 0, 0, b""
    unread = UnreadLines(line.device)

    def on_bytes(chunk: bytes, now_s: float) -> None:
        nonlocal total, valid
        total += len(chunk)
        messages = receive(chunk, now_s)
        valid += sum(isinstance(message, _VALID) for message in messages)
        unread.hear([one for one in messages if not _is_ours(one, question)], now_s)
        if valid >= _ENOUGH:
            enough.set()

    settings: SerialSettings = line.settings.at(baud)
    port = SerialPort(path, settings, PortEvents(on_bytes, on_lost=lambda _: None, on_open=lambda _: None))
    await port.open()
    try:
        for _ in range(_QUESTIONS):  # the first one may end half a line that somebody left in the device
            question = ask()
            port.write(question)
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(enough.wait(), _LISTEN_S / _QUESTIONS + _LONG_TALK * settings.character_s)
    finally:
        port.close()
    return ProbeResult(baud, total, valid, unread.words(time.monotonic()))


def _is_ours(message: object, question: bytes) -> bool:
    """Decide whether an adapter has heard our own words."""
    return isinstance(message, Garbage) and message.data in question


def _question(device: DeviceProfile, safe_v: float) -> OutputRequest:
    """Return what moves nothing: a reading, or, where a device cannot be asked, the voltage that it was told at the start."""
    return next(iter(output_host(device).idle_questions), SetVoltage(safe_v))


def _question_and_receiver(
    line: OutputLine | CellLine, safe_v: float
) -> tuple[Callable[[], bytes], Callable[[bytes, float], Sequence[object]]]:
    """Return how to ask this device for a word (a stream is not asked), and what a chunk completes. One that can be asked what
    it is is asked that alone: to another one the question for a reading may be a setting."""
    if isinstance(line, OutputLine):
        output, question = output_host(line.device), _question(line.device, safe_v)
        return lambda: output.request(question), output.receive
    identity = CellIdentity(line.device)
    if not identity.question:
        cell = cell_host(line.device, line.sign, line.unit)
        return cell.poll, cell.receive

    def receive(chunk: bytes, now_s: float) -> Sequence[object]:
        heard: list[object] = [*identity.receive(chunk)]
        if not identity.is_due:
            heard.append(DeviceAnswer(DeviceStep.IDENTITY, is_right=not identity.fault))
            identity.begin()
        return heard

    return lambda: identity.question, receive
