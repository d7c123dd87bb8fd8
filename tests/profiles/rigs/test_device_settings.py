"""What a rig says of a device: its address, checksum, watchdog and counts reach the wire, or `check` says why they cannot."""

from pathlib import Path

import pytest

from gateway.cli.setup.wire_example import example
from gateway.devices import cell_host, output_host
from gateway.devices.messages import AskDevice, DeviceStep, ForceSample, ReadVoltage, SetVoltage
from gateway.profiles import Report, check_report, load_device, shipped_profiles_folder

RIG = """
name: own
calibration: demo
output: {device: OUTPUT, port: /dev/serial/by-id/a, baud: 38400OUTPUT_SETTINGS}
load_cell: {device: CELL, port: /dev/serial/by-id/b, baud: 115200, range_n: 98CELL_SETTINGS}
limits: {force_max_n: 40, over_force_n: 55, smallest_force_n: 2, voltage_max_v: 8}
supervision: {sample_timeout_s: 0.5, output_timeout_s: 0.5, sample_quantum_n: 1.0, saturation_n: 96}
accept_no_device_watchdog: true
"""


def rig(
    folder: Path, output: str = "", cell: str = "", device: str = "icpdas-702x", amplifier: str = "stream-st-gs"
) -> Report:
    text = RIG.replace("OUTPUT_SETTINGS", output).replace("CELL_SETTINGS", cell)
    path = folder / "own.yaml"
    path.write_text(text.replace("OUTPUT", device).replace("CELL", amplifier), encoding="utf-8")
    return check_report(path)


def test_the_address_the_checksum_and_the_watchdogs_time_are_the_rigs(tmp_path: Path) -> None:
    found = rig(tmp_path, ", address: 0x1F, checksum: dcon-sum, watchdog_s: 0.96, watchdog_tick_s: 0.0533")
    assert found.rig, found.faults
    host = output_host(found.rig.output.device)
    assert host.request(SetVoltage(5.0)) == b"#1F05.000BD\r"
    assert host.request(AskDevice(DeviceStep.ARM)).startswith(b"~1F3112")
    assert host.gap_s == 0.0


def test_a_line_without_a_baud_has_that_of_its_devices_profile(tmp_path: Path) -> None:
    path = tmp_path / "own.yaml"
    text = RIG.replace(", baud: 38400OUTPUT_SETTINGS", "").replace(", baud: 115200", "").replace("CELL_SETTINGS", "")
    path.write_text(text.replace("OUTPUT", "mcu-line").replace("CELL", "hbm-aed-binary"), encoding="utf-8")
    path.write_text(path.read_text().replace("range_n: 98", "range_n: 98, newton_per_count: 0.0002"), encoding="utf-8")
    found = check_report(path)
    assert found.rig, found.faults
    assert str(found.rig.output.settings) == "115200 8N1"
    assert str(found.rig.load_cell.settings) == "38400 8E1"
    assert not [each for each in found.warnings if "differs from the other end" in each.message]


def test_a_modbus_units_address_is_the_rigs(tmp_path: Path) -> None:
    found = rig(tmp_path, ", address: 17", ", address: 3", "waveshare-ao8b", "laumas-tlb")
    assert found.rig, found.faults
    assert output_host(found.rig.output.device).request(SetVoltage(5.0))[:6] == bytes.fromhex("110600001388")
    assert cell_host(found.rig.load_cell.device).poll()[0] == 3


def test_another_output_of_a_modbus_device_is_the_rigs_channel(tmp_path: Path) -> None:
    """It was told to be none, and to leave the line out: output 0 moved in place of the one that was wired."""
    found = rig(tmp_path, ", channel: 3", device="waveshare-ao8b")
    assert found.rig, found.faults
    host = output_host(found.rig.output.device)
    assert host.request(SetVoltage(5.0))[:6] == bytes.fromhex("010600031388")
    assert host.request(ReadVoltage())[:6] == bytes.fromhex("010300030001")
    first = rig(tmp_path, ", channel: 0", device="waveshare-ao8b")
    assert first.rig and output_host(first.rig.output.device).request(SetVoltage(5.0))[:6] == bytes.fromhex(
        "010600001388"
    )


def test_another_output_in_two_registers_begins_two_further_on(tmp_path: Path) -> None:
    text = (shipped_profiles_folder() / "devices" / "waveshare-ao8b.yaml").read_text()
    text = text.replace("function: 6, register: 0", "function: 16, register: 100, type: float32")
    text = text.replace("function: 3, register: 0", "function: 3, register: 200, type: float32")
    (tmp_path / "dac.yaml").write_text(text.replace("name: waveshare-ao8b", "name: dac"))
    found = rig(tmp_path, ", channel: 2", device="dac")
    assert found.rig, found.faults
    host = output_host(found.rig.output.device)
    assert host.request(SetVoltage(5.0))[:7] == bytes.fromhex("01100068000204")
    assert host.request(ReadVoltage())[:6] == bytes.fromhex("010300CC0002")
    (tmp_path / "one.yaml").write_text(text.replace("channels: 8\n", "").replace("name: waveshare-ao8b", "name: one"))
    (told,) = rig(tmp_path, ", channel: 2", device="one").faults
    assert "one has no channel: its file names the registers of one output; `channels` in a copy" in told.message


CONVERTER = """name: converter
description: analogue input, 0 to 65535 for -10 to 10 V
role: load cell
source: a manual
certainty: manual
hardware: never run on hardware
codec: modbus-rtu
serial: {baud: 115200}
read_force: {modbus: {function: 4, first: 0, last: 0, weight: 0, type: uint16}}
"""


@pytest.mark.parametrize(
    ("zero", "told"),
    [
        (", zero_count: 32768", ""),
        (
            "",
            "there is no room for a minus sign, and noise needs it: say which count is 0 N in `zero_count`, else int16",
        ),
    ],
)
def test_counts_without_a_sign_have_their_zero_from_the_rig(zero: str, told: str, tmp_path: Path) -> None:
    """The file was refused, and told to say int16: 40000 would have been -25536."""
    (tmp_path / "converter.yaml").write_text(CONVERTER)
    found = rig(tmp_path, cell=f", newton_per_count: 0.01{zero}", amplifier="converter")
    assert [told in str(fault) for fault in found.faults] == ([True] if told else []), found.faults
    assert example(load_device(tmp_path / "converter.yaml")).startswith("20 counts: 01 04")
    if found.rig:
        (reading,) = cell_host(found.rig.load_cell.device).receive(bytes.fromhex("0104 02 7830 9b24"), 0.0)
        assert isinstance(reading, ForceSample) and reading.force_n == pytest.approx(-20.0)


def test_raw_counts_are_sized_by_the_rig(tmp_path: Path) -> None:
    found = rig(tmp_path, cell=", newton_per_count: 0.001, zero_count: 84000", amplifier="hx711-line")
    assert found.rig, found.faults
    (sample,) = cell_host(found.rig.load_cell.device).receive(b"94000\r\n", 0.0)
    assert sample.force_n == pytest.approx(10.0)  # type: ignore[union-attr]


@pytest.mark.parametrize("cell", [("", "stream-st-gs"), (", unit: N", "mantracourt-dsc")])
def test_a_zero_in_counts_beside_a_device_that_says_its_unit_is_refused(cell: tuple[str, str], tmp_path: Path) -> None:
    """`zero_count: 84000` of another amplifier's file stayed in: -823 kN at rest, and `check` said that all fits."""
    zero, amplifier = cell
    (told,) = rig(tmp_path, cell=f"{zero}, zero_count: 84000", amplifier=amplifier).faults
    assert f"load_cell.zero_count: {amplifier} says its unit, or `unit` does: raw counts have none" in str(told)
    assert not rig(tmp_path, cell=f"{zero}, zero_count: 0", amplifier=amplifier).faults


@pytest.mark.parametrize(
    ("output", "cell", "devices", "told"),
    [
        (
            ", address: 2",
            "",
            ("smc-itv-rc", "stream-st-gs"),
            "output.address: smc-itv-rc has no address: leave this line out",
        ),
        (", channel: 1", "", ("icpdas-702x", "stream-st-gs"), "output.channel: icpdas-702x has no channel"),
        (", channel: 4", "", ("icpdas-7024", "stream-st-gs"), "output.channel: icpdas-7024 has 4 outputs: 0 to 3"),
        (
            ", channel: 8",
            "",
            ("waveshare-ao8b", "stream-st-gs"),
            "output.channel: waveshare-ao8b has 8 outputs: 0 to 7",
        ),
        (", channel: 7", "", ("adam-4024", "stream-st-gs"), "output.channel: adam-4024 has 4 outputs: 0 to 3"),
        (", address: 300", "", ("icpdas-702x", "stream-st-gs"), "output.address: 0 V: address = 12C: does not fit"),
        (
            ", address: 0",
            "",
            ("waveshare-ao8b", "stream-st-gs"),
            "output.address: address 0: a Modbus unit is 1 to 255",
        ),
        (", address: A", "", ("icpdas-702x", "stream-st-gs"), "output.address: 0 V: address = A: not a number"),
        (
            ", checksum: xor",
            "",
            ("waveshare-ao8b", "stream-st-gs"),
            "output.checksum: waveshare-ao8b speaks Modbus RTU",
        ),
        (
            ", watchdog_s: 2",
            "",
            ("waveshare-ao8b", "stream-st-gs"),
            "output.watchdog_s: waveshare-ao8b has no watchdog",
        ),
        (
            ", watchdog_s: 60",
            "",
            ("icpdas-702x", "stream-st-gs"),
            "output.watchdog_s: 60 s is 600 counts of 0.1 s, and its sentence has room for 255: 25.5 s at most",
        ),
        (
            ", watchdog_s: 0.05",
            "",
            ("icpdas-702x", "stream-st-gs"),
            "output.watchdog_s: 0.05 s is less than one count of the watchdog, 0.1 s: it would trip later",
        ),
        (
            ", watchdog_s: 0.03, watchdog_tick_s: 0.01",
            "",
            ("icpdas-702x", "stream-st-gs"),
            "output.watchdog_s: 0.03 s of icpdas-702x's watchdog would trip in normal work: 0.04 s is the least at 100 Hz",
        ),
        (
            ", watchdog_s: 0.1",
            "",
            ("mcu-line", "stream-st-gs"),
            "output.watchdog_s: 0.1 s of mcu-line's watchdog would trip in normal work: 0.3 s is the least",
        ),
        ("", "", ("smc-itv-rc", "hx711-line"), "load_cell.unit: hx711-line does not say its unit: the rig must"),
        (
            "",
            ", newton_per_count: 2",
            ("smc-itv-rc", "stream-st-gs"),
            "load_cell.newton_per_count: stream-st-gs says its unit",
        ),
    ],
)
def test_a_setting_that_a_device_does_not_have_is_told(
    output: str, cell: str, devices: tuple[str, str], told: str, tmp_path: Path
) -> None:
    faults = [str(fault).split(" ", 1)[1] for fault in rig(tmp_path, output, cell, *devices).faults]
    assert any(fault.startswith(told) for fault in faults), faults
