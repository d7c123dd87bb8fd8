"""What systemd does to the processes of a unit whose main process ends, or whose watchdog it misses (systemd.kill(5)), done to
a gateway: control must come to its last write before anybody is killed."""

import os
import select
import signal
import time
from pathlib import Path

import psutil
import pytest

from gateway.cli.system_service.unit_file import UnitOptions, unit_text
from tests.end_to_end.conftest import start, stop
from tests.end_to_end.kills.test_last_word import pressing
from tests.end_to_end.own_devices import OwnDevices

UNIT = unit_text(UnitOptions(command=Path("/usr/bin/true"), rig="own", stem="own"))
TELLS_ALL = "\nKillMode=control-group\n" in UNIT
TELLS_MAIN = "\nKillMode=mixed\n" in UNIT


def tell(pids: list[int], number: int) -> None:
    """As systemd tells: whoever is stopped is let go on, to hear of it."""
    for pid in pids:
        os.kill(pid, number)
        os.kill(pid, signal.SIGCONT)


def ended(descriptors: list[int], within_s: float) -> bool:
    """Whether all of these processes are gone in time."""
    return all(select.select([descriptor], [], [], within_s)[0] for descriptor in descriptors)


@pytest.mark.parametrize("watchdog", [False, True], ids=["killed", "watchdog"])
def test_control_writes_the_safe_voltage_when_systemd_finds_the_guardian_dead(tmp_path: Path, watchdog: bool) -> None:
    """With KillMode=mixed whoever is left is killed as soon as the main process is gone: 30 N stood until the next start, 10 s
    later, whenever control was not quicker than systemd. Here it has not been let run yet."""
    assert TELLS_ALL or TELLS_MAIN
    with OwnDevices(tmp_path) as devices:
        gateway = start(tmp_path / "state", rig=str(devices.rig))
        names = gateway.ready["pids"]
        main, others = names.pop("guardian"), list(names.values())
        gone = [os.pidfd_open(pid) for pid in (main, *others)]
        try:
            pressing(gateway)
            began_s = time.monotonic()
            os.kill(names["control"], signal.SIGSTOP)
            os.kill(main, signal.SIGSTOP if watchdog else signal.SIGKILL)
            if watchdog:
                tell([main, *(others if TELLS_ALL else [])], signal.SIGABRT)
            assert ended(gone[:1], 5.0)
            tell(others, signal.SIGTERM if TELLS_ALL else signal.SIGKILL)
            assert ended(gone, 5.0), "nobody is left to be killed"
            devices.until_safe(began_s)  # written before they ended; the far end may come to it later
            assert devices.setting_v == 0.0
        finally:
            stop(gateway)
            for descriptor in gone:
                os.close(descriptor)


def test_a_simulated_service_that_is_stopped_ramps_down_and_says_nothing_else(tmp_path: Path) -> None:
    """Its simulated rig was told to end, too, and did: `safe voltage not acknowledged: the tool may still press`."""
    gateway = start(tmp_path / "state", "--sim", "--metrics", "127.0.0.1:0")
    assert not gateway.write(0, 1, 2000).isError()
    gateway.wait_until(lambda status: status["force_measured"] > 1800)
    lines = len(gateway.log.read_text().splitlines())
    children = psutil.Process(gateway.process.pid).children(recursive=True)
    tell([gateway.process.pid, *(child.pid for child in children)], signal.SIGTERM)
    assert gateway.process.wait(15) == 0
    stop(gateway)
    said = gateway.log.read_text().splitlines()[lines:]
    assert [line for line in said if " error " in line or "A346" in line] == []
    assert said[-1].endswith("force ramped to 0, output disabled")
    assert not any(child.is_running() and child.status() != psutil.STATUS_ZOMBIE for child in children)
