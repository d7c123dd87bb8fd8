"""A program that hung, whose last frame flows on, behind a restart of the service and behind a killed control process."""

import os
import signal
import time
from pathlib import Path

import pytest

from tests.end_to_end.conftest import start, stop
from tests.end_to_end.kills.test_processes import OFF, reconnect


@pytest.mark.parametrize("ends", ["a restart of the service", "a kill of control"])
def test_the_last_frame_of_a_program_that_hung_presses_nothing_behind(ends: str, tmp_path: Path) -> None:
    """12 N were held until somebody came: of that master the next process knew nothing, for it was no lost one yet."""
    text = (Path(__file__).parents[3] / "profiles" / "rigs" / "demo.yaml").read_text()
    rig, state = tmp_path / "leased.yaml", tmp_path / "state"
    rig.write_text(
        text.replace("name: demo", "name: leased").replace("  lease_s: null", "  lease_s: 5.0\n  lease_action: hold")
    )
    gateway = start(state, "--sim", rig=str(rig))
    frame = 1, 1200, 0, 0, 4711
    assert not gateway.write(0, *frame).isError()
    gateway.wait_until(lambda status: status["force_measured"] > 1000)
    if ends.startswith("a kill"):
        os.kill(gateway.ready["pids"]["control"], signal.SIGKILL)
        reconnect(gateway)
    else:
        gateway.process.send_signal(signal.SIGINT)  # with its connection open: who has left is lost
        assert gateway.process.wait(15) == stop(gateway) == 0
        gateway = start(state, "--sim", rig=str(rig))
    try:
        until_s = time.monotonic() + 0.5
        while time.monotonic() < until_s:
            assert gateway.write(0, *frame).exception_code == 3
            status = gateway.status()
            assert (status["state"], status["output_voltage"]) == (OFF, 0)
        assert not gateway.write(0, *frame[:4], 4712).isError(), "its program goes on"
    finally:
        stop(gateway)
