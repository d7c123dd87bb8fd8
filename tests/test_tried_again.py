"""What a host that takes a processor away has broken is tried again, and nothing else is."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CONFTEST = """
from itertools import count
from tests.tried_again import TriedAgain

readings = count()
def stolen_s():
    return {{"cpu0": 1.0, "cpu1": 5.0 + {each_s} * next(readings)}}

def pytest_configure(config):
    config.pluginmanager.register(TriedAgain(lambda nodeid: "pure" not in nodeid, stolen_s))
"""
TESTS = """
import pytest

made = []

@pytest.fixture
def machine():
    made.append(1)
    return len(made)

def test_{name}(machine):
    assert machine >= {passes_at}, "late"
"""


@pytest.mark.parametrize(
    ("each_s", "name", "passes_at", "end"),
    [
        (0.1, "real", 2, "1 passed"),
        (0.1, "real", 3, "1 passed"),
        (0.1, "real", 4, "1 failed"),
        (0.04, "real", 2, "1 failed"),
        (0.1, "pure", 2, "1 failed"),
        (0.1, "real", 1, "1 passed"),
    ],
)
def test_only_what_has_failed_in_stolen_time_is_tried_again(
    tmp_path: Path, each_s: float, name: str, passes_at: int, end: str
) -> None:
    (tmp_path / "conftest.py").write_text(CONFTEST.format(each_s=each_s))
    (tmp_path / "test_it.py").write_text(TESTS.format(name=name, passes_at=passes_at))
    words = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "no:hypothesispytest", "."]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": ""}
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert end in done.stdout
    assert ("tried again, for this machine's host" in done.stdout) is (
        each_s == 0.1 and name == "real" and passes_at > 1
    )
