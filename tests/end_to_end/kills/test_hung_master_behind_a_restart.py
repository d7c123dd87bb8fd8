"""A program that hung, whose last frame flows on, behind a killed control process and behind a restart of the service."""

import os
import signal
import time
from pathlib import Path

from tests.end_to_end.conftest import RunningGateway, start, stop
from tests.end_to_end.kills.test_processes import OFF, reconnect

FRAME = 1, 1200, 0, 0
"""Behind it stands a heartbeat."""


def test_the_last_frame_of_a_program_that_hung_presses_nothing_behind(tmp_path: Path) -> None:
    """12 N were held until somebody came: of that master the next process knew nothing, for it was no lost one yet."""
    text = (Path(__file__).parents[3] / "profiles" / "rigs" / "demo.yaml").read_text()
    rig, state = tmp_path / "leased.yaml", tmp_path / "state"
    rig.write_text(
        text.replace("name: demo", "name: leased").replace("  lease_s: null", "  lease_s: 5.0\n  lease_action: hold")
    )
    gateway = start(state, "--sim", rig=str(rig))
    try:
        assert not gateway.write(0, *FRAME, 4711).isError()
        gateway.wait_until(lambda status: status["force_measured"] > 1000)
        os.kill(gateway.ready["pids"]["control"], signal.SIGKILL)
        reconnect(gateway)
        assert_goes_on_by_a_new_heartbeat_only(gateway, 4711)
        gateway.wait_until(lambda status: status["force_measured"] > 1000)
        gateway.process.send_signal(signal.SIGINT)  # with its connection open: who has left is lost
        assert gateway.process.wait(15) == stop(gateway) == 0
        gateway = start(state, "--sim", rig=str(rig))
        assert_goes_on_by_a_new_heartbeat_only(gateway, 4712)
    finally:
        stop(gateway)


def assert_goes_on_by_a_new_heartbeat_only(gateway: RunningGateway, heartbeat: int) -> None:
    until_s = time.monotonic() + 0.5
    while time.monotonic() < until_s:
        assert gateway.write(0, *FRAME, heartbeat).exception_code == 3
        status = gateway.status()
        assert (status["state"], status["output_voltage"]) == (OFF, 0)
    assert not gateway.write(0, *FRAME, heartbeat + 1).isError(), "its program goes on"
