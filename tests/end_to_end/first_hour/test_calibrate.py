"""A calibration on the whole simulated gateway: from the command line to a stored number, and from a register bit."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gateway.bsfm import Bsfm
from gateway.calibrations.store import CalibrationStore
from gateway.profiles import load_calibration, load_rig
from gateway.recording import read_recording

OFF, CALIBRATING = 0, 5
PHASE, CHECK, LADDER, STOPPED = 126, 2, 3, 7
START_CALIBRATION = 1 << 5


def calibrated(state: Path, *options: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "gateway", "calibrate", "--yes", "--state", str(state), *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=400)


def volts_along(model: Bsfm, forces_n: list[float]) -> list[float]:
    """What control would put out on the way through these forces."""
    memory, at_n, volts = model.reversal.start(), model.force_range_n[0], []
    for force_n in forces_n:
        memory, at_n = model.memory_after(memory, at_n, force_n), force_n
        volts.append(model.voltage_v(force_n, model.branch_share(memory))[0])
    return volts


def test_a_quick_ladder_gives_a_numbered_calibration_that_agrees_with_the_shipped_one(patient) -> None:
    before = patient.words(122, 1)
    done = calibrated(patient.state, "--step", "1.5", "--groups", "1", "--minor", "13", "--response", "2", "--json")
    assert done.returncode == 0, done.stderr
    end = json.loads(done.stdout)
    patient.client.close()  # which has asked nothing for most of a minute, and may have been hung up on
    assert patient.client.connect()
    assert patient.words(PHASE, 3) == [6, 1000, end["stored"]]
    assert patient.words(122, 1) == before  # stored, not active
    assert patient.status()["state"] == OFF
    assert patient.status()["output_voltage"] == 0
    stored = CalibrationStore(patient.state, load_rig("demo").calibration).load(end["stored"])
    shipped = load_calibration("demo").model()
    asked = [5.0, 15.0, 30.0, 45.0, 60.0, 45.0, 30.0, 15.0, 5.0]
    assert volts_along(stored.model(), asked) == pytest.approx(volts_along(shipped, asked), abs=0.15)
    assert stored.rms_n < 0.4
    assert stored.response is not None
    assert stored.response.lag_s == pytest.approx(0.072, abs=0.015)
    assert stored.data_sha256 == end["fit"]["data_sha256"]
    assert Path(end["report"]).read_text(encoding="utf-8").startswith("<!doctype html>")
    header = read_recording(Path(end["recording"])).header
    assert header["ladder"]["groups"] == 1
    assert header["rig_fingerprint"][:12] in stored.source


def test_a_register_bit_starts_it_and_clearing_it_ends_it_with_the_data_kept(patient) -> None:
    assert not patient.write(0, START_CALIBRATION).isError()
    patient.wait_until(lambda status: status["state"] == CALIBRATING, within_s=3.0)
    patient.wait_until(lambda status: status["output_voltage"] > 500, within_s=5.0)
    assert patient.words(PHASE, 1) == [CHECK]
    refused = calibrated(patient.state)
    assert "W305" in refused.stderr
    assert refused.returncode == 1
    patient.write(0, 0)
    status = patient.wait_until(lambda status: status["state"] == OFF)
    assert status["output_voltage"] == 0
    assert patient.words(PHASE, 1) == [STOPPED]
    newest = max((patient.state / "recordings").glob("*.fgr"))
    assert read_recording(newest).header["ladder"]["stairs"] > 100


def test_a_person_who_goes_away_ends_the_run(patient, tmp_path: Path) -> None:
    told = tmp_path / "told"
    with told.open("w") as output:
        process = subprocess.Popen(
            [sys.executable, "-m", "gateway", "calibrate", "--yes", "--quick", "--state", str(patient.state)],
            stdout=output,
            stderr=output,
        )
    patient.wait_until(lambda status: status["output_voltage"] > 500 or process.poll() is not None, within_s=15.0)
    assert process.poll() is None, told.read_text()
    process.kill()
    process.wait()
    killed_s = time.monotonic()
    patient.wait_until(lambda status: status["state"] == OFF, within_s=6.0)
    assert "nobody at this machine" in patient.said("A330")
    assert time.monotonic() - killed_s < 5.0
    assert patient.words(PHASE, 1) == [STOPPED]
