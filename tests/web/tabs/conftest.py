"""What the tests of the tabs share: a state directory with a recording, and the page on it."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gateway.recording import Recorder
from tests.web.tabs.scripted_control import ScriptedControl, modbus, scripted_control
from tests.web.tabs.served_tabs import ServedPage, serve

ROWS = 500


def record(state: Path, **facts: Any) -> Path:
    """Write the next recording: a force that follows a slow sine."""
    columns = ("time_s", "command_v", "force_n", "setpoint_n", "fault_code")
    recorder = Recorder(state / "recordings", {"rig": "demo", "calibration": 1, **facts}, columns)
    for row in range(ROWS):
        volts = 4.0 + 3.0 * math.sin(row / 80.0)
        recorder.append((row / 100.0, volts, 7.0 * volts, 20.0 if row < ROWS // 2 else 30.0, 0.0))
    recorder.close()
    return recorder.path


@pytest.fixture
def state(tmp_path: Path) -> Path:
    directory = tmp_path / "state"
    directory.mkdir()
    return directory


@pytest.fixture
def control(state: Path) -> Iterator[ScriptedControl]:
    with scripted_control(state) as control:
        yield control


@pytest.fixture
def served(control: ScriptedControl) -> ScriptedControl:
    """The same, which answers Modbus requests of the page, too."""
    answer = control.answer

    def answer_all(request: dict[str, Any]) -> dict[str, Any]:
        told = answer(request)
        return modbus(request) if request["do"] == "modbus" else told

    control.answer = answer_all  # type: ignore[method-assign]
    return control


@pytest.fixture
def page(state: Path) -> Iterator[ServedPage]:
    with serve(state) as page:
        yield page
