"""The fit that a finished ladder is given to: all of it or nothing, and never in the control process."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gateway.bsfm.fit.evaluation import FitRequest
from gateway.bsfm.ladder.ladder_error import LadderError
from gateway.bsfm.model import Response
from gateway.calibrations.store import CalibrationStore
from gateway.profiles import load_rig
from gateway.recording import Recorder
from gateway.service.fitting.fit_process import fit_and_store
from gateway.service.fitting.ladder_fit import calibration_of, fit_recording
from gateway.service.fitting.ladder_source import RigContext, read_source

COLUMNS = ("time_s", "command_v", "force_n")


def recorded(state: Path, rig: str = "demo", force: float = 1.0, facts: dict[str, Any] | None = None) -> Path:
    """Two groups 0 .. 6 V in steps of 0.5 V on a loop 3 N wide, 10 Hz."""
    up = np.arange(0.0, 6.01, 0.5).tolist()
    rng, force_n, time_s = np.random.default_rng(3), 0.0, 0.0
    header = {"rig": rig, "rig_fingerprint": "f" * 64} | (facts or {})
    recorder = Recorder(state / "recordings", header, COLUMNS)
    for volts in [*(up + up[-2::-1]) * 2, 0.0]:
        for _ in range(5):
            recorder.append((time_s, volts, force * force_n + rng.normal(0.0, 0.05)))
            time_s += 0.1
            force_n = float(np.clip(force_n, 8.0 * volts - 1.5, 8.0 * volts + 1.5))
    recorder.close()
    return recorder.path


def test_a_ladder_becomes_a_numbered_calibration_with_report_and_provenance(tmp_path: Path) -> None:
    result = fit_and_store(recorded(tmp_path), "demo", tmp_path)
    stored = CalibrationStore(tmp_path, load_rig("demo").calibration).load(result["stored"])
    assert (stored.rig, stored.x0_v, stored.x1_v) == ("demo", 0.0, 6.0)
    assert "0001.fgr" in stored.source
    assert "f" * 12 in stored.source
    assert stored.model().force_n(3.0, 1.0) == pytest.approx(22.5, abs=0.5)
    assert stored.model().force_n(3.0, -1.0) == pytest.approx(25.5, abs=0.5)
    assert stored.noise_n == pytest.approx(0.05, rel=0.3)
    document = json.loads(Path(result["document"]).read_text(encoding="utf-8"))
    assert document["calibration"] == result["stored"]
    assert f"Calibration {result['stored']}" in Path(result["report"]).read_text(encoding="utf-8")


def test_what_the_cell_of_the_rig_cannot_hold_may_not_drive_it(tmp_path: Path) -> None:
    """Handles beyond its range would be commanded, and never measured."""
    context = RigContext(rig="demo", state=tmp_path)
    fit = fit_recording(read_source(recorded(tmp_path)), FitRequest(orders=(1,)), context, "mine")
    taken = calibration_of(fit, 60.0)
    assert taken.name == "mine" and taken.response == fit.measured.response
    with pytest.raises(LadderError, match=r"E401 the chosen model may not drive the rig: .* -40 \.\. 40 is allowed"):
        calibration_of(fit, 40.0)
    followed = replace(fit, measured=replace(fit.measured, response=Response(dead_time_s=0.1, lag_s=0.2)))
    assert calibration_of(followed, 60.0).response == Response(dead_time_s=0.1, lag_s=0.2)


@pytest.mark.parametrize(
    ("facts", "words"),
    [({"rig": "irc5-cell"}, "recorded on rig irc5-cell"), ({"force": -1.0}, "sign"), ({"force": 0.102}, "kgf")],
)
def test_what_is_refused_leaves_nothing_but_the_recording(facts: dict[str, str], words: str, tmp_path: Path) -> None:
    path = recorded(tmp_path, **facts)
    result = fit_and_store(path, "demo", tmp_path)
    assert words in result["refused"]
    assert [file for file in tmp_path.rglob("*") if file.is_file()] == [path]


def test_a_recording_that_is_none_is_told_on_one_line(tmp_path: Path) -> None:
    path = tmp_path / "none.fgr"
    path.write_bytes(b"\x89FGR1\r\n\ncut")
    asked = json.dumps({"recording": str(path), "rig": "demo", "state": str(tmp_path)})
    done = subprocess.run(
        [sys.executable, "-m", "gateway.service.fitting.fit_process", asked],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 65
    assert "E403" in json.loads(done.stdout)["refused"]
