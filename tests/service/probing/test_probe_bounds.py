"""How a probe decides: what counts as an answer, how long it waits for one, at which speed it begins."""

import asyncio
from collections.abc import Callable
from dataclasses import replace

import pytest

from gateway.cli.setup.port_probing import probe_path, tell_report
from gateway.devices import DeviceProfile, ValveDevice, ValveDirection, cell_device, output_device
from gateway.devices.binary.register_access import RegisterAccess
from gateway.devices.binary.rtu_framing import rtu_frame
from gateway.devices.device_checks.identity import Identity
from gateway.devices.exchange import Refusals
from gateway.devices.messages import DeviceAnswer, DeviceStep, ReadPressure
from gateway.devices.profile import DeviceRole
from gateway.ports import PacedPty, Pty
from gateway.profiles import list_shipped, load_device
from gateway.service.probing import port_probe
from gateway.service.probing.harmless_questions import HarmlessQuestion, count_readings, harmless_questions
from gateway.service.probing.port_probe import _asked, _settings_to_try, _streamed
from tests.service.probing.far_ends import FarEnd, behind_ptys

STREAM = load_device("stream-st-gs")
LINE = cell_device(STREAM, None).frame(5.0)


class FakeEar:
    """answers: of each question put, the bytes that come; waited_s: how long each would have been waited for."""

    def __init__(self, answers: Callable[[bytes], bytes] = lambda data: b"", took_s: float = 0.0) -> None:
        self.received, self.now_s, self.waited_s = b"", 0.0, list[float]()
        self.last_end: bytes | None = None
        self._answers, self._took_s = answers, took_s

    async def ask(self, question: HarmlessQuestion, timeout_s: float) -> str:
        self.now_s += self._took_s
        self.waited_s.append(timeout_s)
        self.received = self._answers(question.data)
        return question.understands(self.received)

    async def listen(self, duration_s: float) -> None:
        self.now_s += duration_s


class Refusing(FarEnd):
    """A device that has this answer to everything."""

    def __init__(self, profile: DeviceProfile, answer: bytes) -> None:
        super().__init__(profile)
        self.pty = PacedPty(profile.serial.baud, on_bytes=lambda chunk, now_s: self.pty.send(answer))


class WaitsToBeTold(FarEnd):
    """An amplifier that streams from its start on, and says nothing before."""

    def open(self) -> None:
        self.pty.open()

    def _on_bytes(self, chunk: bytes, now_s: float) -> None:
        if b"GO" in chunk and self._timer is None:
            self._stream()


@pytest.mark.parametrize("start", ["GO", "RUN"])
def test_a_stream_that_waits_for_its_start_is_begun_in_the_words_of_its_profile_alone(start: str) -> None:
    assert STREAM.stream
    profile = replace(STREAM, stream=replace(STREAM.stream, start=start))
    with behind_ptys(WaitsToBeTold(profile)) as (path,):
        report = probe_path(path, [profile], is_speed_known=True)
    assert bool(report.answers) is (start == "GO")


@pytest.mark.parametrize(
    ("received", "count"),
    [(LINE * 4, 4), (LINE * 4 + b"\xff?\r\n" * 3, 4), (LINE * 4 + b"\xff?\r\n" * 9, 0), (b"", 0)],
)
def test_where_more_makes_no_sense_than_makes_some_it_is_no_stream(received: bytes, count: int) -> None:
    assert count_readings(STREAM, received) == count


@pytest.mark.parametrize(
    ("received", "said"),
    [
        (b"ST,GS,+0000.51kg\r\n", "reads 0.51, 5.001 N"),
        (b"ST,GS,+0000.51N \r\n", ""),
        (b"OL,GS,+9999.99kg\r\n", "reads beyond its range"),
    ],
)
def test_a_reading_is_told_in_newtons_too(received: bytes, said: str) -> None:
    (question,) = harmless_questions(STREAM)
    assert question.understands(received) == said


@pytest.mark.parametrize(("lines", "is_told"), [(2, False), (3, True)])
def test_two_readings_alone_are_no_stream(lines: int, is_told: bool) -> None:
    assert (_streamed(STREAM, STREAM.serial, LINE * lines, 0.25) is not None) is is_told


def test_of_a_stream_that_was_cut_at_its_beginning_a_whole_reading_is_told() -> None:
    profile = load_device("hx711-line")
    found = _streamed(profile, profile.serial, b"456\r\n" + b"123456\r\n" * 4, 0.25)
    assert found and (found.said, found.heard) == ("reads 123456", b"123456")


@pytest.mark.parametrize(("shipped", "line"), [("stream-st-gs", LINE), ("hx711-line", b"123456\r\n")])
def test_of_a_stream_with_other_lines_a_reading_is_shown(shipped: str, line: bytes) -> None:
    """`streams 'T=23.5', 18 readings/s` was said of a profile that reads those lines over."""
    profile = replace(load_device(shipped), read_over=("T={degrees:.1f}",))
    found = _streamed(profile, profile.serial, (b"T=23.5\r\n" * 2 + line) * 3, 0.25)
    assert found and found.heard == line.strip()
    assert found.rate_hz == pytest.approx(12.0)


@pytest.mark.parametrize(("said_hz", "rate_hz"), [(80.0, 10.0), (3.0, 3.0)])
def test_a_slow_stream_is_listened_to_until_it_has_said_enough(said_hz: float, rate_hz: float) -> None:
    """An HX711 gives ten readings a second as it comes, its profile eighty: it was no known device."""
    profile = load_device("hx711-line")
    assert profile.stream
    of_rate = [replace(profile, stream=replace(profile.stream, rate_hz=rate)) for rate in (said_hz, rate_hz)]
    with behind_ptys(FarEnd(of_rate[1])) as (path,):
        report = asyncio.run(port_probe.probe_port(path, of_rate[:1], ()))
    (answer,) = report.answers
    assert answer.rate_hz == pytest.approx(rate_hz, rel=0.5)


@pytest.mark.parametrize(("heard", "told"), [(b"", ""), (b"hello", "5 bytes at 9600 8N1 that no profile understands")])
def test_what_has_no_harmless_question_is_not_said_to_have_been_silent(heard: bytes, told: str) -> None:
    """Power and wires were blamed for a device that nobody had asked anything."""
    profile = replace(load_device("smc-itv-rc"), read_voltage=None, read_pressure=None, name="own")
    assert profile.set_voltage
    profile = replace(profile, set_voltage=replace(profile.set_voltage, answer="OK"))
    pty = Pty()
    report = asyncio.run(port_probe.probe_port(pty.path, [profile], ()))
    pty.close()
    assert report.heard == {"9600 8N1": b""}
    (said,) = tell_report(replace(report, heard={"9600 8N1": heard}))
    assert "own has no question that changes nothing, so it was not asked" in said
    assert told in said and "wires" not in said


def test_a_modbus_device_that_refuses_is_there_and_what_it_says_is_told_in_words() -> None:
    report = port_probe.PortReport("/dev/ttyS9", heard={"9600 8N1": rtu_frame(3, b"8302"), "19200 8N1": b"\xff" * 9})
    (said,) = tell_report(report)
    told = (
        "a Modbus unit 3 answers exception 2 (illegal data address) at 9600 8N1: it is there, and has no such register"
    )
    assert said.endswith(f"{told} or function; a manual's 40008 is register 7 on the wire")
    (said,) = tell_report(replace(report, heard={"9600 8N1": rtu_frame(3, b"8302")[:4]}))
    assert "4 bytes at 9600 8N1 that no profile understands" in said


@pytest.mark.parametrize(
    ("name", "shown"), [("smc-itv-rc", "UNKNOWN COMMAND"), ("icpdas-7024", "?01"), ("mantracourt-dsc", "?")]
)
def test_a_device_that_says_no_in_the_profile_s_own_words_is_there(name: str, shown: str) -> None:
    """Of a module whose firmware has no `$01M` it was said that no profile understood its `?01`."""
    profile = replace(load_device(name), refusals=Refusals(unknown=shown))
    with behind_ptys(Refusing(profile, f"{shown}{profile.terminator}".encode())) as (path,):
        report = asyncio.run(port_probe.probe_port(path, [profile], (), patience_s=0.4))
    (said,) = tell_report(report)
    assert said.endswith(
        f"no known device answered; one says no in the words of {name} at {profile.serial}, '{shown}': it is there, and has no "
        "answer to what it was asked"
    )
    (said,) = tell_report(replace(report, refusals=[]))
    assert "that no profile understands" in said


@pytest.mark.parametrize("baud", [300, 9600])
@pytest.mark.parametrize("patience_s", [0.0, 3.0])
def test_an_answer_is_waited_for_as_long_as_device_wire_and_person_allow(baud: int, patience_s: float) -> None:
    profile, ear = load_device("smc-itv-rc"), FakeEar()
    settings = profile.serial.at(baud)
    asyncio.run(_asked(ear, profile, settings, patience_s, []))  # type: ignore[arg-type]
    assert ear.waited_s
    assert min(ear.waited_s) >= max(patience_s, profile.reply_timeout_s + 40 * settings.character_s)


def test_a_question_takes_as_long_as_one_of_it_does(monkeypatch: pytest.MonkeyPatch) -> None:
    profile = load_device("icpdas-702x")
    ear = FakeEar(lambda data: b"!017021\r", took_s=0.02)
    monkeypatch.setattr(port_probe, "monotonic_s", lambda: ear.now_s)
    found = asyncio.run(_asked(ear, profile, profile.serial, 0.0, []))  # type: ignore[arg-type]
    assert found and (found.took_s, found.rate_hz) == (pytest.approx(0.02), pytest.approx(50.0))


def test_a_cell_that_says_what_it_is_is_asked_for_a_reading_too() -> None:
    profile = load_device("adam-4016")
    identity, reading = harmless_questions(profile)
    answers: dict[bytes, bytes] = {identity.data: b"!014016\r", reading.data: cell_device(profile, "N").frame(12.345)}
    found = asyncio.run(_asked(FakeEar(answers.__getitem__), profile, profile.serial, 0.0, []))  # type: ignore[arg-type]
    assert found and found.said == "it says that it is 4016, reads 12.345"
    answers[identity.data] = b""
    ear = FakeEar(answers.__getitem__)
    assert asyncio.run(_asked(ear, profile, profile.serial, 0.0, [])) is None  # type: ignore[arg-type]
    assert len(ear.waited_s) == 2, "`$014` is a setting to an I-7021: it keeps its output as its power-on value"
    answers |= {identity.data: b"!014016\r", reading.data: b""}
    assert asyncio.run(_asked(FakeEar(answers.__getitem__), profile, profile.serial, 0.0, [])) is None  # type: ignore[arg-type]


def test_a_question_behind_the_rest_of_another_is_asked_once_more() -> None:
    """A device that waits for the end of a line has ahead of it what came at other speeds, or of a Modbus question."""
    profile = load_device("mantracourt-dsc")
    answers = iter([b"?\r", b"+00032.100\r"])
    found = asyncio.run(
        _asked(FakeEar(lambda data: next(answers, b"+00032.100\r")), profile, profile.serial, 0.0, [])  # type: ignore[arg-type]
    )
    assert found and found.said == "reads 32.1"


def test_a_question_behind_one_with_its_own_end_is_asked_once() -> None:
    """The first one has ended whatever stood ahead of it: a port without a device is not listened to for twice as long."""
    profile, ear = load_device("smc-itv-rc"), FakeEar()
    assert asyncio.run(_asked(ear, profile, profile.serial, 0.0, [])) is None  # type: ignore[arg-type]
    assert len(list(harmless_questions(profile))) == 2 and len(ear.waited_s) == 3


def test_the_profiles_own_speeds_come_first_and_each_is_tried_once() -> None:
    profiles = [load_device("stream-st-gs"), load_device("icpdas-702x")]
    tried = list(_settings_to_try(profiles, (9600, 19200, 115200)))
    assert [settings for settings, _ in tried[:2]] == [profile.serial for profile in profiles]
    assert len(tried) == len({settings for settings, _ in tried}) == 3
    assert all(profile.serial.at(settings.baud) == settings for settings, fitting in tried for profile in fitting)


@pytest.mark.parametrize("name", list_shipped("device"))
def test_an_output_is_asked_for_each_value_that_it_can_read_back(name: str) -> None:
    profile = load_device(name)
    if profile.role is DeviceRole.OUTPUT:
        device, questions = output_device(profile), harmless_questions(profile)
        asked = [request for one in questions for request in device.receive(one.data, 0.0)]
        assert (ReadPressure() in asked) is (profile.read_pressure is not None)


MODBUS_DAC = replace(
    load_device("waveshare-ao8b"),
    identity=Identity(modbus=RegisterAccess(function=3, register=0x0103), models=(4021,)),
)


@pytest.mark.parametrize("profile", [*map(load_device, list_shipped("device")), MODBUS_DAC], ids=lambda one: one.name)
def test_what_an_adapter_hears_of_us_ahead_of_a_name_is_read_over(profile: DeviceProfile) -> None:
    """A question of Modbus RTU that came back was taken for the beginning of a long answer."""
    if not profile.own_identity:
        return
    question = next(iter(harmless_questions(profile)))
    if profile.role is DeviceRole.OUTPUT:
        device = output_device(profile)
        (request,) = device.receive(question.data, 0.0)
        answer = device.reply(DeviceAnswer(DeviceStep.IDENTITY, is_right=True), to=request)  # type: ignore[arg-type]
    else:
        amplifier = cell_device(profile, "N")
        amplifier.receive(question.data, 0.0)
        answer = amplifier.take_answers()
    assert "it says that it is" in question.understands(question.data + answer)


def test_what_an_adapter_hears_of_us_ahead_of_a_reading_is_read_over() -> None:
    """On one line with the answer where a question ends otherwise: `W`, CR and `0.2328`, CR LF."""
    profile = replace(load_device("mantracourt-dsc"), terminator="\r\n", question_terminator="\r")
    (question,) = harmless_questions(profile)
    answer = cell_device(profile, "N").frame(20.0)
    assert question.understands(question.data + answer) == question.understands(answer) != ""


@pytest.mark.parametrize("direction", list(ValveDirection))
@pytest.mark.parametrize("name", list_shipped("device"))
def test_a_valve_is_known_by_how_it_stands(name: str, direction: ValveDirection) -> None:
    profile = load_device(name)
    if profile.role is DeviceRole.VALVE:
        (question,) = harmless_questions(profile)
        device = ValveDevice(profile)
        assert device.receive(question.data) == [None]
        assert question.understands(device.reply(None, direction)) == f"stands at {direction.value}"
        assert question.understands(b"\x00") == ""
