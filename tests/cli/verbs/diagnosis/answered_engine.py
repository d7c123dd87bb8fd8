"""An engine of the diagnosis that answers what a test wants, and a table for it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gateway.diagnosis
from gateway.diagnosis.result import Diagnosis
from gateway.twin import Plant
from tests.reports.fake_diagnosis import command_v, diagnosis


class Engine:
    """Answers what it is told to, and remembers what it was asked."""

    def __init__(self) -> None:
        self.answer: Diagnosis = diagnosis()
        self.asked: list[tuple[Any, Plant, Any]] = []

    def __call__(self, measurements: Any, plant: Plant, options: Any) -> Diagnosis:
        self.asked.append((measurements, plant, options))
        return self.answer


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> Engine:
    engine = Engine()
    monkeypatch.setattr(gateway.diagnosis, "diagnose", engine)
    return engine


def rows(seconds: float = 5.0) -> np.ndarray:
    time_s = np.arange(round(200 * seconds)) / 200.0
    volts = command_v(time_s)
    return np.stack([time_s, volts, 8.5 * volts], axis=1)


def table(path: Path, head: str = "time_s,command_v,force_n", facts: str = "# rig: demo\n") -> Path:
    lines = "\n".join(",".join(f"{value:.6g}" for value in row) for row in rows())
    path.write_text(f"{facts}{head}\n{lines}\n", encoding="utf-8")
    return path
