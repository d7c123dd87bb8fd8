"""What the three processes of a running gateway have loaded: the kernel's own list, so that a late import counts too."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.cli.lean import lean_environment
from tests.end_to_end.conftest import start, stop

HEAVY = ("scipy", "pandas", "matplotlib", "jinja2", "pyarrow", "numba", "llvmlite", "cryptography")


def mapped(pid: int) -> set[str]:
    """Files that a process has mapped: its extension modules among them."""
    lines = Path(f"/proc/{pid}/maps").read_text().splitlines()
    return {line.split(maxsplit=5)[5] for line in lines if line.count("/") > 1}


def heavy_files(pid: int, *others: str) -> list[str]:
    """Files of heavy libraries, and of others, that a process has mapped."""
    return [file for file in mapped(pid) for name in (*HEAVY, *others) if f"/{name}" in file]


def loaded_by(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def until_behind(watch: int) -> None:
    deadline_s = time.monotonic() + 5.0
    while os.sched_getscheduler(watch) != os.SCHED_IDLE:
        assert time.monotonic() < deadline_s
        time.sleep(0.02)


def test_the_watch_stands_behind_everybody_and_loads_nothing_before_it_must(rested):
    watch = rested.ready["pids"]["watch"]
    until_behind(watch)
    assert int(Path(f"/proc/{watch}/oom_score_adj").read_text()) == 900
    assert os.getpriority(os.PRIO_PROCESS, watch) >= 10
    assert heavy_files(watch, "numpy") == []


def test_nobody_who_holds_the_force_maps_anything_heavy_while_it_works(rested):
    """Control, the simulated rig and what they are forked from: with a force commanded, a recording, the float blocks read
    and a refusal, nothing is left to load later."""
    assert not rested.write(0, 1, 1000).isError()
    rested.wait_until(lambda status: status["state"] == 3)
    rested.words(200, 60)
    rested.write(1, 6500)
    done = subprocess.run(
        [sys.executable, "-m", "gateway", "record", "on", "--state", str(rested.state)],
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for name in ("control", "rig", "fork_server"):
        assert heavy_files(rested.ready["pids"][name]) == [], name


def test_the_guardian_maps_no_numpy(rested):
    guardian = rested.ready["pids"]["guardian"]
    assert mapped(guardian), "the list can be read"
    assert heavy_files(guardian, "numpy", "pydantic_core", "yaml") == []


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import gateway.service.control_process, gateway.service.simulated_rig", {*HEAVY, "pymodbus", "rich"}),
        (
            "import gateway.service.supervisor.guardian",
            {*HEAVY, "numpy", "asyncio", "yaml", "pydantic", "serial", "click"},
        ),
    ],
)
def test_each_process_imports_only_what_it_needs(statement, absent):
    assert loaded_by(statement).isdisjoint(absent)


def test_the_watch_loads_nothing_of_the_rig_before_there_is_a_window():
    """It waits for that beside a gateway that starts, and takes no processor from it meanwhile."""
    code = """
import socket, sys, time
from gateway.watch import watch_process

guardian, link = socket.socketpair()
watch_process.yield_to_others = lambda: None  # in the idle class it would wait for the other tests
time.sleep = lambda window_s: print(window_s, *sys.modules) or sys.exit()
watch_process.main([str(link.detach()), '{"ring": 0, "state": "", "window_s": 60, "every_s": 20}'])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    waited_s, *modules = done.stdout.split()
    assert waited_s == "60"
    rooms = {name.split(".")[1] for name in modules if name.startswith("gateway.")}
    assert rooms.isdisjoint({"profiles", "recording", "control", "devices", "registers", "twin", "diagnosis"})
    assert {"numpy", "yaml", "pydantic"}.isdisjoint(modules)


def test_a_gateway_without_the_extra_holds_a_force_and_records(tmp_path):
    """Only the residual watch is off, and one line says so."""
    gateway = start(tmp_path / "state", "--sim", "--record", environment=lean_environment(tmp_path))
    try:
        assert not gateway.write(0, 1, 1000).isError()
        gateway.wait_until(lambda status: abs(status["force_measured"] - 1000) < 100)
        assert "watch" not in gateway.ready["pids"]
    finally:
        assert stop(gateway) == 0
    kept = (tmp_path / "state" / "events.jsonl").read_text().splitlines()
    said = [line for line in kept if "the residual watch is off: numba is not installed" in line]
    assert len(said) == 1
    assert len([note for note in gateway.ready["notes"] if note.startswith("E160")]) == 1
    assert list((tmp_path / "state" / "recordings").glob("*.fgr"))
