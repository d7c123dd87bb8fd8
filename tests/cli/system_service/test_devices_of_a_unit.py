"""Every serial line of a rig is let into its unit, and the udev rule says what each adapter needs."""

from dataclasses import replace
from pathlib import Path

import pytest

from gateway.cli.system_service.installation import UNITS, plan_installation
from gateway.cli.system_service.unit_file import udev_text
from gateway.profiles import Rig, load_rig
from gateway.profiles.rigs.faces import RtuFace


def allowed(rig: Rig) -> list[str]:
    """Return the devices that the unit of a rig may use."""
    plan = plan_installation("irc5-cell", rig, networks=(), command=Path("/opt/force-gateway/bin/force-gateway"))
    lines = plan.files[f"{UNITS}/{plan.unit}"].splitlines()
    return [line.removeprefix("DeviceAllow=") for line in lines if line.startswith("DeviceAllow=")]


@pytest.mark.parametrize("more", ["none", "valve", "face"])
def test_the_port_of_each_line_is_let_in(more: str) -> None:
    """A service without the valve's port is off with E110, though `run` at the terminal works."""
    rig = load_rig("irc5-cell", simulated=False)
    rig = replace(
        rig, output=replace(rig.output, port="/dev/ttyS0"), load_cell=replace(rig.load_cell, port="/dev/ttyS1")
    )
    if more == "valve":
        valve = load_rig("paper-pull", simulated=True).valve
        assert valve
        rig = replace(rig, valve=replace(valve, port="/dev/ttyAMA3"))
    if more == "face":
        rig = replace(rig, fieldbus=(RtuFace(type="rtu", port="/dev/ttyAMA3"),))
    assert allowed(rig) == ["char-ttyS rw"] + ["char-ttyAMA rw"] * (more != "none")


def test_a_simulated_rig_is_let_at_no_device_whatever_its_lines_say() -> None:
    """Its ports may be those of a machine beside it, which another gateway controls."""
    rig = load_rig("irc5-cell", simulated=False)
    rig = replace(rig, output=replace(rig.output, port="/dev/ttyS0"), simulated=True)
    assert allowed(rig) == []
    assert allowed(replace(rig, simulated=False)) != []


def test_no_program_probes_an_adapter_and_none_keeps_what_it_has_read() -> None:
    """A modem manager has sent `AT` to a pressure regulator; 16 ms of an FTDI chip are dead time of the loop."""
    rules = [line for line in udev_text().splitlines() if not line.startswith("#")]
    assert len(rules) == 2
    for part in ('ENV{ID_MM_DEVICE_IGNORE}="1"', 'ENV{ID_MM_PORT_IGNORE}="1"', 'GROUP="dialout"', 'MODE="0660"'):
        assert part in rules[0]
    assert 'DRIVER=="ftdi_sio"' in rules[1] and 'ATTR{latency_timer}="1"' in rules[1]
