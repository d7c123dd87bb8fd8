"""A gateway under systemd, whose place a socket takes: it hears of the control loop, and of nothing else."""

import os
import signal
import socket
from collections.abc import Callable
from pathlib import Path

from tests.end_to_end.conftest import start, stop

Said = dict[str, str]


def wait_for(systemd: socket.socket, wanted: Callable[[Said], bool]) -> list[Said]:
    """Messages up to the wanted one; TimeoutError when it does not come."""
    heard: list[Said] = []
    while not heard or not wanted(heard[-1]):
        text = systemd.recv(4096).decode()
        heard.append(dict(line.split("=", 1) for line in text.splitlines()))
    return heard


def test_systemd_hears_of_the_loop_of_its_restart_and_of_the_end(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(10.0)
        service = {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "300000"}
        gateway = start(tmp_path / "state", "--sim", environment=os.environ | service)
        try:
            assert "modbus tcp" in wait_for(systemd, lambda said: said.get("READY") == "1")[-1]["STATUS"]
            beats = wait_for(systemd, lambda said: said == {"WATCHDOG": "1"})
            assert len(beats) == 1
            os.kill(gateway.ready["pids"]["control"], signal.SIGSTOP)  # the guardian lives, the loop stands
            told = wait_for(systemd, lambda said: "STATUS" in said)
            assert "started again" in told[-1]["STATUS"] and int(told[-1]["WATCHDOG_USEC"]) >= 60_000_000
            assert len(told) <= 3, "no beat but those that were on their way"
            wait_for(systemd, lambda said: said.get("READY") == "1" and said["WATCHDOG_USEC"] == "300000")
            gateway.next_ready()
        finally:
            stop(gateway)
        assert wait_for(systemd, lambda said: said.get("STOPPING") == "1")
