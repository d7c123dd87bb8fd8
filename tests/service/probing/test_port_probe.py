"""What is behind a port: found at the speed and in the words that it has, told in numbers, and never driven."""

import asyncio
import json
import os
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.cli.setup.port_probing import PATIENCE_S, probe_path, tell_report
from gateway.devices import SerialSettings, ValveDevice, cell_device
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import AskDevice, DeviceStep, Garbage, ReadPressure, ReadVoltage
from gateway.devices.profile import DeviceRole
from gateway.ports import Pty
from gateway.processes import exit_codes
from gateway.profiles import list_shipped, load_device
from gateway.service.probing.harmless_questions import HarmlessQuestion, harmless_questions
from gateway.service.probing.port_probe import PortReport, ProbeAnswer, _Ear, show_bytes
from tests.service.probing.far_ends import FarEnd, behind_ptys

RIG = """
name: own
calibration: demo
output: {{device: {device}, port: {output}, baud: {baud}}}
load_cell: {{device: stream-st-gs, port: {cell}, baud: 115200, range_n: 98}}
limits: {{force_max_n: 40, over_force_n: 55, smallest_force_n: 2, voltage_max_v: 8}}
supervision: {{saturation_n: 96}}
accept_no_device_watchdog: true
"""
INDICATOR = load_device("stream-st-gs")
HARMLESS = (Garbage, ReadPressure, ReadVoltage, AskDevice(DeviceStep.IDENTITY))


@pytest.mark.parametrize("name", list_shipped("device"))
def test_what_a_probe_asks_changes_nothing(name: str) -> None:
    profile = load_device(name)
    questions = list(harmless_questions(profile))
    if profile.role is DeviceRole.OUTPUT:
        device = FarEnd(profile)._output
        assert device
        for question in questions:
            (request,) = device.receive(question.data, 0.0)
            assert isinstance(request, (ReadPressure, ReadVoltage)) or request == AskDevice(DeviceStep.IDENTITY)
    elif profile.role is DeviceRole.VALVE:
        assert [ValveDevice(profile).receive(one.data) for one in questions] == [[None]]
    else:
        device = cell_device(profile, None if profile.reading.newton_per_unit else "N")
        assert bool(questions[-1].data) is (profile.stream is None)
        counts = [device.receive(one.data, 0.0) for one in questions]
        answers = device.take_answers()
        assert counts == [0] * (len(questions) - 1) + [1 if questions[-1].data else 0], "one reading at most"
        assert bool(answers) is (len(questions) == 2), "and what it is, where it can be asked"


def probe(folder: Path, paths: list[str], device: str = "icpdas-702x", baud: int = 9600) -> tuple[int, str]:
    rig = folder / "own.yaml"
    rig.write_text(RIG.format(device=device, output=paths[0], cell=paths[1], baud=baud))
    result = CliRunner().invoke(command, ["check", str(rig), "--probe"])
    return result.exit_code, result.output


def test_a_rig_whose_devices_answer_as_it_says(tmp_path: Path) -> None:
    module, indicator = FarEnd(load_device("icpdas-702x")), FarEnd(load_device("stream-st-gs"))
    with behind_ptys(module, indicator) as paths:
        code, said = probe(tmp_path, paths)
    assert code == exit_codes.OK, said
    assert "icpdas-702x answers at 9600 8N1: it says that it is 7021" in said
    assert r"asked '$01M\r', heard '!017021\r'" in said
    assert "the wire alone would carry" in said
    assert "stream-st-gs answers at 115200 8N1: reads 0.51, 5.001 N" in said, "and what that is"
    assert "readings/s; the wire carries 640" in said
    assert set(module.heard) <= {AskDevice(DeviceStep.IDENTITY)}, "nothing else was ever asked of it"


def test_of_what_no_profile_understands_the_text_is_told(tmp_path: Path) -> None:
    """It was what came most of, which is noise of another speed as often as not."""
    other = ForceReading(frame="Total={force:+08.2f} kg", unit="kg", rate_hz=100)
    with behind_ptys(FarEnd(load_device("icpdas-702x")), FarEnd(replace(INDICATOR, stream=other))) as paths:
        _, said = probe(tmp_path, paths)
    assert "that no profile understands: '" in said and "Total=+0000.51 kg" in said


def test_exchanged_ports_are_told_so(tmp_path: Path) -> None:
    """Of an indicator at the output's port only noise was told: what came at another speed, in hexadecimal."""
    with behind_ptys(module := FarEnd(load_device("smc-itv-rc")), FarEnd(INDICATOR)) as (output, cell):
        _, said = probe(tmp_path, [cell, output], "smc-itv-rc")
    assert "E113 the rig names smc-itv-rc at 9600: this one is of role load cell: exchange the ports" in said
    assert "E113 the rig names stream-st-gs at 115200: this one is of role output: exchange the ports" in said
    assert all(isinstance(one, HARMLESS[:3]) or one == HARMLESS[3] for one in module.heard)


def test_a_device_at_another_speed_is_found_and_told(tmp_path: Path) -> None:
    module, indicator = FarEnd(load_device("icpdas-702x"), 19200), FarEnd(load_device("stream-st-gs"))
    with behind_ptys(module, indicator) as paths:
        code, said = probe(tmp_path, paths)
    assert code == exit_codes.DEVICE
    assert "icpdas-702x answers at 19200 8N1" in said
    assert (
        "E113 the rig names icpdas-702x at 9600: write device: icpdas-702x, baud: 19200, or exchange the ports" in said
    )
    assert all(isinstance(one, HARMLESS[:3]) or one == HARMLESS[3] for one in module.heard)


def test_listening_says_what_comes_and_sends_nothing() -> None:
    indicator, module = FarEnd(load_device("stream-st-gs")), FarEnd(load_device("icpdas-702x"))
    with behind_ptys(indicator, module) as paths:
        result = CliRunner().invoke(command, ["ports", "--listen", "--seconds", "0.1", "--json", *paths])
    heard, silent = json.loads(result.output)
    by_speed = {one["serial"]: one["devices"].get("stream-st-gs", 0) for one in heard["heard"]}
    assert max(by_speed, key=lambda serial: by_speed[serial]) == "115200 8N1", by_speed
    assert by_speed["115200 8N1"] > 3
    assert all(one["bytes_per_s"] == 0 for one in silent["heard"])
    assert module.heard == []


@pytest.mark.parametrize("names", [("laumas-tlb", "mantracourt-dsc"), ("hbm-aed",)])
def test_a_device_is_found_behind_what_was_asked_before_it(names: tuple[str, ...]) -> None:
    """The laumas-tlb's question has no end of a line: a DSC heard it and its own as one, and answered neither."""
    with behind_ptys(FarEnd(load_device(names[-1]), 57600)) as (path,):
        report = probe_path(path, [load_device(one) for one in names], PATIENCE_S)
    assert [(one.profile.name, one.settings.baud) for one in report.answers] == [(names[-1], 57600)]


class SevenDataBits(FarEnd):
    """An indicator as many are delivered: 2400 7E1 or 7O1, the eighth bit of what comes being its parity."""

    def __init__(self, baud: int, odd: int) -> None:
        super().__init__(load_device("stream-st-gs"), baud)
        self.odd = odd

    def _stream(self) -> None:
        text = cell_device(INDICATOR).frame(5.0)
        self.pty.send(bytes(one | (one.bit_count() % 2 ^ self.odd) << 7 for one in text))
        self._timer = asyncio.get_running_loop().call_later(0.06, self._stream)


@pytest.mark.parametrize(("baud", "odd", "frame"), [(9600, 0, "7E1"), (2400, 1, "7O1")])
def test_listening_tells_seven_data_bits_and_a_slow_line_from_noise(baud: int, odd: int, frame: str) -> None:
    """Of 7E1 nothing looked like text at any speed, and at 2400 baud nobody had listened."""
    with behind_ptys(SevenDataBits(baud, odd)) as (path,):
        result = CliRunner().invoke(command, ["ports", "--listen", "--seconds", "0.4", path])
    (named,) = [line for line in result.output.splitlines() if "stream-st-gs" in line]
    assert f"{baud} {frame}: " in named and "ST,GS," in named
    assert (
        f"at {baud} it sends 7 data bits and {'odd' if odd else 'even'} parity: a profile says so under serial"
        in result.output
    )
    assert result.output.count("7 data bits") == 1


def test_a_probe_tells_seven_data_bits_from_noise(tmp_path: Path) -> None:
    with behind_ptys(FarEnd(load_device("icpdas-702x")), SevenDataBits(115200, 0)) as paths:
        _, said = probe(tmp_path, paths)
    assert "bytes at 115200 8N1 that are text of 7 data bits and even parity: " in said and "ST,GS," in said


@pytest.mark.parametrize(
    ("data", "shown"),
    [
        (b"ST,+1\r\n", r"'ST,+1\r\n'"),
        (b"\x02+1.0\tN\x03", "'<STX>+1.0<TAB>N<ETX>'"),
        (b"\x022    5.00\x0329\x04", "'<STX>2    5.00<ETX>29<EOT>'"),
        (b"0\r\n", r"'0\r\n'"),  # an ITV at rest
        (b"\r\n", "0d 0a"),
        (b"\x01\x06\x00", "01 06 00"),
        (b"\x01\x04\x02\x05\x06AB", "01 04 02 05 06 41 42"),
        (b"a" * 100, f"'{'a' * 48}'..."),
    ],
)
def test_bytes_are_shown_as_people_can_read_them(data: bytes, shown: str) -> None:
    assert show_bytes(data) == shown


def test_what_cannot_be_probed_is_told() -> None:
    runner = CliRunner()
    simulated = runner.invoke(command, ["check", "demo", "--probe"])
    assert simulated.exit_code == exit_codes.CONFIGURATION
    assert "E114 rig demo is simulated" in simulated.output
    device = runner.invoke(command, ["check", "smc-itv-rc.yaml", "--probe"])
    assert device.exit_code != 0
    for words in (["/dev/none"], ["/dev/none", "--json"]):
        missing = runner.invoke(command, ["ports", "--listen", *words])
        assert "E102" in missing.output and missing.exit_code == exit_codes.DEVICE


def test_a_port_that_is_missing_keeps_no_other_one_from_being_asked(tmp_path: Path) -> None:
    """And `--json` says so in JSON: it said nothing at all."""
    indicator = FarEnd(load_device("stream-st-gs"))
    with behind_ptys(indicator) as (cell,):
        code, said = probe(tmp_path, ["/dev/none", cell])
        found = CliRunner().invoke(command, ["check", str(tmp_path / "own.yaml"), "--probe", "--json"])
    assert code == found.exit_code == exit_codes.DEVICE
    assert "E102 /dev/none is not there" in said and "stream-st-gs answers at 115200 8N1" in said
    probes = json.loads(found.stdout)["probe"]
    assert probes["output"]["error"].startswith("E102 /dev/none") and probes["load_cell"]["answers"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["stream-st-gs", "--port", "/dev/none"], "--port goes with --probe"),
        (["stream-st-gs", "--probe"], "E114 --probe asks the devices of a rig"),
        (["irc5-cell", "--probe", "--port", "/dev/none"], "E114 --probe asks the devices of a rig"),
    ],
)
def test_a_port_is_of_a_device_s_own_file_and_of_a_probe(words: list[str], told: str) -> None:
    """It was passed over without a word: a rig's own ports were asked instead."""
    result = CliRunner().invoke(command, ["check", *words])
    assert result.exit_code == exit_codes.USAGE and told in result.output


@pytest.mark.parametrize(("latency_ms", "is_told"), [(16, True), (1, False), (None, False)])
def test_a_slow_adapter_is_told(latency_ms: int | None, is_told: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.ports.latency.latency_ms", lambda path: latency_ms)
    said = list(tell_report(PortReport("/dev/ttyUSB0")))
    assert any(line.startswith("W332 /dev/ttyUSB0 waits up to 16 ms") for line in said) is is_told
    assert said[0].startswith("E112 /dev/ttyUSB0: no known device answered")


def test_the_rate_that_is_told_is_that_of_the_wire_and_the_device() -> None:
    profile = load_device("icpdas-702x")
    asked, heard = b"$01M\r", b"!017021\r"
    answer = ProbeAnswer(profile, profile.serial, "it says that it is 7021", asked, heard, 0.0235, 42.0)
    told = " ".join(tell_report(PortReport("/dev/ttyUSB0", [answer])))
    assert "a question takes 23.5 ms (13.5 ms on the wire alone): about 21 settings with a reading a second" in told
    assert "the wire alone would carry 36" in told


OF_ANOTHER_MODEL = """
name: mine
description: of another model
role: {role}
source: a manual
certainty: manual
hardware: never run on hardware
serial: {{baud: 9600, data_bits: 8, parity: none, stop_bits: 1}}
terminator: "\\r"
constants: {{address: 1}}
identity: {{ask: "${{address:02X}}M", answer: "!{{address:02X}}{{model:s}}", models: [4711]}}
{exchanges}
"""
CELL_WORDS = 'read_force: {ask: "$014", frame: "{force:+.4f}", unit: N, rate_hz: 10}'
OUTPUT_WORDS = """
set_voltage: {ask: "#01{volts:06.3f}", answer: ">", range: {device: [0, 10], voltage_v: [0, 10]}}
read_voltage: {ask: "$016", answer: "!01{volts:06.3f}", range: {device: [0, 10], voltage_v: [0, 10]}}
"""


@pytest.mark.parametrize(
    ("role", "exchanges", "shipped"),
    [("load cell", CELL_WORDS, "adam-4016"), ("output", OUTPUT_WORDS, "icpdas-702x")],
    ids=["cell", "output"],
)
def test_a_device_that_calls_itself_otherwise_is_told(role: str, exchanges: str, shipped: str, tmp_path: Path) -> None:
    """The gateway would not drive it (A333): a reading that makes sense does not hide that."""
    profile = load_device(shipped)
    file = tmp_path / "mine.yaml"
    file.write_text(OF_ANOTHER_MODEL.format(role=role, exchanges=exchanges))
    with behind_ptys(FarEnd(profile)) as paths:
        result = CliRunner().invoke(command, ["check", str(file), "--probe", "--port", paths[0]])
        right = CliRunner().invoke(
            command, ["check", f"profiles/devices/{shipped}.yaml", "--probe", "--port", paths[0]]
        )
    model = shipped.split("-")[1].replace("702x", "7021")
    assert f"says that it is {model}, the profile knows 4711" in result.output, result.output
    assert "mine answers" not in result.output
    assert result.exit_code == exit_codes.DEVICE
    assert f"it says that it is {model}" in right.output, right.output
    assert right.exit_code == exit_codes.OK


def test_a_device_at_another_speed_than_its_file_says_is_told(tmp_path: Path) -> None:
    with behind_ptys(FarEnd(load_device("icpdas-702x"), 19200)) as paths:
        file = "profiles/devices/icpdas-702x.yaml"
        result = CliRunner().invoke(command, ["check", file, "--probe", "--port", paths[0]])
    assert "the file says 9600 8N1: correct it, or say `baud: 19200` in the rig" in result.output, result.output


def test_a_probe_takes_no_answer_to_a_question_of_before_it() -> None:
    """At each speed and in each profile's words it asks anew: a late answer to the last ones proves nothing of these."""
    pty = Pty()
    question = HarmlessQuestion(b"?", lambda received: received.decode())

    async def ask() -> str:
        ear = _Ear(pty.path, SerialSettings(baud=9600))
        await ear.port.open()
        asyncio.get_running_loop().add_reader(pty.fd, lambda: (os.read(pty.fd, 16), os.write(pty.fd, b"fresh")))
        try:
            os.write(pty.fd, b"late")
            return await ear.ask(question, 5.0)
        finally:
            asyncio.get_running_loop().remove_reader(pty.fd)
            ear.port.close()

    assert asyncio.run(ask()) == "fresh"
    pty.close()
