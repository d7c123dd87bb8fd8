"""The verbs against a whole gateway: an upload, another calibration and back, while it presses. They run in the test's own
process: what a process of their own adds, tests/cli asks once."""

import json
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from gateway.calibrations.store import CalibrationStore
from gateway.cli.main import command
from gateway.profiles import load_calibration
from gateway.profiles.find import locate
from tests.calibrations.coefficients import calibration
from tests.end_to_end.conftest import start, stop

RAMPING, HOLDING = 2, 3


def verb(*words: object, code: int = 0) -> Any:
    done = CliRunner().invoke(command, [*map(str, words), "--json"])
    assert done.exit_code == code, done.stderr
    return json.loads(done.stdout) if done.stdout else done.stderr


def test_upload_use_and_rollback_while_the_gateway_presses(running, tmp_path: Path):
    at, in_state = ("--gateway", f"127.0.0.1:{running.port}"), ("--state", running.state)
    running.write(0, 1, 2000)
    running.wait_until(lambda status: status["state"] == HOLDING)
    other = tmp_path / "other.yaml"
    last_n = str(load_calibration("demo").rising_handles_n[-1])
    other.write_text((locate("calibration", "demo")).read_text().replace(last_n, "65.4"))
    assert verb("upload", other, "--slot", 3, *at) == {
        "sent": True,
        "committed": True,
        "active": 2,
        "slot": 3,
        "known": False,
    }
    assert running.words(1644, 1) == [3]
    assert verb("calibration", "use", 1, *in_state)["built_in"]
    assert (running.words(122, 1), running.words(1644, 1)) == ([1], [0xFFFF])
    assert verb("calibration", "rollback", *in_state)["active"] == 2
    assert (running.words(122, 1), running.words(1644, 1)) == ([2], [3])
    assert verb("calibration", "use", 7, *in_state, code=65).startswith("E433 there is no calibration 7")
    assert running.words(122, 1) == [2]
    status = running.status()
    assert status["state"] in (RAMPING, HOLDING)
    assert abs(status["force_measured"] - 2000) <= 150
    assert CalibrationStore(running.state).find_selected().selection.number == 2


def test_a_gateway_starts_with_what_was_last_in_use_and_says_what_it_had_to_pass_over(tmp_path: Path):
    store = CalibrationStore(tmp_path / "state", load_calibration("demo"))
    for mark in (16, 24):
        store.use(store.add(calibration(mark)), mark // 8)
    gateway = start(tmp_path / "state", "--sim")
    seen = gateway.words(122, 1), gateway.words(1644, 1), gateway.ready["notes"]
    stop(gateway)
    assert seen[:2] == ([3], [3])
    assert seen[2] == [f"calibration 3 of 2026-11-21 from {store.directory}"]
    (store.directory / "0003.yaml").write_bytes(b"number: 3\n")
    gateway = start(tmp_path / "state", "--sim")
    seen = gateway.words(122, 1), gateway.words(1644, 1), gateway.ready["notes"]
    stop(gateway)
    assert seen[:2] == ([2], [2])
    assert seen[2][0].startswith("E432 ") and "0003.yaml" in seen[2][0]
