"""`diagnose`: what is asked for is written whole or not at all, what is wrong is said, and scripts can rely on the exit code.

The engine is replaced by an answer made by hand; what it finds is judged elsewhere.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result

from gateway.calibrations.store import CalibrationStore, as_text
from gateway.cli.diagnosis.outputs import write_all
from gateway.diagnosis.result import Verdict
from gateway.profiles import load_plant, load_rig, shipped_profiles_folder
from gateway.recording import Recorder, export_csv, read_recording
from gateway.service.closed_loop.study import ClosedLoopGain
from gateway.twin import Plant
from tests.cli.verbs.diagnosis.answered_engine import Engine, engine, rows, table
from tests.reports.fake_diagnosis import FRICTION, WARMTH, diagnosis

__all__ = ["engine"]

Call = Callable[..., Result]


def test_the_terminal_says_verdict_cause_gain_and_what_to_record_next(
    tmp_path: Path, call: Call, engine: Engine
) -> None:
    answer = call("diagnose", str(table(tmp_path / "a.csv")))
    assert answer.exit_code == 0, answer.output
    for text in (
        "a.csv · rig demo · plant paper-slide", "Load-dependent-friction explains part of the difference: ", "1.186 → 0.257",
        "friction.load_dependent_n_per_n = 0.0497 N/N [0.0482, 0.0511]", "depends on temperature_c", "rejected",
        "next      dwell 60 s at 20 N",
    ):  # fmt: skip
        assert text in answer.stdout


@pytest.mark.parametrize("width", [60, 80, 120])
def test_nothing_is_wider_than_the_terminal(
    tmp_path: Path, call: Call, engine: Engine, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    engine.answer = diagnosis(causes=(FRICTION, WARMTH))
    answer = call("diagnose", str(table(tmp_path / "a.csv")))
    assert max(map(len, answer.stdout.splitlines())) <= width
    for figure in ("0.98", "1.186 → 0.257", "0.929 [0.871, 0.986]", "96 %", FRICTION.name, f"or {WARMTH.group[1]}"):
        assert figure in answer.stdout, "cut off"


def test_files_are_written_and_the_plant_is_a_plant(tmp_path: Path, call: Call, engine: Engine) -> None:
    path = table(tmp_path / "a.csv")
    names = [tmp_path / name for name in ("out.json", "out.html", "stiffer.yaml")]
    answer = call("diagnose", str(path), "--json", str(names[0]), "--report", str(names[1]), "--extend", str(names[2]))
    assert answer.exit_code == 0, answer.output
    assert json.loads(names[0].read_text())["causes"][0]["name"] == "load-dependent-friction"
    assert "<h1>Load-dependent-friction explains part" in names[1].read_text(encoding="utf-8")
    profile = load_plant(names[2])
    assert profile.plant == engine.answer.plant and profile.name == "stiffer"
    assert sorted(tmp_path.iterdir()) == sorted([path, *names])
    for name in names:
        assert f"wrote {name}" in answer.stderr


def test_json_to_stdout_is_nothing_but_json(tmp_path: Path, call: Call, engine: Engine) -> None:
    answer = call("diagnose", str(table(tmp_path / "a.csv")), "--json", "-")
    assert json.loads(answer.stdout)["verdict"] == "partial"


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("verdict", "fail_on", "code"),
    [
        ("nothing-found", None, 0), ("unknown", None, 0), ("confirmed", "partial", 0), ("partial", "partial", 1),
        ("unknown", "partial", 1), ("partial", "unknown", 0), ("unknown", "unknown", 1), ("nothing-found", "partial", 0),
    ],
)  # fmt: skip
def test_exit_code_1_only_for_what_fail_on_asks(
    tmp_path: Path, call: Call, engine: Engine, verdict: str, fail_on: str | None, code: int
) -> None:
    engine.answer = diagnosis(verdict=Verdict(verdict))
    target = tmp_path / "out.json"
    words = ["--json", str(target), *(["--fail-on", fail_on] if fail_on else [])]
    assert call("diagnose", str(table(tmp_path / "a.csv")), *words).exit_code == code
    assert target.exists()


def test_what_is_known_goes_to_the_engine(tmp_path: Path, call: Call, engine: Engine) -> None:
    first, second = table(tmp_path / "a.csv"), table(tmp_path / "b.csv", facts="# rig: demo\n# of another day\n")
    call("diagnose", str(first), str(second), "--without", "coulomb-friction", "--noise-floor-n", "0.1")
    measurements, plant, options = engine.asked[0]
    assert [measurement.name for measurement in measurements] == ["a.csv", "b.csv"]
    assert plant == load_plant("paper-slide").plant
    assert (options.without, options.noise_floor_n) == ("coulomb-friction", 0.1)


def test_foreign_columns_are_mapped(tmp_path: Path, call: Call, engine: Engine) -> None:
    path = table(tmp_path / "a.csv", head="when,u,load")
    answer = call("diagnose", str(path), "--columns", "time_s=1,command_v=u:mv,force_n=3:n")
    assert answer.exit_code == 0, answer.output
    assert np.allclose(engine.asked[0][0][0].command_v, rows()[:, 1] / 1000.0, atol=1e-6)


def test_a_recording_of_the_gateway_brings_its_own_plant(tmp_path: Path, call: Call, engine: Engine) -> None:
    rig, plant = (shipped_profiles_folder() / kind for kind in ("rigs/demo.yaml", "plants/paper-slide.yaml"))
    changed = plant.read_text(encoding="utf-8").replace("coulomb_n: {value: 1.0,", "coulomb_n: {value: 3.5,")
    texts = {"rigs/demo.yaml": rig.read_text(encoding="utf-8"), "plants/paper-slide.yaml": changed}
    recorder = Recorder(
        tmp_path / "recordings", {"rig": "demo", "rig_texts": texts}, ("time_s", "command_v", "force_n")
    )
    for row in rows():
        recorder.append(tuple(row))
    recorder.close()
    answer = call("diagnose", "1", "--state", str(tmp_path))
    assert answer.exit_code == 0, answer.output
    assert engine.asked[0][1].friction.coulomb_n == 3.5


def own_recording(state: Path, **header: Any) -> Path:
    """One of the gateway's own, on the shipped demo rig."""
    rig = load_rig("demo")
    facts = {"rig": "demo", "rig_texts": dict(rig.texts)} | header
    recorder = Recorder(state / "recordings", facts, ("time_s", "command_v", "force_n"))
    for row in rows():
        recorder.append(tuple(row))
    recorder.close()
    return recorder.path


def test_a_recording_carries_the_noise_of_its_calibration(tmp_path: Path, call: Call, engine: Engine) -> None:
    """None where the calibration was made before noise was kept; an exported table carries it as well."""
    file = own_recording(tmp_path, calibration_noise_n=0.08)
    export_csv(read_recording(file), tmp_path / "out.csv")
    old = own_recording(tmp_path / "old", calibration=3)
    for name in (file, tmp_path / "out.csv", old):
        assert call("diagnose", str(name)).exit_code == 0
    assert [options.calibration_noise_n for _, _, options in engine.asked] == [0.08, 0.08, None]


def test_a_calibration_that_is_named_tells_the_noise(tmp_path: Path, call: Call, engine: Engine) -> None:
    """By its number in the state directory, by file, or as the one in use on the rig that --rig names."""
    store = CalibrationStore(tmp_path, load_rig("demo").calibration)
    number = store.add(replace(load_rig("demo").calibration, noise_n=0.05))
    file = table(tmp_path / "a.csv")
    for words in ("--calibration", str(number)), ("--rig", "demo"):
        assert call("diagnose", str(file), "--state", str(tmp_path), *words).exit_code == 0
    assert [options.calibration_noise_n for _, _, options in engine.asked] == [
        0.05,
        load_rig("demo").calibration.noise_n,
    ]


def test_a_calibration_without_noise_is_valid_and_says_so(tmp_path: Path, call: Call, engine: Engine) -> None:
    old = tmp_path / "old.yaml"
    old.write_text(as_text(replace(load_rig("demo").calibration, noise_n=0.0)).replace("noise_n: 0.0\n", ""))
    answer = call("diagnose", str(table(tmp_path / "a.csv")), "--calibration", str(old))
    assert answer.exit_code == 0, answer.output
    assert "calibration demo carries no noise of the cell" in " ".join(answer.stdout.split())
    assert engine.asked[0][2].calibration_noise_n is None


def test_a_table_without_a_rig_says_which_plant_is_the_start(tmp_path: Path, call: Call, engine: Engine) -> None:
    answer = call("diagnose", str(table(tmp_path / "a.csv", facts="")))
    assert "the recording names no rig: the plant paper-slide without its effects is the start" in " ".join(
        answer.stdout.split()
    )


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "empty"), ("time_s,force_n\n0,1\n", "no column command_v"), ("time_s,command_v,force_n\n0,1,2\n", "1 rows"),
        ("time_s,command_v,force_n\n0,1,2\n1,1,x\n", "a.csv:3"),
    ],
)  # fmt: skip
def test_bad_input_is_said_with_its_place_and_nothing_is_written(
    tmp_path: Path, call: Call, engine: Engine, text: str, sentence: str
) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    outputs = [f"--{option}={tmp_path / option}" for option in ("json", "report", "extend")]
    answer = call("diagnose", str(path), *outputs)
    assert answer.exit_code == 65
    assert answer.stderr.startswith("E403") and sentence in answer.stderr
    assert list(tmp_path.iterdir()) == [path] and not engine.asked


def test_a_recording_that_is_not_there_is_bad_input(tmp_path: Path, call: Call) -> None:
    assert call("diagnose", str(tmp_path / "none.csv")).exit_code == 65
    assert call("diagnose", "7", "--state", str(tmp_path)).exit_code == 65


def test_json_takes_no_option_for_its_file(tmp_path: Path, call: Call, engine: Engine) -> None:
    """Of `diagnose 1 --json --state DIR` it was said that demo has no recording 1."""
    answer = call("diagnose", "1", "--json", "--state", str(tmp_path))
    assert answer.exit_code == 2 and "--state is no file: OUT is missing; - is stdout" in answer.stderr


@pytest.mark.parametrize("floor", ["nan", "inf", "0", "-1", "x"])
def test_a_noise_floor_is_a_positive_number(tmp_path: Path, call: Call, engine: Engine, floor: str) -> None:
    answer = call("diagnose", str(table(tmp_path / "a.csv")), "--noise-floor-n", floor)
    assert answer.exit_code == 2 and "--noise-floor-n" in answer.output


def test_an_unknown_effect_is_answered_with_its_neighbours(tmp_path: Path, call: Call, engine: Engine) -> None:
    answer = call("diagnose", str(table(tmp_path / "a.csv")), "--without", "coulomb-frction")
    assert answer.exit_code == 2 and "did you mean coulomb-friction" in answer.stderr
    answer = call("diagnose", str(table(tmp_path / "a.csv")), "--without", "xyzzy")
    assert answer.exit_code == 2 and "force-gateway effects" in answer.stderr


def test_no_output_may_replace_what_it_was_made_from(tmp_path: Path, call: Call, engine: Engine) -> None:
    path = table(tmp_path / "a.csv")
    before = path.read_bytes()
    assert call("diagnose", str(path), "--report", str(path)).exit_code == 2
    both = str(tmp_path / "out")
    assert call("diagnose", str(path), "--report", both, "--json", both).exit_code == 2
    assert path.read_bytes() == before and not engine.asked


def test_when_one_file_cannot_be_written_none_is(tmp_path: Path, call: Call, engine: Engine) -> None:
    path, remaining = table(tmp_path / "a.csv"), tmp_path / "kept.json"
    remaining.write_text("old")
    answer = call("diagnose", str(path), "--json", str(remaining), "--report", str(tmp_path / "none" / "out.html"))
    assert answer.exit_code == 1 and "E106" in answer.stderr
    assert remaining.read_text() == "old" and sorted(tmp_path.iterdir()) == [path, remaining]
    assert not engine.asked, "an hour of search must not end in a missing directory"


def test_a_device_is_written_to_and_never_replaced() -> None:
    ours, theirs = os.openpty()
    try:
        device = Path(os.ttyname(theirs))
        write_all({device: "{}"})
        assert os.read(ours, 10) == b"{}" and device.is_char_device()
    finally:
        os.close(ours)
        os.close(theirs)


def test_help_of_the_verbs_imports_nothing_heavy() -> None:
    script = (
        "import sys; from gateway.cli.main import command\n"
        "for verb in ('diagnose', 'simulate', 'effects'):\n"
        "    try: command([verb, '--help'], standalone_mode=False)\n"
        "    except SystemExit: pass\n"
        "print(*sorted(set(sys.modules) & {'numpy', 'scipy', 'yaml', 'pydantic', 'rich'}), file=sys.stderr)"
    )
    text = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=os.environ, check=True)
    assert text.stderr.strip() == ""


def test_the_closed_loop_is_measured_only_when_asked_and_told_everywhere(
    tmp_path: Path, call: Call, engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, report = table(tmp_path / "a.csv"), tmp_path / "out.html"
    gain = ClosedLoopGain(
        before_rms_n=1.2, after_rms_n=0.3, before_max_n=4.0, after_max_n=1.0, before_settled_s=0.6, after_settled_s=0.3,
        rms_ratio=0.25, rms_ratio_ci95=(0.2, 0.3), seeds=(0, 1), compensated=("friction",), not_compensated=(),
    )  # fmt: skip
    monkeypatch.setattr("gateway.service.closed_loop.study.closed_loop_gain", lambda base, extended, rig: gain)
    assert "closed_loop" not in json.loads(call("diagnose", str(path), "--json", "-").stdout)
    answer = call("diagnose", str(path), "--closed-loop", "--report", str(report), "--json", str(tmp_path / "out.json"))
    assert answer.exit_code == 0, answer.output
    document = json.loads((tmp_path / "out.json").read_text())["closed_loop"]
    assert (document["before_rms_n"], document["after_rms_n"]) == (1.2, 0.3)
    answered = "makes it better: 1.20 N before, 0.30 N after"
    assert answered in " ".join(answer.stdout.split())
    assert f"{answered}</strong>" in unescape(report.read_text(encoding="utf-8"))


def test_a_loop_that_could_not_be_closed_says_why(
    tmp_path: Path, call: Call, engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(base: Plant, extended: Plant, rig: object) -> ClosedLoopGain:
        raise ValueError("the curve is not increasing")

    monkeypatch.setattr("gateway.service.closed_loop.study.closed_loop_gain", refused)
    answer = call("diagnose", str(table(tmp_path / "a.csv")), "--closed-loop")
    assert answer.exit_code == 0
    assert "control   not measured: the curve is not increasing" in answer.stdout
