"""What a read rig offers to the service, and what simulating a real one changes."""

from dataclasses import replace
from ipaddress import ip_network
from pathlib import Path

from gateway.control import LeaseAction
from gateway.profiles import check_report, load_plant, load_rig
from gateway.registers.words import ControlBit

CELL = (Path(__file__).parents[3] / "profiles" / "rigs" / "irc5-cell.yaml").read_text(encoding="utf-8")


def test_the_demo_rig_has_no_lease_and_is_simulated_on_loopback() -> None:
    rig = load_rig("demo")
    assert rig.simulated and rig.plant == load_plant("paper-slide").plant
    assert rig.control.supervision.lease_s is None and rig.network.bind == "127.0.0.1" and rig.ports() == {}
    assert (str(rig.output.settings), str(rig.load_cell.settings)) == ("9600 8N1", "115200 8N1")
    assert rig.register_map.find("force_setpoint").address == 1
    assert rig.calibration.model().force_range_n[1] > rig.control.limits.force_max_n
    assert ControlBit.ENABLE in rig.supported_bits and ControlBit.VALVE_PULL not in rig.supported_bits


def test_the_real_cell_has_a_lease_ports_by_id_and_an_allow_list() -> None:
    rig = load_rig("irc5-cell")
    assert not rig.simulated and rig.control.supervision.lease_s == 0.2 and rig.loop_hz == 100
    assert rig.control.supervision.lease_action is LeaseAction.FAULT, "whose master is lost lets go"
    assert all(port.startswith("/dev/serial/by-id/") for port in rig.ports().values()) and len(rig.ports()) == 2
    assert rig.network.allow == (ip_network("192.168.125.0/24"),)


def test_simulating_a_real_rig_takes_ports_and_address_away_and_says_so() -> None:
    rig = load_rig("irc5-cell").as_simulated()
    assert rig.simulated and rig.ports() == {} and rig.plant is not None
    assert rig.network.bind == "127.0.0.1"
    assert rig.notes == (  # true whatever `--bind` says, of which a rig knows nothing
        "a simulated rig does not take the cell's address 192.168.125.20: --bind names another than 127.0.0.1",
    )
    assert rig.as_simulated() is rig


def test_a_real_rig_without_a_plant_gets_the_paper_slide_when_simulated_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(CELL.replace("plant: paper-slide", ""), encoding="utf-8")
    report = check_report(path)
    assert report.rig is not None and report.rig.plant is None
    simulated = report.rig.as_simulated()
    assert simulated.plant == load_plant("paper-slide").plant
    assert "rig irc5-cell names no plant: paper-slide is simulated in its place" in simulated.notes


def test_nothing_of_control_changes_when_a_rig_is_simulated() -> None:
    rig = load_rig("irc5-cell")
    simulated = rig.as_simulated()
    assert simulated.control == rig.control and simulated.calibration == rig.calibration
    assert replace(simulated.load_cell, port=rig.load_cell.port) == rig.load_cell
