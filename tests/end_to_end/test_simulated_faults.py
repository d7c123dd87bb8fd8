"""`sim` with a running gateway: a fault that is set, told, cleared and reset; an effect while a force is held; and that what is
set outlives the simulated rig's process."""

import json
import os
import signal
import time
from typing import Any

from click.testing import CliRunner

from gateway.cli.main import command
from gateway.registers.words import State
from tests.end_to_end.conftest import RunningGateway

ENABLE, RESET = 1, 2


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
