"""A file of the wrong kind, given to any verb: one sentence that says what it is and what is wanted."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from gateway.recording import Recorder
from tests.other_kinds import never_waiting, put

Call = Callable[..., Result]
PROFILES = Path(__file__).parents[3] / "profiles"
WHAT = {
    "calibration.yaml": "is a calibration",
    "rig.yaml": "is a rig",
    "picture.png": "is a PNG picture",
    "folder": "is a directory: name the",
    "empty": "is an empty file",
    "begun.fgr": "ends inside its header",
    "report.json": "",
    "report.html": "is a web page (HTML)",
    "table.tdms": "is a TDMS file (LabVIEW, DIAdem)",
    "pipe": "is a pipe",
    "socket": "is a socket",
    "zeros": "is a device",
}
RECORDING_VERBS = ("diagnose", "fit", "simulate", "recordings reference --state state")
PROFILE_VERBS = {
    "check": "rig",
    "calibrate --state state --plan": "plan",
    "calibration show --state state": "calibration",
}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    recorder = Recorder(tmp_path_factory.mktemp("recordings"), {"rig": "demo"}, ("time_s", "command_v", "force_n"))
    for row in range(3000):
        recorder.append((row * 0.01, 1.0 + row % 3, 4.0 * (row % 3)))
    recorder.close()
    return recorder.path.read_bytes()


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recording: bytes) -> Path:
    """One file of each kind, in the working directory."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "calibration.yaml").write_bytes((PROFILES / "calibrations" / "demo.yaml").read_bytes())
    (tmp_path / "rig.yaml").write_bytes((PROFILES / "rigs" / "demo.yaml").read_bytes())
    (tmp_path / "picture.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(200))
    (tmp_path / "folder").mkdir()
    (tmp_path / "state").mkdir()
    (tmp_path / "empty").touch()
    (tmp_path / "begun.fgr").write_bytes(recording[:30])
    (tmp_path / "report.json").write_text(json.dumps({"format": 1, "verdict": "partial", "causes": []}, indent=2))
    (tmp_path / "report.html").write_text("<!doctype html><html></html>")
    (tmp_path / "table.tdms").write_bytes(b"TDSm\x0e\x00\x00\x00\x69\x12" + bytes(40))
    for name, kind in (("pipe", "a pipe"), ("socket", "a socket"), ("zeros", "a device")):
        put(kind, tmp_path / name)
    return tmp_path


@pytest.mark.sampled
@pytest.mark.parametrize("verb", RECORDING_VERBS)
@pytest.mark.parametrize("name", WHAT)
def test_a_verb_that_wants_a_recording_says_what_it_got(verb: str, name: str, files: Path, call: Call) -> None:
    with never_waiting():
        answer = call(*verb.split(), name)
    (sentence,) = [line for line in answer.output.splitlines() if line.startswith("E")]
    assert answer.exit_code == 65
    assert name in sentence
    assert (WHAT[name] or "is a JSON document") in sentence
    assert "recording" in sentence
    assert "Traceback" not in answer.output


RIGHT = {("check", "calibration.yaml"), ("calibration show --state state", "calibration.yaml")}


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("verb", "name"),
    [(verb, name) for verb in PROFILE_VERBS for name in WHAT if name != "rig.yaml" and (verb, name) not in RIGHT],
)
def test_a_verb_that_wants_a_profile_says_what_it_got(verb: str, name: str, files: Path, call: Call) -> None:
    wanted = PROFILE_VERBS[verb]
    with never_waiting():
        answer = call(*verb.split(), name)
    sentences = [line for line in answer.output.splitlines() if name in line and not line.startswith(("Usage", "Try"))]
    assert len(sentences) == 1, answer.output
    assert answer.exit_code in (2, 78)
    what = {
        "begun.fgr": "is a recording of force-gateway",
        "report.json": f"is not a {wanted}: it holds format, verdict",
    }
    assert (what.get(name) or WHAT[name]).removesuffix(": name the") in sentences[0]
    assert name == "folder" or wanted in sentences[0]


TABLE = "time_s,force_n,command_v\n" + "0.01,12.5,3.25\n" * 10


@pytest.mark.parametrize("verb", PROFILE_VERBS)
@pytest.mark.parametrize(
    "table",
    [
        TABLE,
        "# format: 1\n# rig: demo\n" + TABLE,
        "Zeit;Kraft\n12:00:01;1,5\n12:00:02;1,6\n",
        "\ufefft\tN\n1\t2\n",
        TABLE * 10_000,
    ],
)
def test_a_table_for_a_profile_is_told_as_one_however_large_it_is(
    verb: str, table: str, files: Path, call: Call
) -> None:
    """Of a large one its size was told, of a small one that it is a single value."""
    (files / "table.csv").write_text(table)
    answer = call(*verb.split(), "table.csv")
    sentences = [line for line in answer.output.splitlines() if "table.csv" in line]
    assert len(sentences) == 1, answer.output
    assert f"is a table of values (CSV); a {PROFILE_VERBS[verb]} is needed here, a YAML file" in sentences[0]


@pytest.mark.parametrize("text", ["a, b\nc\n", "a, b\nc: 1, 2\n", "# only, a\n# comment, b\n", "demo\n"])
def test_what_is_no_table_is_not_called_one(text: str, files: Path, call: Call) -> None:
    (files / "rig.yaml").write_text(text)
    answer = call("check", "rig.yaml")
    assert answer.exit_code == 78 and "rig.yaml" in answer.output and "table" not in answer.output


@pytest.mark.parametrize("verb", ["calibration use", "plant use", "plant show"])
def test_a_file_for_a_number_says_which_list_has_the_numbers(verb: str, files: Path, call: Call) -> None:
    answer = call(*verb.split(), "--state", "state", "rig.yaml")
    assert answer.exit_code == 2
    assert f"rig.yaml is a file: a number of `force-gateway {verb.split()[0]} list` is wanted" in answer.output


@pytest.mark.parametrize("verb", ["recordings list", "events", "calibration list", "fit 1", "diagnose 1"])
def test_a_state_that_this_user_may_not_read_is_no_wrong_usage(
    verb: str, files: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a service's state anybody but root was told `Invalid value for '--state'`, with the exit code of a typing error."""
    monkeypatch.setattr("os.access", lambda *asked, **more: False)  # root, who runs the tests, may read everything
    answer = call(*verb.split(), "--state", "state")
    assert answer.exit_code != 2 and "Invalid value" not in answer.output
