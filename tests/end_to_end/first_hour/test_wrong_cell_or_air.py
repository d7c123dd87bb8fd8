"""The rig is wired, set or fed wrongly, rehearsed with `sim set`: A301 to A303 in numbers, the probable cause, and the cure."""

import json
import time
from collections.abc import Iterator

import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.registers.words import State
from tests.end_to_end.conftest import POLL_S, RunningGateway, start, stop

ENABLE, RESET = 1, 2
PRECONTACT = 7


@pytest.fixture(scope="module")
def gateway(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningGateway]:
    """One gateway for all tests here; each heals what it has broken."""
    started = start(tmp_path_factory.mktemp("wrong") / "state", "--sim")
    yield started
    stop(started)


@pytest.fixture
def healthy(gateway: RunningGateway) -> Iterator[RunningGateway]:
    yield gateway
    sim(gateway, "clear")
    deadline_s = time.monotonic() + 10.0
    while gateway.status()["state"] != State.OFF:
        gateway.write(0, 0, 0)
        gateway.write(0, RESET, 0)
        assert time.monotonic() < deadline_s, gateway.log.read_text()
        time.sleep(0.05)
    gateway.write(PRECONTACT, 0)


def sim(gateway: RunningGateway, *words: str) -> None:
    done = CliRunner().invoke(command, ["sim", *words, "--state", str(gateway.state)])
    assert done.exit_code == 0, done.output


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
    said = provoked(healthy, "cell.scale=5", 12.0, "A303")
    assert "kgf and N are mixed up; check the unit and span of the load cell in the rig file" in said
    assert healthy.status()["state"] == State.FAULT


def test_kgf_read_as_newtons_stops_once_the_tool_presses(healthy: RunningGateway) -> None:
    said = provoked(healthy, "cell.kgf=on", 40.0, "A303", precontact_n=20.0)
    assert "kgf" in said
    assert "check the unit" in said


def test_the_code_is_explained_offline_with_one_thing_to_do() -> None:
    for code in ("W203", "A301", "A302", "A303", "A310"):
        told = json.loads(CliRunner().invoke(command, ["explain", code, "--json"]).output)[0]
        assert told["code"] == code
        assert told["do"]
