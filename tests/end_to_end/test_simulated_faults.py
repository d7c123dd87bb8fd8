"""`sim` with a running gateway: a fault that is set, told, cleared and reset; an effect while a force is held; and that what is
set outlives the simulated rig's process. Of a rig that is wired, set or fed wrongly A301 to A303 say, in numbers, the probable
cause, and the cure."""

import json
import os
import signal
import time
from collections.abc import Iterator
from typing import Any

import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.registers.words import State
from tests.end_to_end.conftest import POLL_S, RunningGateway

ENABLE, RESET = 1, 2
PRECONTACT = 7


def verb(running: RunningGateway, *words: str) -> Any:
    return CliRunner().invoke(command, [*words, "--state", str(running.state)])


def sim(running: RunningGateway, *words: str) -> dict[str, Any]:
    told = verb(running, "sim", *words, "--json")
    assert told.exit_code == 0, told.output
    return dict(json.loads(told.stdout))


def assert_presses(running: RunningGateway, force_n: float) -> None:
    """Enabled as soon as that is taken: a rig that has come back must have spoken first."""
    deadline_s = time.monotonic() + 10.0
    while running.write(0, ENABLE, round(100 * force_n)).isError():
        assert time.monotonic() < deadline_s, running.log.read_text()
        time.sleep(0.05)
    running.wait_until(lambda status: abs(status["force_measured"] - 100 * force_n) < 150)


def recover(running: RunningGateway) -> None:
    sim(running, "clear")
    deadline_s = time.monotonic() + 10.0
    while running.status()["state"] != State.OFF:
        running.write(0, RESET, 0)
        assert time.monotonic() < deadline_s, running.log.read_text()
        time.sleep(0.05)


def assert_fails(running: RunningGateway, code: str) -> None:
    running.wait_until(lambda status: status["state"] == State.FAULT and status["output_voltage"] == 0)
    running.said(code)


@pytest.fixture
def healthy(shared: RunningGateway) -> Iterator[RunningGateway]:
    """Heals what its test has broken. Its tests come first: by the pressures of a force that was held the gateway would know
    what air to expect."""
    yield shared
    sim(shared, "clear")
    deadline_s = time.monotonic() + 10.0
    while shared.status()["state"] != State.OFF:
        shared.write(0, 0, 0)
        shared.write(0, RESET, 0)
        assert time.monotonic() < deadline_s, shared.log.read_text()
        time.sleep(0.05)
    shared.write(PRECONTACT, 0)


def provoked(gateway: RunningGateway, setting: str, force_n: float, code: str, precontact_n: float = 0.0) -> str:
    """The sentence with this code that comes once a force is asked for."""
    earlier = len(gateway.log.read_text().splitlines())
    sim(gateway, "set", setting)
    gateway.write(PRECONTACT, round(100 * precontact_n))
    for _ in range(60 if precontact_n else 0):  # what the cell showed before is smoothed away
        gateway.status()
        time.sleep(POLL_S)
    assert not gateway.write(0, ENABLE, round(100 * force_n)).isError()
    return gateway.said(code, within_s=10.0, after=earlier)


def test_no_air_is_told_in_volts_and_newtons(healthy: RunningGateway) -> None:
    said = provoked(healthy, "air.off=on", 12.0, "A301")
    assert " V out, " in said
    assert " N measured, " in said
    assert "no air, or a closed valve; open the air supply and look at its gauge" in said


def test_no_contact_is_told_apart_from_no_air(healthy: RunningGateway) -> None:
    assert "air is there, so no contact with the workpiece" in provoked(healthy, "contact.off=on", 12.0, "A301")


def test_exchanged_wires_stop_with_the_wires_to_swap(healthy: RunningGateway) -> None:
    said = provoked(healthy, "cell.inverted=on", 12.0, "A302")
    assert "swap the cell's signal wires or set sign: -1" in said
    assert healthy.status()["state"] == State.FAULT
    assert healthy.status()["output_voltage"] == 0


def test_a_force_that_reads_far_too_large_stops_before_the_force_is_there(healthy: RunningGateway) -> None:
    """Five times what comes stays below the over-force, which a busy machine would see first."""
    said = provoked(healthy, "cell.scale=5", 9.0, "A303")
    assert "kgf and N are mixed up; check the unit and span of the load cell in the rig file" in said
    assert healthy.status()["state"] == State.FAULT


def test_kgf_read_as_newtons_stops_once_the_tool_presses(healthy: RunningGateway) -> None:
    said = provoked(healthy, "cell.kgf=on", 40.0, "A303", precontact_n=20.0)
    assert "kgf" in said
    assert "check the unit" in said


def test_a_silent_cell_is_rehearsed_audited_and_healed(rested: RunningGateway) -> None:
    assert_presses(rested, 10.0)
    assert sim(rested, "set", "cell.silent=true")["set"] == {"cell.silent": True}
    assert_fails(rested, "A311")
    rested.said("the simulated rig is set: cell.silent=on")
    shown = verb(rested, "audit", "show").output
    assert '{"set": {"cell.silent": "true"}}' in shown
    recover(rested)
    assert sim(rested, "list")["set"] == {}
    assert_presses(rested, 10.0)


def test_an_unplugged_port_is_lost_and_found_again(rested: RunningGateway) -> None:
    assert_presses(rested, 10.0)
    sim(rested, "set", "cell.unplug=on", "unplug=on")
    assert_fails(rested, "E102")
    recover(rested)
    assert_presses(rested, 12.0)


def test_an_effect_that_is_set_while_a_force_is_held_shows_in_the_force(rested: RunningGateway) -> None:
    assert_presses(rested, 20.0)
    sim(rested, "set", "supply-saturation=100000")
    rested.wait_until(lambda status: status["force_measured"] < 1500)
    sim(rested, "clear")
    again = rested.wait_until(lambda status: abs(status["force_measured"] - 2000) < 150)
    assert again["state"] != State.FAULT


def test_what_is_set_outlives_the_simulated_rig_and_nothing_is_set_by_halves(rested: RunningGateway) -> None:
    sim(rested, "set", "leak=0.01", "output.refuse=on")
    os.kill(rested.ready["pids"]["rig"], signal.SIGKILL)
    rested.said("the simulated rig is set as it was before: leak.leak_per_s=0.01, output.refuse=on", within_s=20.0)
    refused = verb(rested, "sim", "set", "air.off=on", "creep=9")
    assert refused.exit_code == 1
    assert "E133 creep=9 is out of range; allowed: -1 .. 1" in refused.output
    assert sim(rested, "list")["set"] == {"leak.leak_per_s": 0.01, "output.refuse": True}
    recover(rested)
    assert_presses(rested, 10.0)


def test_the_code_is_explained_offline_with_one_thing_to_do() -> None:
    for code in ("W203", "A301", "A302", "A303", "A310"):
        told = json.loads(CliRunner().invoke(command, ["explain", code, "--json"]).output)[0]
        assert told["code"] == code
        assert told["do"]
