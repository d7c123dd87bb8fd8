"""Lines of control.sock that have waited behind others of their caller, which may have hung: no run goes on by them."""

import json
from pathlib import Path
from typing import Any

import pytest

from gateway.registers.words import State
from gateway.service.running_rig.calibration_runs import FOLLOWED_S
from tests.service.requests.stage import Stage
from tests.service.running_rig.runs.test_calibration_runs import PLAN, POLL_S, SHORT


@pytest.fixture
def stage(tmp_path: Path):
    stage = Stage(tmp_path)
    stage.wired.ready()
    yield stage
    stage.close()


def ask(stage: Stage, *, has_waited: bool, **fields: Any) -> dict[str, Any]:
    answer = stage.server.answer(json.dumps({"do": "calibrate"} | fields).encode(), has_waited=has_waited)
    assert isinstance(answer, bytes)
    return dict(json.loads(answer))


def test_no_run_begins_by_one(stage: Stage) -> None:
    refused = ask(stage, has_waited=True, plan=SHORT)
    assert not refused["ok"] and "wait for each answer" in refused["error"]
    stage.wired.run(0.1)
    assert stage.wired.state is State.OFF and not ask(stage, has_waited=False)["running"]
    assert ask(stage, has_waited=True, plan=SHORT, dry_run=True)["ok"], "nothing moves by this"


def test_no_run_is_followed_by_them(stage: Stage) -> None:
    """A caller's piled questions kept its run going for eleven seconds behind its end."""
    assert ask(stage, has_waited=False, plan=PLAN)["running"]
    for _ in range(round((FOLLOWED_S + 1.0) / POLL_S)):
        stage.wired.run(POLL_S)
        ask(stage, has_waited=True)
    assert "nobody at this machine" in ask(stage, has_waited=False)["ended"]


def test_a_run_is_stopped_by_one(stage: Stage) -> None:
    assert ask(stage, has_waited=False, plan=PLAN)["running"]
    ask(stage, has_waited=True, stop=True)
    stage.wired.until(lambda: not stage.calibration_runs.status()["running"], 1.0)
    assert "stopped at this machine" in stage.calibration_runs.status()["ended"]
