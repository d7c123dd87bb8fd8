"""`fit`: a table and a report from a ladder; nothing at all from what is none."""

import json
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gateway.bsfm.fit.evaluation import Evaluation, evaluate
from gateway.cli.command_line import known_rigs
from gateway.recording import Recorder
from gateway.service.fitting import ladder_fit

COLUMNS = ("time_s", "command_v", "force_n")
ORDERS = ("--models", "psfm,bsfm", "--orders", "1-2")
evaluated: dict[bytes, Evaluation] = {}
"""What became of each ladder here, by the ladder and what was asked of it."""


@pytest.fixture(autouse=True)
def each_ladder_is_fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of these tests ask for a fit that another one has had made, and look at something else of it."""

    def evaluate_once(*given: object) -> Evaluation:
        key = pickle.dumps(given)
        if key not in evaluated:
            evaluated[key] = evaluate(*given)  # type: ignore[arg-type]
        return evaluated[key]

    monkeypatch.setattr(ladder_fit, "evaluate", evaluate_once)


def ladder_rows(groups: int = 2) -> list[tuple[float, float, float]]:
    """10 Hz rows of a loop 3 N wide: 0 .. 6 V in steps of 0.5 V, 0.5 s each."""
    up = np.arange(0.0, 6.01, 0.5).tolist()
    rng, rows, force_n, time_s = np.random.default_rng(7), [], 0.0, 0.0
    for volts in [*(up + up[-2::-1]) * groups, 0.0]:
        for _ in range(5):
            rows.append((time_s, volts, force_n + rng.normal(0.0, 0.05)))
            time_s += 0.1
            force_n = float(np.clip(force_n, 8.0 * volts - 1.5, 8.0 * volts + 1.5))
    return rows


def written(path: Path, rows: list[tuple[float, ...]], head: str = "time_s,command_v,force_n", sep: str = ",") -> Path:
    lines = [head, *(sep.join(f"{value:.6f}" for value in row) for row in rows)]
    path.write_text("# rig: demo\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_the_table_the_json_and_the_report_tell_one_story(tmp_path: Path, call) -> None:
    path = written(tmp_path / "ladder.csv", ladder_rows())
    shown = call("fit", str(path), *ORDERS)
    assert shown.exit_code == 0, shown.output
    document = json.loads(call("fit", str(path), *ORDERS, "--json", "--no-report").stdout)
    chosen = [fit for fit in document["fits"] if fit["chosen"]]
    assert len(document["fits"]) == 4
    assert f"{document['chosen']['rms_n']:.3f} N RMS" in shown.output
    for fit in document["fits"]:
        assert re.search(
            rf"{fit['model'].upper()} +{fit['order']} +{fit['coefficients']} +{fit['rms_n']:.3f}", shown.output
        )
    assert "▸" in shown.output or not chosen
    report = (tmp_path / "ladder.fit.html").read_text(encoding="utf-8")
    assert f"{document['chosen']['rms_n']:.3f}" in report
    assert report.count("<svg") >= 3


def test_the_report_loads_nothing_from_anywhere(tmp_path: Path, call) -> None:
    call("fit", str(written(tmp_path / "ladder.csv", ladder_rows())), *ORDERS)
    report = (tmp_path / "ladder.fit.html").read_text(encoding="utf-8")
    assert not re.search(r"https?:|<script|<link|@import|url\(", report)
    assert len(report) < 200_000


def test_a_recording_of_the_gateway_is_fitted_by_its_number(tmp_path: Path, call) -> None:
    recorder = Recorder(tmp_path / "recordings", {"rig": "demo"}, COLUMNS)
    for row in ladder_rows():
        recorder.append(row)
    recorder.close()
    answer = call("fit", "1", "--state", str(tmp_path), *ORDERS, "--json")
    assert answer.exit_code == 0, answer.output
    assert json.loads(answer.stdout)["report"] == str(tmp_path / "recordings" / "0001.fit.html")


def test_a_recording_by_its_number_is_judged_by_the_calibration_that_is_in_use_there(
    tmp_path: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without --state it was the rig's own, which was said to be in use: a fit that is far worse was offered."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    recorder = Recorder(tmp_path / "force-gateway" / "demo" / "recordings", {"rig": "demo"}, COLUMNS)
    for row in ladder_rows():
        recorder.append(row)
    recorder.close()
    words = ("fit", "1", "--rig", "demo", "--models", "bsfm", "--orders", "2", "--no-report", "--json")
    before = json.loads(call(*words, "--store").stdout)
    assert (before["measured"]["in_use"], before["calibration"]) == (1, 2)
    assert call("calibration", "use", "2", "--rig", "demo").exit_code == 0
    after = json.loads(call(*words).stdout)["measured"]
    assert (after["in_use"], after["in_use_rms_n"]) == (2, pytest.approx(after["rms_n"], rel=1e-3))


def test_a_table_that_no_gateways_state_is_asked_about_is_compared_with_nothing_in_use(tmp_path: Path, call) -> None:
    """It was said of the rig's own calibration, whatever was in use."""
    path = written(tmp_path / "exported.csv", ladder_rows())
    words = ("fit", str(path), "--models", "bsfm", "--orders", "2", "--no-report")
    shown = " ".join(call(*words).output.split())
    assert "calibration 1 of the rig file has " in shown and "in use" not in shown
    measured = json.loads(call(*words, "--json").stdout)["measured"]
    assert (measured["in_use"], measured["in_use_rms_n"]) == (None, None)
    assert f"{measured['compared_rms_n']:.3f} N on them" in shown
    there = " ".join(call(*words, "--state", str(tmp_path), "--rig", "demo").output.split())
    assert "calibration 1 in use has " in there


def test_store_adds_a_numbered_calibration_that_says_where_it_comes_from(tmp_path: Path, call) -> None:
    path = written(tmp_path / "ladder.csv", ladder_rows())
    document = json.loads(call("fit", str(path), *ORDERS, "--store", "--state", str(tmp_path), "--json").stdout)
    stored = (tmp_path / "calibrations" / f"{document['calibration']:04d}.yaml").read_text(encoding="utf-8")
    assert document["data_sha256"] in stored
    assert "ladder.csv" in stored


def test_a_table_that_names_no_rig_is_stored_for_the_one_that_runs_and_judged_by_it(
    tmp_path: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As `calibration use` takes it, which the answer advises: its number would be another calibration there."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(known_rigs, "running_rigs", lambda: ["irc5-cell"])
    path = written(tmp_path / "ladder.csv", ladder_rows())
    path.write_text(path.read_text(encoding="utf-8").removeprefix("# rig: demo\n"), encoding="utf-8")
    document = json.loads(call("fit", str(path), *ORDERS, "--store", "--json", "--no-report").stdout)
    stored = [str(file.relative_to(tmp_path / "force-gateway")) for file in tmp_path.rglob("*.yaml")]
    assert stored == [f"irc5-cell/calibrations/{document['calibration']:04d}.yaml"]
    assert document["measured"]["allowed_rms_n"] is not None


def test_semicolons_with_decimal_commas_and_kgf_are_understood(tmp_path: Path, call) -> None:
    rows = [(time_s, volts, force_n / 9.80665) for time_s, volts, force_n in ladder_rows()]
    path = written(tmp_path / "german.csv", rows, "time_s;command_v;force_kgf", ";")
    path.write_text(path.read_text(encoding="utf-8").replace(".", ","), encoding="utf-8")
    document = json.loads(call("fit", str(path), *ORDERS, "--json").stdout)
    assert document["chosen"]["force_range_n"][1] == pytest.approx(48.0, abs=2.0)
    assert any("kgf" in note for note in document["notes"])


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: rows[:3], "3 rows"),
        (lambda rows: rows[:65], "one direction only"),
        (lambda rows: [(t, v, 1.0) for t, v, f in rows], "dead load cell"),
        (lambda rows: [(t, f, v) for t, v, f in rows], "columns swapped"),
        (lambda rows: [(t, v, -f) for t, v, f in rows], "sign: -1"),
        (lambda rows: [(t, v, f / 9.80665) for t, v, f in rows], "kgf"),
        (lambda rows: [(t, v, min(f, 15.0)) for t, v, f in rows], "saturated"),
        (lambda rows: rows[:100], "cut short"),
        (lambda rows: [(t, v, float("nan")) for t, v, f in rows], "without a usable number"),
        (lambda rows: [(t, v, f - 9.0 * (2.9 < v < 4.1)) for t, v, f in rows], "no inverse"),
    ],
)
def test_what_is_no_ladder_ends_with_65_a_sentence_and_nothing_written(change, words, tmp_path: Path, call) -> None:
    path = written(tmp_path / "bad.csv", change(ladder_rows()))
    answer = call("fit", str(path), *ORDERS, "--store", "--state", str(tmp_path / "state"))
    assert answer.exit_code == 65, answer.output
    assert words in answer.output
    assert answer.output.startswith("E421")
    assert sorted(tmp_path.rglob("*")) == [path]


def test_a_file_from_another_rig_is_refused(tmp_path: Path, call) -> None:
    answer = call("fit", str(written(tmp_path / "ladder.csv", ladder_rows())), "--rig", "irc5-cell")
    assert answer.exit_code == 65
    assert "recorded on rig demo, asked for rig irc5-cell" in answer.output


@pytest.mark.parametrize("content", [b"", b"\x00\xff\xfe\x89", b"# only: comments\n", b"1,2,3\n4,5,6\n"])
def test_a_file_that_is_no_table_is_refused(content: bytes, tmp_path: Path, call) -> None:
    path = tmp_path / "no.csv"
    path.write_bytes(content)
    answer = call("fit", str(path))
    assert answer.exit_code == 65
    assert answer.output.startswith("E403")


def test_a_missing_recording_is_told_with_the_numbers_there_are(tmp_path: Path, call) -> None:
    assert "no recording 7" in call("fit", "7", "--state", str(tmp_path)).output
    assert call("fit", str(tmp_path / "nowhere.csv")).exit_code == 65


@pytest.mark.parametrize(
    "option",
    [
        ("--orders", "0"),
        ("--orders", "3-1"),
        ("--orders", "1-16"),
        ("--orders", "1-99999999999"),
        ("--orders", "a"),
        ("--models", "spline"),
    ],
)
def test_what_cannot_be_asked_is_a_usage_error(option: tuple[str, str], tmp_path: Path, call) -> None:
    assert call("fit", "x.csv", *option).exit_code == 2


def test_help_of_fit_costs_no_scipy() -> None:
    code = "import sys; from gateway.cli.main import command; command(['fit', '--help'], standalone_mode=False)\n"
    code += "assert not {'scipy', 'numpy', 'matplotlib'} & set(sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_unit_that_the_header_says_is_not_applied_again(tmp_path: Path, call) -> None:
    """--force-unit kgf beside a header in kgf made ten times the force."""
    rows = [(time_s, volts, force_n / 9.80665) for time_s, volts, force_n in ladder_rows()]
    path = written(tmp_path / "kgf.csv", rows, "time_s,command_v,Kraft [kgf]")
    plain, asked = (call("fit", str(path), *ORDERS, "--json", *more) for more in ((), ("--force-unit", "kgf")))
    forces = [json.loads(each.stdout)["ladder"]["force_n"] for each in (plain, asked)]
    assert forces[0] == forces[1] == pytest.approx([0.0, 46.5], abs=1.0)
    other = call("fit", str(path), *ORDERS, "--force-unit", "lbf")
    assert other.exit_code == 65
    assert "E421" in other.output and "was read in another unit already (1 of it = 9.8066 N)" in other.output


def test_the_report_draws_the_readings_in_newtons(tmp_path: Path, call) -> None:
    """By what --force-unit says, as the table beside the picture has them."""
    weighed = written(tmp_path / "a.csv", [(t, v, f / 9.80665) for t, v, f in ladder_rows()])
    pages = []
    for path, more in ((written(tmp_path / "b.csv", ladder_rows()), ()), (weighed, ("--force-unit", "kgf"))):
        assert call("fit", str(path), *ORDERS, *more).exit_code == 0
        pages.append(path.with_suffix(".fit.html").read_text(encoding="utf-8"))
    ticks = [re.findall(r">(\d+)</text>", page) for page in pages]
    assert ticks[0] == ticks[1]


def test_a_quality_of_others_is_no_overload(tmp_path: Path, call) -> None:
    rows = [(*row, 192.0) for row in ladder_rows()]
    rows[7] = (*rows[7][:2], 90.0, 0.0)
    path = written(tmp_path / "opc.csv", rows, "time_s,command_v,force_n,quality")
    done = call("fit", str(path), *ORDERS, "--no-report")
    assert done.exit_code == 0, done.output
    assert "1 rows are not judged: quality is not 192" in " ".join(done.output.split())
