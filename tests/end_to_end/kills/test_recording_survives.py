"""A recording of a running gateway, from its command line, and what is left of it after kill -9."""

import csv
import io
import os
import re
import signal
import time
from pathlib import Path

from click.testing import CliRunner

from gateway.cli.main import command

BATCH_S = 0.1


def gateway_says(*words: str | Path) -> str:
    done = CliRunner().invoke(command, [*map(str, words)])
    assert done.exit_code == 0, done.stderr
    return done.stdout + done.stderr


def exported(state: Path, number: int) -> list[dict[str, str]]:
    text = gateway_says("recordings", "export", str(number), "--csv", "-o", "-", "--state", state)
    lines = [line for line in text.splitlines() if line and not line.startswith("#") and "," in line]
    return list(csv.DictReader(io.StringIO("\n".join(lines))))


def begun(state: Path) -> int:
    """Number of the recording that begins now."""
    said = re.search(r"recording to .*?(\d{4})\.fgr", gateway_says("record", "on", "--state", state))
    assert said
    return int(said[1])


def test_on_and_off_records_what_was_pressed(rested):
    state = rested.state
    number = begun(state)
    rested.write(0, 1, 1500)
    rested.wait_until(lambda status: status["state"] == 3)
    assert "rows" in gateway_says("record", "off", "--state", state)
    rows = exported(state, number)
    assert len(rows) > 20, "a step and its time in band at 100 Hz"
    assert {float(row["setpoint_n"]) for row in rows[-10:]} == {15.0}
    assert abs(float(rows[-1]["force_n"]) - 15.0) <= 1.0
    times_s = [float(row["time_s"]) for row in rows]
    assert times_s == sorted(times_s)


def test_kill_minus_nine_loses_at_most_one_batch(rested):
    state = rested.state
    number = begun(state)
    began_s = time.monotonic()
    rested.write(0, 1, 1200)
    rested.wait_until(lambda status: status["state"] == 3)
    held_from_s = time.monotonic()  # in band takes as long as a batch does: the last row kept may be of the rise
    rested.wait_until(lambda status: status["state"] == 3 and time.monotonic() > held_from_s + 3 * BATCH_S)
    os.kill(rested.ready["pids"]["control"], signal.SIGKILL)
    lasted_s = time.monotonic() - began_s
    rows = exported(state, number)
    assert float(rows[-1]["time_s"]) >= lasted_s - BATCH_S - 0.05
    assert abs(float(rows[-1]["force_n"]) - 12.0) <= 1.0
    assert re.search(rf"^ *{number} ", gateway_says("recordings", "list", "--state", state), re.MULTILINE)
    rested.said("it goes on behind the restart: recording to")
    assert f"{number + 1:04}.fgr" in gateway_says("record", "status", "--state", state)
    assert f"{number + 1:04}.fgr" in gateway_says("record", "off", "--state", state)
