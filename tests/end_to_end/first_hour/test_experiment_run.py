"""An experiment on the whole simulated gateway: from a plan file to a recording that `diagnose` takes."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from gateway.cli.main import command as gateway_command
from gateway.profiles.kinds.plans import plan_document
from gateway.recording import read_recording
from gateway.recording.measurement import measurement_of
from tests.profile_files import load_plan

OFF = 0
PHASE, RECORDED, STOPPED = 126, 10, 7
PLAN = """
name: short
shows: [load-dependent-friction]
columns: [pressure_kpa]
parts:
  - name: swings
    moves:
      - {do: ramp, to_n: 20, over_s: 0.5, hold_s: 0.5}
      - {do: reversals, size_v: 2.0, times: 2, over_s: 0.8}
      - {do: ladder, to_share: 0.1, stairs: 4, hold_s: 0.3}
"""


def command(state: Path, plan: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "gateway", *words(state, plan), *options]


def words(state: Path, plan: Path) -> list[str]:
    return ["calibrate", "--yes", "--state", str(state), "--plan", str(plan)]


def written(folder: Path, text: str) -> Path:
    file = folder / "plan.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def test_beyond_the_rig_it_is_refused_before_anything_moves(patient, tmp_path: Path) -> None:
    """The first test of the module, so that nothing has been run."""
    plan = written(tmp_path, PLAN.replace("to_n: 20", "to_n: 95"))
    done = CliRunner().invoke(gateway_command, words(patient.state, plan))
    assert done.exit_code == 1
    assert "plan short, part swings, move 1 (ramp): 95 N, allowed up to" in done.stderr
    spoilt = written(tmp_path, PLAN.replace("times: 2", "tims: 2"))
    done = CliRunner().invoke(gateway_command, words(patient.state, spoilt))
    assert done.exit_code == 78
    assert ":9:" in done.stderr
    assert "did you mean times?" in done.stderr
    assert patient.words(PHASE, 1) == [0]
    assert not list((patient.state / "recordings").glob("*.fgr"))


def test_a_plan_is_run_and_recorded_and_no_calibration_comes_of_it(patient, tmp_path: Path) -> None:
    plan = written(tmp_path, PLAN)
    done = subprocess.run(command(patient.state, plan, "--json"), capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    end = json.loads(done.stdout)
    assert (end["phase"], end["fit"]) == ("recorded", {})
    assert "demo: experiment short, 1 parts (swings) up to" in done.stderr
    assert patient.words(PHASE, 3) == [RECORDED, 1000, 0]
    status = patient.status()
    assert (status["state"], status["output_voltage"]) == (OFF, 0)
    assert not list((patient.state / "calibrations").glob("*.yaml"))
    recording = read_recording(Path(end["recording"]))
    assert recording.header["experiment"] == plan_document(load_plan(plan))
    assert "ladder" not in recording.header
    measured = measurement_of(recording)
    assert measured.command_v is not None
    assert measured.duration_s > 10.0
    assert np.ptp(measured.force_n) > 15.0
    swings_v = measured.command_v[measured.time_s > measured.duration_s - 4.0]
    assert len(np.unique(np.round(swings_v, 2))) > 40  # even ramps, not stairs, on a slow machine too


def test_ctrl_c_goes_to_zero_and_keeps_the_data(patient, tmp_path: Path) -> None:
    plan = written(tmp_path, PLAN)
    process = subprocess.Popen(command(patient.state, plan), stderr=subprocess.PIPE, text=True)
    patient.wait_until(lambda status: status["output_voltage"] > 500, within_s=15.0)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=10)
    assert process.returncode == -signal.SIGINT, "a shell's script ends with it"
    assert "the data are kept in" in said
    assert "--resume" not in said
    status = patient.wait_until(lambda status: status["state"] == OFF)
    assert status["output_voltage"] == 0
    assert patient.words(PHASE, 1) == [STOPPED]
