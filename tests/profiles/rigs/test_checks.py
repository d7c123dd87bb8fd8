"""What keeps a rig from starting although every field is right by itself, and what is only worth a warning."""

from pathlib import Path

import pytest

from gateway.profiles import Report, check_report

RIGS = Path(__file__).parents[3] / "profiles" / "rigs"
DEMO = (RIGS / "demo.yaml").read_text(encoding="utf-8")
CELL = (RIGS / "irc5-cell.yaml").read_text(encoding="utf-8")


def report(folder: Path, source: str, *edits: tuple[str, str]) -> Report:
    for old, new in edits:
        assert source.count(old) == 1, old
        source = source.replace(old, new)
    path = folder / "rig.yaml"
    path.write_text(source, encoding="utf-8")
    return check_report(path)


def messages(faults: tuple[object, ...]) -> list[str]:
    return [str(fault).split(" ", 1)[1] for fault in faults]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("force_max_n: 60", "force_max_n: 66", "limits.force_max_n: 66 N is above 65.2 N, where calibration demo ends (8 V)"),
        ("voltage_max_v: 8.5", "voltage_max_v: 7.5", "limits.force_max_n: 60 N needs"),
        ("over_force_n: 75", "over_force_n: 60",
         "limits.over_force_n: 60 N is not above force_max_n = 60 N: it would trip in normal work"),
        ("over_force_n: 75", "over_force_n: 99",
         "limits.over_force_n: 99 N is beyond the load cell: load_cell.range_n = 98.07 N"),
        ("voltage_max_v: 8.5", "voltage_min_v: 8.5\n  voltage_max_v: 8.5",
         "limits.voltage_min_v: 8.5 V is not below voltage_max_v = 8.5 V"),
        ("safe_voltage_v: 0", "safe_voltage_v: 9",
         "limits.safe_voltage_v: 9 V is outside voltage_min_v .. voltage_max_v = 0 .. 8.5 V"),
        ("safe_voltage_v: 0", "smallest_force_n: 60", "limits.smallest_force_n: 60 N is not below force_max_n = 60 N"),
        ("safe_voltage_v: 0", "smallest_force_n: 5",
         "defaults.precontact_force_n: 3 N is below limits.smallest_force_n = 5 N: the output stays 0 V, the tool would"),
        ("precontact_force_n: 3", "precontact_force_n: 61",
         "defaults.precontact_force_n: 61 N is above limits.force_max_n = 60 N"),
        ("precontact_force_n: 3", "payload_kg: 600",
         "defaults.payload_kg: 600 kg weigh 5884 N, which is beyond the load cell: load_cell.range_n = 98.07 N; are"),
        ("saturation_n: 96", "saturation_n: 99",
         "supervision.saturation_n: 99 N is beyond load_cell.range_n = 98.07 N; 98 % of it is 96.1 N"),
        ("saturation_n: 96", "saturation_n: 60",
         "supervision.saturation_n: 60 N is not above force_max_n = 60 N: it would trip in normal work"),
        ("sample_timeout_s: 0.25", "sample_timeout_s: 0.01",
         "supervision.sample_timeout_s: 0.01 s is shorter than two ticks of the loop: 0.02 s at 100 Hz"),
        ("lease_s: null", "lease_s: 0.01",
         "supervision.lease_s: 0.01 s is shorter than two ticks of the loop: 0.02 s at 100 Hz"),
        ("lease_s: null", "stuck_n: 0.9", "supervision.stuck_n: 0.9 N is not above the"),
        ("plant: paper-slide", "",
         "plant: is missing: a simulated rig needs something to simulate, such as `plant: paper-slide`"),
        ("bind: 127.0.0.1", "bind: 0.0.0.0", "network.bind: 0.0.0.0 can be reached from other machines: say which may connect"),
        ("bind: 127.0.0.1", "allow: [10.0.0.0/8]\n  owner: 192.168.1.1",
         "network.owner: 192.168.1.1 is in none of the networks of network.allow: it could not connect"),
        ("units: [0, 1, 255]", "units: [1, 0, 1]", "network.units[2]: 1 is there twice"),
        ("accept_no_device_watchdog: true", "accept_no_device_watchdog: false",
         "accept_no_device_watchdog: must be true: smc-itv-rc has no watchdog and keeps its last output"),
        ("device: stream-st-gs", "device: smc-itv-rc", "load_cell.device: smc-itv-rc is an output, a load cell is needed here"),
        ("device: smc-itv-rc", "device: stream-st-gs", "output.device: stream-st-gs is a load cell, an output is needed here"),
        ("device: smc-itv-rc", "device: mcu-valve", "output.device: mcu-valve is a valve, an output is needed here"),
        ("device: stream-st-gs", "device: mcu-valve", "load_cell.device: mcu-valve is a valve, a load cell is needed here"),
        ("device: smc-itv-rc", "port: /dev/ttyS0\n  device: smc-itv-rc",
         "output.port: a simulated rig has no ports: delete this line, or write `simulated: false`"),
        ("sign: 1", "unit: kg", "load_cell.unit: stream-st-gs says its unit in each frame"),
    ],
)  # fmt: skip
def test_parts_that_do_not_fit_are_a_fault(tmp_path: Path, old: str, new: str, told: str) -> None:
    found = report(tmp_path, DEMO, (old, new))
    assert any(message.startswith(told) for message in messages(found.faults)), messages(found.faults)
    assert len(found.faults) <= 2 and found.rig is None


def test_room_for_the_trim_says_which_force_would_fit(tmp_path: Path) -> None:
    found = report(tmp_path, DEMO, ("voltage_max_v: 8.5", "voltage_max_v: 7.5"))
    assert str(found.faults[0]).endswith("N would fit") and "with the trim's 0.5 V" in str(found.faults[0])
    fit = str(found.faults[0]).split("; ")[1].split()[0]
    assert not report(
        tmp_path, DEMO, ("voltage_max_v: 8.5", "voltage_max_v: 7.5"), ("n: 60", f"n: {float(fit) - 0.1}")
    ).faults


@pytest.mark.parametrize(
    ("source", "old", "new", "told"),
    [
        (DEMO, "port: 5020", "port: 502", "network.port: E120 502 needs a privilege"),
        (DEMO, "bind: 127.0.0.1", "bind: 0.0.0.0\n  allow: [0.0.0.0/0]",
         "network.allow: lets every address in the world connect"),
        (DEMO, "baud: 9600", "baud: 19200",
         "output.baud: 19200 differs from the other end: the simulated device speaks 9600 8N1"),
        (DEMO, "precontact_force_n: 3", "precontact_force_n: 0.5",
         "defaults.precontact_force_n: 0.5 N is not above contact_threshold_n = 0.5 N: contact would never be felt"),
        (DEMO, "voltage_max_v: 8.5", "voltage_max_v: 10",
         "limits.voltage_max_v: 10 V asks for 0.9 MPa, the plant's supply has 0.85 MPa: above 9.44 V nothing changes"),
        (DEMO, "saturation_n: 96", "saturation_n: 96\n  sample_quantum_n: 1",
         "supervision.sample_quantum_n: 1 N is far from one count of stream-st-gs, 0.0981 N: write 0.0981"),
        (CELL, "lease_s: 0.2", "lease_s: null", "supervision.lease_s: there is no lease"),
        (CELL, "lease_s: 0.2", "lease_s: 200",
         "supervision.lease_s: 200 s, so long a force stays with nobody watching it: 200 ms are written 0.2"),
        (CELL, "sample_timeout_s: 0.05", "sample_timeout_s: 50", "supervision.sample_timeout_s: 50 s, so long"),
        (CELL, "/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A10K1ITV-if00-port0", "/dev/ttyUSB0",
         "output.port: /dev/ttyUSB0 may be another adapter after a replug"),
    ],
)  # fmt: skip
def test_what_may_be_meant_is_a_warning_and_the_rig_loads(
    tmp_path: Path, source: str, old: str, new: str, told: str
) -> None:
    found = report(tmp_path, source, (old, new))
    assert not found.faults and found.rig is not None
    assert any(message.startswith(told) for message in messages(found.warnings)), messages(found.warnings)


RULES = ("trim: #", "response: rig\ntrim: #")


def test_a_trim_or_a_lead_that_the_rig_cannot_follow_is_told_where_the_file_rules(tmp_path: Path) -> None:
    """Simulated: from a gain of 1.5 on the force swings by 6 N for good, and a lead of 0.6 s presses 53 N for 20 N."""
    fast = ("gain_v_per_n_s: 0.3", "gain_v_per_n_s: 1.5")
    long = ("  lag_s: 0.072\n  second_lag_s: 0.072", "  lag_s: 0.3\n  second_lag_s: 0.3")
    lag, pace = "supervision.response_lag_s = 0.2 s", "corrects an error in 0.075 s where 1 V are 8.9 N"
    told = [
        f"trim.gain_v_per_n_s: 1.5 {pace}, faster than {lag}: the force may swing; at most 0.56",
        f"lead.lag_s: 0.6 s with the second is longer than {lag}: each step would go beyond its end",
    ]
    assert messages(report(tmp_path, DEMO, RULES, fast, long).warnings) == told
    assert messages(report(tmp_path, DEMO, RULES, (fast[0], "gain_v_per_n_s: 0.55")).warnings) == []
    assert messages(report(tmp_path, DEMO, fast, long).warnings) == [], "a measured response sets its own pace"
    slow = ("  sample_timeout_s: 0.25", "  response_lag_s: 0.7\n  sample_timeout_s: 0.25")
    assert messages(report(tmp_path, DEMO, RULES, slow, long).warnings)[0].endswith("at most 0.16")


def test_where_no_branch_gives_as_little_as_the_rig_allows_the_pace_is_not_judged(tmp_path: Path) -> None:
    """The check ended with a traceback."""
    small = [(old, f"{old.split(':')[0]}: 0.4") for old in ("force_max_n: 60", "precontact_force_n: 3", "force_n: 15")]
    found = report(tmp_path, DEMO, RULES, *small)
    assert not any("trim" in message for message in messages((*found.faults, *found.warnings)))


def test_a_simulated_rig_with_another_rigs_calibration_goes_by_its_own_numbers(tmp_path: Path) -> None:
    """As control does, which uses no response that another rig was measured with."""
    other = (tmp_path / "other.yaml").resolve()
    shipped = (RIGS.parent / "calibrations" / "demo.yaml").read_text(encoding="utf-8")
    other.write_text(shipped.replace("twin of plant paper-slide", "another rig"), encoding="utf-8")
    fast = ("gain_v_per_n_s: 0.3", "gain_v_per_n_s: 1.5")
    found = report(tmp_path, DEMO, ("calibration: demo", f"calibration: {other}"), fast)
    assert [message.split(":")[0] for message in messages(found.warnings)] == ["trim.gain_v_per_n_s"]


def test_a_load_cell_line_that_cannot_carry_its_readings_is_told(tmp_path: Path) -> None:
    warnings = messages(report(tmp_path, DEMO, ("baud: 115200", "baud: 9600")).warnings)
    assert "load_cell.baud: 9600 carries 53 readings/s, stream-st-gs sends 100" in warnings


def test_a_real_rig_needs_its_two_ports_and_two_different_ones(tmp_path: Path) -> None:
    first, second = (line for line in CELL.splitlines() if line.startswith("  port: /dev/"))
    gone = messages(report(tmp_path, CELL, (first, ""), (second, "")).faults)
    assert [message.split(":")[0] for message in gone] == ["output.port", "load_cell.port"]
    same = messages(report(tmp_path, CELL, (second, first)).faults)
    assert same == ["load_cell.port: is the output's port too: each device has its own"]
    other_name = first.replace("/dev/", "/dev/./")
    assert messages(report(tmp_path, CELL, (second, other_name)).faults) == same, "one adapter by two names"
    named = messages(report(tmp_path, CELL, (first, "  port: ttyUSB0")).faults)
    assert named == ['output.port: "ttyUSB0" is not the path of a device, such as /dev/serial/by-id/usb-...']


@pytest.mark.parametrize(
    ("port", "told"),
    [
        ("3", "3 is not the path of a device, such as /dev/serial/by-id/usb-..."),  # not: write "3" in quotes
        ("/dev", "/dev is a directory and no serial port: `force-gateway ports` lists what is plugged in"),
        ("/etc/passwd", "/etc/passwd is a file and no serial port: `force-gateway ports` lists what is plugged in"),
    ],
)
def test_a_port_that_can_be_none_is_told_by_what_a_port_is(port: str, told: str, tmp_path: Path) -> None:
    line = next(line for line in CELL.splitlines() if line.startswith("  port: /dev/"))
    assert messages(report(tmp_path, CELL, (line, f"  port: {port}")).faults) == [f"output.port: {told}"]
    serial = f"fieldbus: [{{type: rtu, port: {port}}}]\naccept_no"
    faults = messages(report(tmp_path, CELL, ("accept_no", serial)).faults)
    assert faults == [f"fieldbus[0].port: {told}"]


def test_a_serial_port_in_place_of_a_tcp_port_is_told_where_it_belongs(tmp_path: Path) -> None:
    (told,) = messages(report(tmp_path, CELL, ("  port: 5020", "  port: /dev/ttyS0")).faults)
    wanted = "the number of a TCP port; a serial line is a face of `type: rtu`"
    assert told == f'network.port: "/dev/ttyS0" is not {wanted}'


@pytest.mark.parametrize("port", ["192.168.1.127:502", "socket://moxa:4001", "10.0.0.5", "nport.cell:950"])
def test_a_device_that_has_ethernet_is_told_what_it_needs(port: str, tmp_path: Path) -> None:
    line = next(line for line in CELL.splitlines() if line.startswith("  port: /dev/"))
    (told,) = messages(report(tmp_path, CELL, (line, f'  port: "{port}"')).faults)
    assert told.startswith(f'output.port: "{port}" is not the path of a device')
    assert "what has Ethernet needs a serial server whose driver makes a port here" in told


def test_the_shipped_rigs_have_no_fault_and_the_demo_no_warning() -> None:
    assert check_report("demo").faults == check_report("demo").warnings == ()
    cell = check_report("irc5-cell")
    assert cell.faults == ()
    assert [fault.path for fault in cell.warnings] == ["calibration"]


def test_a_key_that_means_nothing_does_not_hide_what_is_wrong_beside_it(tmp_path: Path) -> None:
    found = report(tmp_path, DEMO, ("over_force_n: 75", "over_force_n: 50"), ("safe_voltage_v: 0", "xyz: 0"))
    assert [fault.path for fault in found.faults] == ["limits.over_force_n", "limits.xyz"]


def test_a_key_that_is_there_already_is_not_proposed(tmp_path: Path) -> None:
    (fault,) = report(tmp_path, DEMO, ("safe_voltage_v: 0", "Force_max_n: 0")).faults
    assert "force_max_n?" not in fault.message


def test_a_fault_of_type_does_not_hide_those_of_other_parts(tmp_path: Path) -> None:
    found = report(
        tmp_path,
        DEMO,
        ("seed: 7", "seed: x"),
        ("plant: paper-slide", "plant: paper-slyde"),
        ("baud: 9600", "baud: 115300"),
        ("over_force_n: 75", "over_force_n: 50"),
        ("limit_v: 0.5", "limit: 0.5"),
        ("accept_no_device_watchdog: true", "accept_no_device_watchdog: false"),
    )
    assert [fault.path for fault in found.faults] == [
        "seed",
        "plant",
        "output.baud",
        "limits.over_force_n",
        "trim.limit",
        "accept_no_device_watchdog",
    ]
    assert messages(found.faults)[1] == (
        "plant: paper-slyde is neither a shipped plant (paper-slide) nor a file; did you mean paper-slide?"
    )
    assert [fault.line for fault in found.faults] == sorted(fault.line for fault in found.faults)


def test_an_over_force_that_is_a_fault_is_no_warning_as_well(tmp_path: Path) -> None:
    """It was said to be -10 N above the largest force."""
    found = report(tmp_path, DEMO, ("over_force_n: 75", "over_force_n: 50"))
    assert [fault.path for fault in found.faults] == ["limits.over_force_n"]
    assert not found.warnings
