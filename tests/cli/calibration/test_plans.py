"""`diagnose --plan` writes what `calibrate --plan` runs, and says so; an experiment takes no options of a ladder."""

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

import gateway.diagnosis
from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.diagnosis.result import Diagnosis
from tests.profile_files import load_plan
from tests.reports.fake_diagnosis import FRICTION, WARMTH, command_v, diagnosis

Call = Callable[..., Result]


def table(path: Path) -> Path:
    lines = "\n".join(f"{k / 200.0:.4f},{volts:.4f},{8.5 * volts:.4f}" for k, volts in enumerate(_volts()))
    path.write_text(f"# rig: demo\ntime_s,command_v,force_n\n{lines}\n", encoding="utf-8")
    return path


def _volts() -> list[float]:
    import numpy as np

    return [float(volts) for volts in command_v(np.arange(1000) / 200.0)]


def answering(monkeypatch: pytest.MonkeyPatch, answer: Diagnosis) -> None:
    monkeypatch.setattr(gateway.diagnosis, "diagnose", lambda *requests: answer)


def test_the_plan_is_written_and_named_in_terminal_and_report(
    tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    answering(monkeypatch, diagnosis(causes=(FRICTION, WARMTH)))
    plan, page = tmp_path / "next.yaml", tmp_path / "r.html"
    answer = call("diagnose", str(table(tmp_path / "a.csv")), "--plan", str(plan), "--report", str(page))
    assert answer.exit_code == 0, answer.output
    written = load_plan(plan)
    assert isinstance(written, ExperimentPlan)
    assert {*WARMTH.group} <= set(written.shows)
    text = plan.read_text(encoding="utf-8")
    assert "# Not in it: tilt-gravity: record tilt_deg; turn the tool" in text
    assert "# Besides: warm the cell up" in text
    assert f"force-gateway calibrate --plan {plan}" in page.read_text(encoding="utf-8")
    sentence = "".join(answer.stdout.split())
    assert f"force-gatewaycalibrate--plan{plan}runsit:" in sentence


def test_without_the_option_the_terminal_names_it(tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    answering(monkeypatch, diagnosis())
    answer = call("diagnose", str(table(tmp_path / "a.csv")))
    assert "--plan PLAN.yaml writes" in answer.stdout
    answering(monkeypatch, diagnosis(not_identifiable=(), experiments=()))
    assert "--plan" not in call("diagnose", str(tmp_path / "a.csv")).stdout


def test_with_nothing_to_plan_it_says_so_and_writes_nothing(
    tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    answering(monkeypatch, diagnosis(not_identifiable=()))
    plan = tmp_path / "next.yaml"
    answer = call("diagnose", str(table(tmp_path / "a.csv")), "--plan", str(plan))
    assert answer.exit_code == 0
    assert "nothing to plan" in answer.stderr
    assert not plan.exists()


def test_the_plan_never_overwrites_the_recording(tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    answering(monkeypatch, diagnosis())
    recording = table(tmp_path / "a.csv")
    answer = call("diagnose", str(recording), "--plan", str(recording))
    assert answer.exit_code == 2
    assert "would be overwritten" in answer.stderr


def test_an_experiment_takes_no_options_of_a_ladder(tmp_path: Path, call: Call) -> None:
    plan = tmp_path / "p.yaml"
    plan.write_text("name: x\nparts:\n  - {name: a, moves: [{do: step, to_v: 1, hold_s: 1}]}\n", encoding="utf-8")
    answer = call("calibrate", "--plan", str(plan), "--groups", "3", "--state", str(tmp_path))
    assert answer.exit_code == 2
    assert "is an experiment" in answer.stderr


def test_a_bad_plan_ends_with_its_lines_before_any_gateway_is_asked(tmp_path: Path, call: Call) -> None:
    plan = tmp_path / "p.yaml"
    plan.write_text("name: x\nparts:\n  - {name: a, moves: [{do: jump, to_v: 1}]}\n", encoding="utf-8")
    answer = call("calibrate", "--plan", str(plan), "--state", str(tmp_path))
    assert answer.exit_code == 78
    assert "p.yaml:3:28 parts[0].moves[0].do: jump is not one of" in answer.stderr
