"""What a machine that stood still has broken is tried again, and nothing else is."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.gate.standstill import LATE_S, StandstillWitness
from tests.gate.tried_again import STOLEN_S

ROOT = Path(__file__).parents[2]
CONFTEST = """
from itertools import count
from tests.gate.tried_again import TriedAgain

readings = count()
def lost_s():
    return {{"cpu0": 1.0, "cpu1": 5.0 + {each_s} * min(next(readings), {most})}}

def pytest_configure(config):
    config.pluginmanager.register(TriedAgain(lambda nodeid: "pure" not in nodeid, lost_s))
"""
TESTS = """
import pytest

made = []

@pytest.fixture(scope="{scope}")
def machine():
    made.append(1)
    return len(made)

def test_{name}(machine):
    assert machine >= {passes_at}, "late"

def test_next(machine):
    pass
"""


LEAVING = """
import gc
import socket

import pytest

tries = []

@pytest.mark.parametrize("place", [1, 2])
def test_real(place):
    tries.append(place)
    left = [socket.socket()]
    left.append(left)
    assert tries.count(place) > 1
    left[0].close()

def test_pure_next():
    gc.collect()
"""


def run_in(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "no:hypothesispytest", *options, "."]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": ""}
    return subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.sampled
@pytest.mark.parametrize("scope", ["function", "module"])
@pytest.mark.parametrize(
    ("each_s", "name", "passes_at", "end"),
    [
        (0.1, "real", 2, "2 passed"),
        (0.1, "real", 3, "2 passed"),
        (0.1, "real", 4, "1 failed, 1 passed"),
        (0.04, "real", 2, "1 failed, 1 passed"),
        (0.1, "pure", 2, "1 failed, 1 passed"),
        (0.1, "real", 1, "2 passed"),
    ],
)
def test_only_what_has_failed_in_lost_time_is_tried_again(
    tmp_path: Path, scope: str, each_s: float, name: str, passes_at: int, end: str
) -> None:
    (tmp_path / "conftest.py").write_text(CONFTEST.format(each_s=each_s, most=99))
    (tmp_path / "test_it.py").write_text(TESTS.format(name=name, passes_at=passes_at, scope=scope))
    done = run_in(tmp_path)
    assert end in done.stdout
    assert ("tried again, for this machine stood still" in done.stdout) is (
        each_s == 0.1 and name == "real" and passes_at > 1
    )


BEHIND = """
tries = []

def test_real_before():
    pass

def test_pure():
    pass

def test_real():
    tries.append(1)
    assert len(tries) > {failing}
"""


@pytest.mark.parametrize(("failing", "end"), [(1, "3 passed"), (2, "1 failed, 2 passed")])
def test_what_stood_still_in_the_test_before_excuses_one_try(tmp_path: Path, failing: int, end: str) -> None:
    """A gateway that a module shares had its fault at the end of one test, which passed, and the next one found it."""
    (tmp_path / "conftest.py").write_text(CONFTEST.format(each_s=0.1, most=1))
    (tmp_path / "test_it.py").write_text(BEHIND.format(failing=failing))
    assert end in run_in(tmp_path).stdout


def test_what_a_failed_try_has_left_open_fails_no_other_test_and_not_the_run(tmp_path: Path) -> None:
    """Each is named, and passed; the run had failed all the same."""
    (tmp_path / "conftest.py").write_text(CONFTEST.format(each_s=0.1, most=99))
    (tmp_path / "test_it.py").write_text(LEAVING)
    done = run_in(tmp_path, "-W", "error")
    assert (done.returncode, done.stderr) == (0, "") and "3 passed" in done.stdout
    assert done.stdout.count(" ms; ") == 2, "nor the next try"


@pytest.fixture
def witness() -> Iterator[StandstillWitness]:
    one = StandstillWitness()
    yield one
    one.close()


def test_a_standstill_is_counted_by_what_it_took(witness: StandstillWitness) -> None:
    """Here of the witness alone, which cannot tell the difference."""
    began_s = time.monotonic()
    while not witness.lost_s():  # it may not have begun to look
        assert time.monotonic() < began_s + 10.0
        witness.process.send_signal(signal.SIGSTOP)
        time.sleep(0.2)
        witness.process.send_signal(signal.SIGCONT)
        witness.settle()
    assert STOLEN_S <= LATE_S <= witness.lost_s() < time.monotonic() - began_s


def test_who_asks_behind_a_standstill_waits_for_the_witness_to_wake(witness: StandstillWitness) -> None:
    """On a busy machine it woke 20 ms behind a test that had failed by it, which was not tried again."""
    witness.settle()
    witness.process.send_signal(signal.SIGSTOP)
    stopped_s, waking = time.monotonic(), threading.Timer(0.2, witness.process.send_signal, [signal.SIGCONT])
    waking.start()
    time.sleep(0.05)  # so that it has stopped
    witness.settle()
    assert time.monotonic() - stopped_s >= 0.2
    waking.join()
    assert witness.lost_s() >= LATE_S


def test_a_witness_does_not_outlive_who_has_begun_it() -> None:
    program = (
        "import os; from tests.gate.standstill import StandstillWitness as W; "
        "print(W().process.pid, flush=True); os._exit(0)"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    told = subprocess.run([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, check=True).stdout
    ends_s = time.monotonic() + 10.0
    while psutil.pid_exists(int(told)) and psutil.Process(int(told)).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < ends_s
        time.sleep(0.01)
