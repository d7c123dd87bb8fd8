"""A rig with a valve or a self-test: what keeps it from starting, each in a sentence that says what to do."""

from dataclasses import replace
from pathlib import Path

import pytest

from gateway.control import CommandMap
from gateway.control.settings import SafeDirection
from gateway.devices import ValveHost
from gateway.profiles import check_report, load_rig
from gateway.registers.words import ControlBit
from tests.profiles.rigs.test_checks import CELL, RIGS, messages, report

PULL = (RIGS / "paper-pull.yaml").read_text(encoding="utf-8")


def test_the_shipped_rig_pulls_and_tests_itself() -> None:
    rig = load_rig("paper-pull")
    assert rig.valve and rig.valve.device.name == "waveshare-relay" and rig.ports() == {}
    assert rig.control.valve and rig.control.valve.safe is SafeDirection.PUSH
    assert rig.control.self_test and rig.control.self_test.force_n == 15.0
    for bit in (ControlBit.VALVE_PULL, ControlBit.START_SELF_TEST):
        assert rig.supported_bits & bit
    assert not load_rig("irc5-cell").supported_bits & (ControlBit.VALVE_PULL | ControlBit.START_SELF_TEST)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "device: waveshare-relay",
            "device: smc-itv-rc",
            "valve.device: smc-itv-rc is of role output, a valve is needed",
        ),
        ("  dwell_s: 0.3", "  port: /dev/serial/by-id/x\n  dwell_s: 0.3", "valve.port: a simulated rig has no ports"),
        ("  dwell_s: 0.3", "  address: 300\n  dwell_s: 0.3", "valve.address: address 300: a Modbus unit is 1 to 255"),
        ("  dwell_s: 0.3", "  address: one\n  dwell_s: 0.3", "valve.address: address one: a Modbus unit is 1 to 255"),
        (
            "  device: waveshare-relay",
            "  address: 2\n  device: mcu-valve",
            "valve.address: mcu-valve has no address: leave this line out",
        ),
        (
            "  baud: 9600\n  dwell_s",
            "  baud: 1200\n  dwell_s",
            "valve.baud: 1200: question and answer of set_valve take 0.133 s on the wire, waveshare-relay gives up after",
        ),
        (
            "timeout_s: 0.5",
            "timeout_s: 0.03",
            "valve.timeout_s: 0.03 s is over before the valve can have answered: a setting and its readback take 0.031 s",
        ),
        ("safe_voltage_v: 0", "safe_voltage_v: 1", "limits.safe_voltage_v: 1 V: a rig with a valve needs 0 V"),
        ("safe: push", "safe: hold", "valve.safe:"),
        ("timeout_s: 0.5", "timeout_s: 0", "valve.timeout_s:"),
        ("pull_area_share: 0.75", "calibration: nowhere", "valve.calibration:"),
        ("force_n: 15", "force_n: 61", "self_test.force_n: 61 N is above limits.force_max_n = 60 N"),
        ("force_n: 15", "force_n: -1", "self_test.force_n:"),
    ],
)
def test_what_does_not_fit_is_told(tmp_path: Path, old: str, new: str, told: str) -> None:
    found = messages(report(tmp_path, PULL, (old, new)).faults)
    assert any(told in message for message in found), found


def test_the_valves_address_is_the_rigs(tmp_path: Path) -> None:
    found = report(tmp_path, PULL, ("  dwell_s: 0.3", "  address: 17\n  dwell_s: 0.3"))
    assert found.rig and found.rig.valve, found.faults
    assert ValveHost(found.rig.valve.device).request(None)[0] == 17


@pytest.mark.parametrize(
    ("port", "told"),
    [
        ("", "valve.port: is missing"),
        (
            ", port: /dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A10K1ITV-if00-port0",
            "valve.port: is the port of output too",
        ),
        (
            ", port: /dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A10K2CEL-if00-port0",
            "valve.port: is the port of load_cell too",
        ),
        (
            ", port: /dev/./serial/by-id/usb-FTDI_FT232R_USB_UART_A10K1ITV-if00-port0",
            "valve.port: is the port of output too",
        ),
        (", port: ttyUSB2", 'valve.port: "ttyUSB2" is not the path of a device'),
    ],
)
def test_a_real_valve_needs_a_port_of_its_own_and_a_simulated_one_none(tmp_path: Path, port: str, told: str) -> None:
    source = CELL.replace("limits:\n", f"valve: {{device: mcu-valve, baud: 115200{port}}}\nlimits:\n", 1)
    (tmp_path / "rig.yaml").write_text(source, encoding="utf-8")
    assert any(told in message for message in messages(check_report(tmp_path / "rig.yaml").faults))
    simulated = check_report(tmp_path / "rig.yaml", simulated=True)
    assert simulated.rig, messages(simulated.faults)
    assert any(told in note for note in simulated.rig.notes), "it is said what is left to edit"


def test_a_master_is_not_served_on_the_valves_adapter(tmp_path: Path) -> None:
    valve = "valve: {device: mcu-valve, baud: 115200, port: /dev/serial/by-id/usb-x-port0}\n"
    face = "fieldbus: [{type: rtu, port: /dev/serial/by-id/usb-x-port0}]\n"
    (tmp_path / "rig.yaml").write_text(CELL.replace("limits:\n", f"{valve}{face}limits:\n", 1), encoding="utf-8")
    (told,) = messages(check_report(tmp_path / "rig.yaml").faults)
    assert told.startswith("fieldbus[0].port: is the valve's port too"), told


def test_a_valves_port_that_is_numbered_by_plugging_is_warned_of(tmp_path: Path) -> None:
    valve = "valve: {device: mcu-valve, baud: 115200, port: /dev/ttyUSB2}\n"
    (tmp_path / "rig.yaml").write_text(CELL.replace("limits:\n", f"{valve}limits:\n", 1), encoding="utf-8")
    warnings = messages(check_report(tmp_path / "rig.yaml").warnings)
    assert any(told.startswith("valve.port: /dev/ttyUSB2 may be another adapter") for told in warnings), warnings


def test_a_measured_pull_comes_from_its_own_calibration(tmp_path: Path) -> None:
    source = PULL.replace("pull_area_share: 0.75", "calibration: demo", 1)
    (tmp_path / "rig.yaml").write_text(source, encoding="utf-8")
    rig = load_rig(tmp_path / "rig.yaml")
    assert rig.pull_calibration and rig.pull_calibration.name == "demo"
    assert load_rig("paper-pull").pull_calibration is None
    command = CommandMap(bow=0.06, s=0.0)
    bent = replace(rig, compensation=replace(rig.compensation, command=command))
    for_here, as_measured = (one.calibration_in_use(one.calibration).pull_model for one in (bent, rig))
    assert for_here and as_measured
    assert for_here.voltage_v(12.0, 1.0)[0] == command.sent_v(as_measured.voltage_v(12.0, 1.0)[0])
    assert for_here.voltage_v(12.0, 1.0) != as_measured.voltage_v(12.0, 1.0)
