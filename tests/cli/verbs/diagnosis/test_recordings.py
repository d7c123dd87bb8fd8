"""`recordings`: list, show, plot, keep, delete, prune on a state directory."""

import json
import os
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from gateway.processes import exit_codes
from gateway.recording import Recorder
from gateway.watch.reference_recording import keep_reference_recording
from tests.recording.care.test_care import record


@pytest.fixture
def state(tmp_path: Path) -> Path:
    record(
        tmp_path, name="before repair", note="new seals tomorrow", rig="demo", started_utc="2026-01-02T03:04:05.000Z"
    )
    record(tmp_path, rig="a-cell-with-a-rather-long-name-such-as-people-give", ladder={"groups": 3, "step_v": 0.5})
    return tmp_path


def words_of(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.parametrize("width", [60, 80])
def test_a_list_is_whole_on_a_narrow_terminal(width: int, state: Path, call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    answer = call("recordings", "list", "--state", state)
    assert max(map(len, answer.output.splitlines())) < width
    told = words_of(answer.output)
    assert "1 2026-01-02 03:04:05 UTC demo 0.9 s 10 rows" in told
    assert "before repair: new seals tomorrow run, 1 change of setpoint, up to 20 N, 20.0 to 29.0 N measured" in told
    assert "a-cell-with-a-rather-long-name-such-as-people-give" in told
    assert "calibration ladder of 3 groups of 0.5 V stairs" in told


def test_show_says_everything_that_is_known(state: Path, call) -> None:
    told = words_of(call("recordings", "show", "1", "--state", state).output)
    assert "name: before repair note: new seals tomorrow" in told
    assert "residual 3 N RMS" in told
    facts = json.loads(call("recordings", "show", "1", "--state", state, "--json").output)
    assert (facts["id"], facts["kept"], facts["setpoint_changes"]) == (1, False, 1)


@pytest.mark.parametrize("verb", ["show", "plot", "keep", "export"])
def test_the_last_recording_is_shown_drawn_kept_and_exported_as_such_but_never_deleted(
    verb: str, state: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(state)
    answer = call("recordings", verb, "last", "--state", state)
    assert answer.exit_code == 0, answer.output
    named = {"show": "a-cell-with", "plot": "recording-0002.html", "keep": "recording 2", "export": "-0002.csv"}[verb]
    assert named in answer.stdout + answer.stderr
    assert "last is no number" in call("recordings", "delete", "last", "--yes", "--state", state).stderr


def test_what_is_kept_is_not_deleted_until_it_is_let_go(state: Path, call) -> None:
    assert call("recordings", "keep", "1", "--state", state).exit_code == 0
    assert "kept" in call("recordings", "list", "--state", state).output.splitlines()[0]
    refused = call("recordings", "delete", "1", "--yes", "--state", state)
    assert (refused.exit_code, refused.stderr.split(":")[0]) == (65, "E407 recording 1 was not deleted")
    assert "recordings keep 1 --no" in refused.stderr
    call("recordings", "keep", "1", "--no", "--state", state)
    assert call("recordings", "delete", "1", "--yes", "--state", state).exit_code == 0
    assert [one["id"] for one in json.loads(call("recordings", "list", "--json", "--state", state).output)] == [2]


def test_delete_asks_and_a_no_deletes_nothing(state: Path, call) -> None:
    answer = call("recordings", "delete", "1", "--state", state)
    assert answer.exit_code == 1 and "nobody is here to answer, and nothing was done: --yes answers" in answer.stderr
    assert (state / "recordings" / "0001.fgr").exists()


def test_neither_the_reference_nor_the_one_under_way_is_deleted(state: Path, call) -> None:
    keep_reference_recording(state, state / "recordings" / "0001.fgr")
    running = [Recorder(state / "recordings", header, ("time_s",)) for header in ({}, {"ladder": {"groups": 1}})]
    refusals = [call("recordings", "delete", number, "--yes", "--state", state).stderr for number in ("1", "3", "4")]
    for one in running:
        one.close()
    assert "reference" in refusals[0]
    assert "record off" in refusals[1]
    assert "the run that makes it ends it" in refusals[2], "record off does not"
    assert len(list((state / "recordings").glob("*.fgr"))) == 4


def test_a_plot_is_a_page_or_one_svg_that_parses(state: Path, call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(state)
    assert call("recordings", "plot", "1", "-o", "run.svg", "--state", state).exit_code == 0
    picture = ET.parse(state / "run.svg").getroot()
    lines = picture.iter("{http://www.w3.org/2000/svg}polyline")
    assert len(list(lines)) == 2  # setpoint and measured
    assert "before repair" in "".join(picture.itertext())
    assert call("recordings", "plot", "1", "--state", state).exit_code == 0
    assert "new seals tomorrow" in (state / "recording-0001.html").read_text(encoding="utf-8")
    assert call("recordings", "plot", "1", "--state", state).stderr.startswith("E405 ")
    assert call("recordings", "plot", "1", "-o", "run.png", "--state", state).exit_code == 2


def test_prune_says_what_would_go_before_it_goes(state: Path, call) -> None:
    os.utime(state / "recordings" / "0002.fgr")
    os.utime(state / "recordings" / "0001.fgr", (1.6e9, 1.6e9))
    would = call("recordings", "prune", "--dry-run", "--days", "30", "--state", state)
    assert words_of(would.output).endswith("0001.fgr: older than 30 days")
    assert (state / "recordings" / "0001.fgr").exists()
    unsure = call("recordings", "prune", "--days", "30", "--state", state)  # nobody answers
    assert unsure.exit_code == 1 and (state / "recordings" / "0001.fgr").exists()
    assert call("recordings", "prune", "--yes", "--days", "30", "--state", state).exit_code == 0
    assert not (state / "recordings" / "0001.fgr").exists()
    assert "nothing to delete" in call("recordings", "prune", "--days", "30", "--state", state).output


@pytest.mark.parametrize(
    ("size", "goes"), [("1MB", False), ("2 G", False), ("500k", False), ("1b", True), ("0.5kB", True), ("0", True)]
)
def test_prune_takes_sizes_as_people_write_them(state: Path, call, size: str, goes: bool) -> None:
    told = call("recordings", "prune", "--dry-run", "--bytes", size, "--state", state)
    assert told.exit_code == 0 and ("would delete" in told.output) is goes, told.output


@pytest.mark.parametrize("size", ["-1", "1 parsec", "1e3", "nan", "MB"])
def test_prune_says_how_a_size_is_written(state: Path, call, size: str) -> None:
    told = call("recordings", "prune", "--dry-run", "--bytes", size, "--state", state)
    assert told.exit_code == 2 and "500k, 1MB or 2G" in words_of(told.stderr)


def test_prune_takes_the_rigs_own_limits_and_says_where_there_are_none(
    state: Path, call, tmp_path: Path, rig_file_with_retention: Path
) -> None:
    os.utime(state / "recordings" / "0001.fgr", (1.6e9, 1.6e9))
    unlimited = call("recordings", "prune", "--rig", "demo", "--state", state)
    assert "retains everything" in unlimited.stderr and unlimited.exit_code == exit_codes.CONFIGURATION
    told = call("recordings", "prune", "--dry-run", "--rig", rig_file_with_retention, "--state", state)
    assert "older than 7 days" in told.output


@pytest.fixture
def rig_file_with_retention(tmp_path: Path) -> Path:
    from gateway.profiles import shipped_profiles_folder

    text = next(shipped_profiles_folder().rglob("rigs/demo.yaml")).read_text(encoding="utf-8")
    path = tmp_path / "own.yaml"
    path.write_text(f"{text}\nrecordings: {{retention: {{days: 7}}}}\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("key", ["ladder", "experiment", "plant_in_use", "rig_texts"])
def test_a_recording_of_another_program_hides_no_other_one(key: str, state: Path, call) -> None:
    """Its header is JSON of another form: the list ended with an internal error, at the terminal and on the page."""
    record(state, **{key: "of another form"})
    listed = call("recordings", "list", "--json", "--state", state)
    assert listed.exit_code == 0, listed.stderr
    assert [one["fault"] is None for one in json.loads(listed.stdout)] == [True, True, False]
    assert f"whose {key} is no group of keys" in call("recordings", "show", "3", "--state", state).output


@pytest.mark.parametrize(
    ("facts", "what"),
    [
        ({"ladder": {"groups": "four"}}, "ladder.groups is no number"),
        ({"ladder": {"step_v": 10**400}}, "ladder.step_v is no number"),
        ({"zero_n": None}, "zero_n is no number"),
        ({"continues": 5}, "continues is no list of recordings' numbers"),
        ({"continues": ["x"]}, "continues is no list of recordings' numbers"),
    ],
)
def test_a_ladder_of_another_form_ends_no_verb_with_an_internal_error(
    facts: dict, what: str, state: Path, call
) -> None:
    """List, fit and calibrate --resume ended with one, each for another of these."""
    record(state, **facts)
    listed = call("recordings", "list", "--json", "--state", state)
    assert listed.exit_code == 0 and what in json.loads(listed.stdout)[-1]["fault"]
    for verb in (["recordings", "show", "3"], ["fit", "3", "--no-report"]):
        assert what in call(*verb, "--state", state).output
    assert "E422" in call("calibrate", "--resume", "--yes", "--state", state).output


@pytest.mark.parametrize("key", ["rig", "started_utc"])
def test_a_header_of_another_program_with_a_number_for_a_name_is_listed(key: str, state: Path, call) -> None:
    """The list of all recordings ended with an internal error."""
    record(state, **{key: 5})
    listed = call("recordings", "list", "--state", state)
    assert listed.exit_code == 0, listed.stderr
    assert "new seals tomorrow" in words_of(listed.output)
    assert call("recordings", "show", "3", "--state", state).exit_code == 0


def test_a_recording_without_a_time_is_no_picture(state: Path, call) -> None:
    recorder = Recorder(state / "recordings", {"rig": "demo"}, ("force_n", "x"))
    for row in range(9):
        recorder.append((float(row), 1.0))
    recorder.close()
    refused = call("recordings", "plot", "3", "-o", state / "o.svg", "--state", state)
    assert (
        refused.exit_code == exit_codes.DATA and "recording 3 has no column time_s: nothing to draw" in refused.stderr
    )


def test_a_time_that_is_no_number_is_no_nan_in_json(tmp_path: Path, call) -> None:
    recorder = Recorder(tmp_path / "recordings", {"rig": "demo"}, ("time_s", "force_n"))
    for time_s in (0.0, 0.1, float("nan")):
        recorder.append((time_s, 1.0))
    recorder.close()
    told = json.loads(call("recordings", "show", "1", "--json", "--state", tmp_path).stdout, parse_constant=pytest.fail)
    assert told["duration_s"] == 0.0 and told["rows"] == 3
    assert call("recordings", "show", "1", "--state", tmp_path).exit_code == 0


def test_an_export_stays_here_whatever_the_rig_of_a_foreign_recording_is_called(
    tmp_path: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    record(tmp_path, rig="../elsewhere")
    assert call("recordings", "export", "1", "--state", tmp_path).exit_code == 0
    assert [path.name for path in here.iterdir()] == [".._elsewhere-0001.csv"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("1", "-o", "run.xlsx"), "run.xlsx: an export is CSV or Parquet: a spreadsheet opens FILE.csv"),
        (("1", "--parquet", "-o", "run.csv"), "run.csv: --parquet writes FILE.parquet"),
        (("1", "--csv", "-o", "run.PARQUET"), "run.PARQUET: --csv writes FILE.csv"),
        (("run.csv",), "run.csv is no number: a number of `force-gateway recordings list` is wanted"),
    ],
)
def test_an_export_is_what_its_name_says(
    words: tuple[str, ...], said: str, tmp_path: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """CSV in a file called run.xlsx was opened by no spreadsheet."""
    monkeypatch.chdir(tmp_path)
    record(tmp_path / "state", rig="demo")
    answer = call("recordings", "export", *words, "--state", "state")
    assert answer.exit_code == 2 and said in answer.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["state"]
