"""Why a line says nothing: heard at every usual speed over a pty that behaves like a wire of one speed."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import replace
from typing import Any

import pytest

from gateway.devices import DeviceProfile, cell_device, output_device
from gateway.devices.messages import Accepted, DeviceAnswer, DeviceStep, Garbage, SetVoltage
from gateway.ports import PacedPty
from gateway.profiles import CellLine, OutputLine
from gateway.service.running_rig.lines.baud_probe import (
    ProbeResult,
    _question,
    _question_and_receiver,
    _sentence,
    explain_silent_device,
    listen_at,
)
from tests.profile_files import load_device
from tests.service.rigs import demo

FRAME_PERIOD_S = 0.01


class SpeakingCell:
    """An amplifier that streams at its own speed whatever the client's is."""

    def __init__(
        self, profile: DeviceProfile, baud: int, frame: bytes | None = None, period_s: float = FRAME_PERIOD_S
    ) -> None:
        self._period_s = period_s
        self._frame = cell_device(profile).frame(12.0) if frame is None else frame
        self.pty = PacedPty(baud, on_bytes=lambda chunk, now_s: None)

    def start(self) -> None:
        self.pty.open()
        assert self.pty._pty
        self.pty._pty.set_client_baud(demo().load_cell.baud)  # the gateway has had it open until now
        self._next()

    def _next(self) -> None:
        if self._frame:
            self.pty.send(self._frame)
        self._timer = asyncio.get_running_loop().call_later(self._period_s, self._next)

    def close(self) -> None:
        self._timer.cancel()
        self.pty.close()


class AnsweringRegulator:
    """Answers what it understands at its own speed; to anything else it says its own word, or nothing."""

    def __init__(self, profile: DeviceProfile, baud: int, setting_v: float = 2.0, only_refuses: bool = False) -> None:
        self._device = output_device(profile)
        self._setting_v = setting_v
        self._only_refuses = only_refuses
        self.heard: list[object] = []
        self.pty = PacedPty(baud, on_bytes=self._on_bytes)

    def start(self) -> None:
        self.pty.open()

    def close(self) -> None:
        self.pty.close()

    def _on_bytes(self, chunk: bytes, now_s: float) -> None:
        for request in self._device.receive(chunk, now_s):
            self.heard.append(request)
            if isinstance(request, Garbage) or self._only_refuses:
                garbage = request if isinstance(request, Garbage) else Garbage(b"")
                self.pty.send(self._device.reply(self._device.refusal(garbage)))
            else:
                self.pty.send(self._device.reply(Accepted(self._setting_v), to=request))


def asked(device: SpeakingCell | AnsweringRegulator, question: Callable[[str], Coroutine[Any, Any, Any]]) -> Any:
    async def scene() -> Any:
        device.start()
        try:
            async with asyncio.timeout(10):
                return await question(device.pty.path)
        finally:
            device.close()

    return asyncio.run(scene())


@pytest.fixture
def cell() -> CellLine:
    return demo().load_cell


@pytest.fixture
def output() -> OutputLine:
    return demo().output


@pytest.mark.parametrize(("right", "period_s"), [(9600, 0.19), (38400, 0.025)])
def test_another_speed_of_the_load_cell_is_found_and_named(cell: CellLine, right: int, period_s: float) -> None:
    sentence = asked(
        SpeakingCell(cell.device, right, period_s=period_s), lambda path: explain_silent_device(cell, path)
    )
    assert sentence.startswith("E110 /dev/pts/")
    assert "0 valid lines at 115200" in sentence
    assert f"at {right} the same device gives valid lines: set baud: {right} in the rig" in sentence


@pytest.mark.parametrize("right", [19200, 115200])
def test_another_speed_of_the_regulator_is_found_and_named(output: OutputLine, right: int) -> None:
    device = AnsweringRegulator(output.device, right)
    sentence = asked(device, lambda path: explain_silent_device(output, path))
    assert sentence.startswith("E110 ")
    assert f"set baud: {right} in the rig" in sentence
    assert not [one for one in device.heard if isinstance(one, SetVoltage)], "a probe asks, it sets nothing"


def test_silence_is_e111_with_what_to_look_at(cell: CellLine, output: OutputLine) -> None:
    for line in (cell, output):
        sentence = asked(
            SpeakingCell(cell.device, 9600, frame=b""), lambda path, line=line: explain_silent_device(line, path)
        )
        assert sentence.startswith("E111 ")
        assert "silence at every speed" in sentence
        assert "explain E111" in sentence


def test_bytes_that_mean_nothing_at_any_speed_are_another_device(cell: CellLine) -> None:
    sentence = asked(
        SpeakingCell(cell.device, 9600, frame=b"$GPGGA,123519\r\n"), lambda path: explain_silent_device(cell, path)
    )
    assert sentence.startswith("E110 ")
    assert "nor at 9600, 19200, 38400" in sentence
    assert "another device" in sentence


def test_a_device_that_speaks_now_was_silent_a_moment_ago(cell: CellLine) -> None:
    sentence = asked(SpeakingCell(cell.device, 115200), lambda path: explain_silent_device(cell, path))
    assert "valid lines at 115200" in sentence
    assert "E1" not in sentence


def test_a_refusal_in_the_devices_own_words_is_heard(output: OutputLine) -> None:
    heard = asked(
        AnsweringRegulator(output.device, 9600, only_refuses=True), lambda path: listen_at(output, path, output.baud)
    )
    assert heard.valid >= 1


class TalkingOutput(AnsweringRegulator):
    """Answers each line by these words, or, where there are none, by its own: so does an adapter that hears itself."""

    def __init__(self, words: bytes) -> None:
        super().__init__(demo().output.device, 9600)
        self._words = words

    def _on_bytes(self, chunk: bytes, now_s: float) -> None:
        if b"\r\n" in chunk:
            self.pty.send(self._words or chunk)


@pytest.mark.parametrize(("words", "told"), [(b"E 07\r\n", "it says 'E 07', no answer that its profile"), (b"", "")])
def test_an_output_that_answers_in_other_words_is_quoted_and_our_own_are_not(
    output: OutputLine, words: bytes, told: str
) -> None:
    heard = asked(TalkingOutput(words), lambda path: listen_at(output, path, 9600))
    assert heard.bytes and heard.says.startswith(told) and bool(heard.says) is bool(told)


def test_what_is_heard_is_told_in_numbers(cell: CellLine) -> None:
    heard = asked(SpeakingCell(cell.device, 115200), lambda path: listen_at(cell, path, cell.baud))
    assert heard.baud == 115200
    assert heard.valid >= 3
    assert heard.bytes >= 3 * 18


def test_a_port_that_is_not_there_is_told_as_such(cell: CellLine) -> None:
    sentence = asyncio.run(explain_silent_device(replace(cell, port="/dev/none"), "/dev/none"))
    assert sentence.startswith("E102 /dev/none is not there")


@pytest.mark.parametrize("right", [115200, 38400])
def test_a_cell_in_another_unit_is_quoted_and_the_unit_told(cell: CellLine, right: int) -> None:
    sentence = asked(
        SpeakingCell(cell.device, right, frame=b"ST,GS,+0012.34kN\r\n", period_s=0.025),
        lambda path: explain_silent_device(cell, path),
    )
    assert sentence.startswith("E110 ")
    where = "" if right == 115200 else "at 38400 "
    assert f"; {where}it says 'ST,GS,+0012.34kN', in kN: stream-st-gs reads kg or lb or g or N; set the" in sentence


def test_each_speed_is_tried_once_the_rig_s_own_first_and_what_it_says_there_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tried = list[int]()

    async def hear(line: object, path: str, baud: int, safe_v: float) -> ProbeResult:
        tried.append(baud)
        return ProbeResult(baud, 9, 0, f"it says words of {baud}")

    monkeypatch.setattr("gateway.service.running_rig.lines.baud_probe.listen_at", hear)
    line = replace(demo().load_cell, baud=38400)
    told = asyncio.run(explain_silent_device(line, "/dev/ttyNONE"))
    assert tried == [38400, 9600, 19200, 57600, 115200]
    assert told == "E110 /dev/ttyNONE: 9 bytes, 0 valid lines at 38400; it says words of 38400"


def test_what_cannot_be_asked_is_told_the_safe_voltage_of_its_rig_and_a_cell_nothing() -> None:
    """It was told the least that it can be set to: 0 V where 3 V hold the tool, -10 V of an output of both signs."""
    regulator = replace(load_device("mcu-line"), read_pressure=None, read_voltage=None)
    assert _question(regulator, 3.0) == SetVoltage(3.0)
    line = replace(demo().output, device=regulator)
    assert b"3.0000" in _question_and_receiver(line, 3.0)[0]()
    stream, asked_cell = demo().load_cell, replace(demo().load_cell, device=load_device("mantracourt-dsc"), unit="N")
    assert _question_and_receiver(stream, 3.0)[0]() == b"" != _question_and_receiver(asked_cell, 3.0)[0]()


def test_of_a_cell_that_can_be_asked_what_it_is_no_reading_is_asked() -> None:
    """`$014` asks an ADAM-4016 for its sample; an I-7021 on the wrong adapter keeps its output as its power-on value by it."""
    ask, receive = _question_and_receiver(replace(demo().load_cell, device=load_device("adam-4016"), unit=None), 0.0)
    for model, is_right in ((b"4016", True), (b"7021", False)):
        assert ask() == b"#**\r$01M\r"
        assert receive(b"!01", 0.0) == []
        assert receive(model + b"\r", 0.0) == [DeviceAnswer(DeviceStep.IDENTITY, is_right=is_right)]


def test_at_every_speed_the_silent_device_hears_the_safe_voltage_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    told = list[float]()

    async def hear(line: object, path: str, baud: int, safe_v: float) -> ProbeResult:
        told.append(safe_v)
        return ProbeResult(baud, 0, 0)

    monkeypatch.setattr("gateway.service.running_rig.lines.baud_probe.listen_at", hear)
    asyncio.run(explain_silent_device(demo().output, "/dev/ttyNONE", 3.0))
    assert told == [3.0] * 5


@pytest.mark.parametrize(("here", "elsewhere", "code"), [(0, 0, "E111"), (5, 0, "E110"), (0, 5, "E110")])
def test_a_single_byte_at_any_speed_is_no_silence(here: int, elsewhere: int, code: str) -> None:
    told = _sentence("/dev/ttyNONE", ProbeResult(9600, here, 0), [ProbeResult(19200, elsewhere, 0)])
    assert told.startswith(f"{code} /dev/ttyNONE: ")
