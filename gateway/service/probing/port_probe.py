"""Ask a serial port which device is behind it: listen, then put the harmless questions of each profile, speed by speed.

The speed of the rig or of the profile comes first, so that a port that is wired as its rig says is answered for at once.
"""

import asyncio
import contextlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from gateway.devices import DeviceProfile, SerialSettings
from gateway.devices.template import CONTROL_CHARACTERS, quote
from gateway.ports import PortEvents, SerialPort
from gateway.ports.port import monotonic_s
from gateway.progress import reported
from gateway.service.probing.harmless_questions import (
    HarmlessQuestion,
    count_readings,
    harmless_questions,
    refusal_among,
    start_of_stream,
)

BAUDS: Final = (9600, 19200, 38400, 57600, 115200)
_LISTEN_S: Final = 0.45  # several lines of a stream of 10 readings a second
_LONGEST_LISTEN_S: Final = 2.0  # to one that is slower by its profile
_ENOUGH: Final = 3  # readings of a stream
_ROUNDS: Final = 5  # of a question, to measure how long it takes
_SETTLE_S: Final = 0.05  # what was on its way when the port was opened
_LONGEST_ANSWER: Final = 40  # characters
_SHOWN_BYTES: Final = 48


@dataclass(frozen=True, slots=True)
class ProbeAnswer:
    """A device that answered, or streams. said: in words; asked: the question, empty for a stream; took_s: one question and
    its answer; rate_hz: of these, or of the stream."""

    profile: DeviceProfile
    settings: SerialSettings
    said: str
    asked: bytes
    heard: bytes
    took_s: float
    rate_hz: float


class Stranger(NamedTuple):
    """A device that answers as the profile says, and is another one, or has no answer. said: what it calls itself, or how it
    says no."""

    profile: DeviceProfile
    settings: SerialSettings
    said: str


@dataclass(slots=True)
class PortReport:
    """What a port gave: answers in the order of finding; strangers: devices that speak a profile's words and call themselves
    something that it does not know; refusals: those that say no in its words; bytes heard in all, by settings; warning: of its
    adapter; unasked: profiles that have no question which changes nothing."""

    path: str
    answers: list[ProbeAnswer] = field(default_factory=list)
    strangers: list[Stranger] = field(default_factory=list)
    refusals: list[Stranger] = field(default_factory=list)
    heard: dict[str, bytes] = field(default_factory=dict)
    warning: str = ""
    unasked: tuple[str, ...] = ()


class _Ear:
    """An open port and what came through it. last_end: how the last question at this speed ended. Behind another end, or
    none, it may stand in the device ahead of the next one, as do characters of other speeds."""

    def __init__(self, path: str, settings: SerialSettings) -> None:
        self.received = b""
        self.last_end: bytes | None = None
        self._changed = asyncio.Event()
        events = PortEvents(self._on_bytes, on_lost=lambda _: self._changed.set(), on_open=lambda _: None)
        self.port = SerialPort(path, settings, events)

    def _on_bytes(self, chunk: bytes, now_s: float) -> None:
        self.received += chunk
        self._changed.set()

    async def listen(self, duration_s: float) -> None:
        """Collect bytes for this time."""
        await asyncio.sleep(duration_s)

    async def ask(self, question: HarmlessQuestion, timeout_s: float) -> str:
        """Put a question and return what the answer says; empty where none came in time."""
        self.port.flush_input()
        self.received = b""
        self.port.write(question.data)
        deadline_s = monotonic_s() + timeout_s
        while not (words := question.understands(self.received)) and (left_s := deadline_s - monotonic_s()) > 0:
            self._changed.clear()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._changed.wait(), left_s)
        return words


async def probe_port(
    path: str, profiles: Sequence[DeviceProfile], bauds: Sequence[int] = BAUDS, *, patience_s: float = 0.0
) -> PortReport:
    """Try these profiles at their own speed and then at others, until a device answers. PortError where the port does not open.
    patience_s: the least time that is waited for an answer, where the profile's own is shorter."""
    report = PortReport(path)
    report.unasked = tuple(profile.name for profile in profiles if not any(harmless_questions(profile)))
    for settings, fitting in reported(f"speeds of {path}", list(_settings_to_try(profiles, bauds))):
        await _probe_at(report, settings, fitting, patience_s)
        if report.answers or report.strangers:
            break
    return report


def _settings_to_try(
    profiles: Sequence[DeviceProfile], bauds: Sequence[int]
) -> Iterator[tuple[SerialSettings, list[DeviceProfile]]]:
    """Each frame and speed once, with the profiles that it could be; the profiles' own speeds come first."""
    own = dict.fromkeys(profile.serial for profile in profiles)
    others = dict.fromkeys(profile.serial.at(baud) for baud in bauds for profile in profiles)
    for settings in dict.fromkeys([*own, *others]):
        yield settings, [profile for profile in profiles if profile.serial.at(settings.baud) == settings]


async def _probe_at(
    report: PortReport, settings: SerialSettings, profiles: Sequence[DeviceProfile], patience_s: float
) -> None:
    ear = _Ear(report.path, settings)
    await ear.port.open()
    report.warning = ear.port.warning or report.warning
    try:
        for start in filter(None, map(start_of_stream, profiles)):
            ear.port.write(start)
        await ear.listen(_SETTLE_S)
        began_s, ear.received = monotonic_s(), b""
        await ear.listen(_listens_s(profiles, patience_s))
        streamed, listened_s = ear.received, monotonic_s() - began_s
        report.heard[str(settings)] = streamed
        for profile in profiles:
            if profile.stream:
                if answer := _streamed(profile, settings, streamed, listened_s):
                    report.answers.append(answer)
            elif answer := await _asked(ear, profile, settings, patience_s, report.strangers):
                report.answers.append(answer)
            else:
                report.heard[str(settings)] += ear.received
                if said := refusal_among(profile, ear.received):
                    report.refusals.append(Stranger(profile, settings, said))
    finally:
        ear.port.close()


def _listens_s(profiles: Sequence[DeviceProfile], patience_s: float) -> float:
    """How long until these streams have said enough, and one line that was cut at its beginning; half a line more, for their
    clocks are not ours."""
    by_rate_s = [(_ENOUGH + 1.5) / profile.rate_hz for profile in profiles if profile.stream]
    return max(_LISTEN_S, min(_LONGEST_LISTEN_S, max([patience_s, *by_rate_s]))) if by_rate_s else _LISTEN_S


def _streamed(
    profile: DeviceProfile, settings: SerialSettings, received: bytes, listened_s: float
) -> ProbeAnswer | None:
    count = count_readings(profile, received)
    if count < _ENOUGH:
        return None
    (question,) = harmless_questions(profile)
    end = profile.terminator_bytes
    whole = received.split(end)[1:]
    line = next((one for one in whole if question.understands(end + one + end)), whole[0])
    return ProbeAnswer(profile, settings, question.understands(received), b"", line, 0.0, count / listened_s)


async def _asked(
    ear: _Ear, profile: DeviceProfile, settings: SerialSettings, patience_s: float, strangers: list[Stranger]
) -> ProbeAnswer | None:
    known = ""  # what is known of the device by now
    for question in harmless_questions(profile):
        if not question.data:
            continue
        on_the_wire_s = (len(question.data) + _LONGEST_ANSWER) * settings.character_s
        timeout_s = max(patience_s, profile.reply_timeout_s + on_the_wire_s)
        words = await ear.ask(question, timeout_s)
        if ear.last_end != profile.question_terminator_bytes and not (words or question.stranger(ear.received)):
            words = await ear.ask(question, timeout_s)
        ear.last_end = profile.question_terminator_bytes
        if other := question.stranger(ear.received):
            strangers.append(Stranger(profile, settings, other))
            return None
        if not (words or question.is_enough):  # nor is a reading asked of who knows: `$014` is a setting to an I-7021
            return None
        if words and not question.is_enough:
            known = f"{words}, "
        elif words:
            heard, took_s = ear.received, await _round_s(ear, question, timeout_s)
            return ProbeAnswer(profile, settings, known + words, question.data, heard, took_s, 1.0 / took_s)
    return None


async def _round_s(ear: _Ear, question: HarmlessQuestion, timeout_s: float) -> float:
    """Measure how long a question and its answer take."""
    began_s = monotonic_s()
    for _ in range(_ROUNDS):
        await ear.ask(question, timeout_s)
        await ear.listen(0.0)
    return (monotonic_s() - began_s) / _ROUNDS


async def listen_to_port(path: str, settings: Iterable[SerialSettings], duration_s: float) -> PortReport:
    """Listen without a word: what comes by itself at each of these settings."""
    report = PortReport(path)
    for each in settings:
        ear = _Ear(path, each)
        await ear.port.open()
        report.warning = ear.port.warning or report.warning
        try:
            await ear.listen(_SETTLE_S)
            ear.received = b""
            await ear.listen(duration_s)
        finally:
            ear.port.close()
        report.heard[str(each)] = ear.received
    return report


def show_bytes(data: bytes) -> str:
    """Return bytes as people can read them: text as text, anything else in hexadecimal."""
    shown = data[:_SHOWN_BYTES]
    more = "..." if len(data) > _SHOWN_BYTES else ""
    return (quote(shown.decode("ascii")) if is_text(data) else shown.hex(" ")) + more


def is_text(data: bytes) -> bool:
    """Decide whether what is shown of these bytes is text: a short binary answer may be all controls."""
    text = data[:_SHOWN_BYTES].decode("ascii", "replace")
    printable = sum(one.isprintable() for one in text)
    controls = sum(one in f"\r\n{CONTROL_CHARACTERS}" for one in text)
    is_all_shown = text.isascii() and printable + controls == len(text)
    return is_all_shown and printable > 0 and len(text.rstrip("\r\n")) <= 2 * printable
