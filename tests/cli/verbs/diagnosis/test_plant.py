"""`plant` and `diagnose --save`, without a running gateway: what is said before, what is in use afterwards, and as JSON."""

import json
import re
from html import escape
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import gateway.diagnosis
from gateway.cli.errors import NoAnswerError
from gateway.cli.main import command
from gateway.cli.plants import store_access
from gateway.plants.force_reference import read_reference
from gateway.plants.store import PlantStore
from gateway.processes import exit_codes
from gateway.processes.state_lock import hold_state_lock
from gateway.profiles import shipped_profiles_folder
from gateway.profiles.kinds.plant_writer import plant_text
from gateway.recording import Recorder
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from tests.cli.verbs.diagnosis.test_diagnose import table
from tests.plants.test_plant_store import bowed
from tests.reports.fake_diagnosis import diagnosis


@pytest.fixture
def state(tmp_path: Path) -> Path:
    (tmp_path / "state").mkdir()
    return tmp_path / "state"


@pytest.fixture
def added(state: Path, tmp_path: Path) -> Path:
    """A state directory with one plant."""
    file = tmp_path / "bowed.yaml"
    file.write_text(plant_text(bowed(contact__spindle_n=1.0)), encoding="utf-8")
    assert json.loads(call(state, "add", file, "--json").stdout) == {"number": 1}
    return state


def call(state: Path, *words: object) -> Result:
    return CliRunner().invoke(command, ["plant", *map(str, words), "--state", str(state)])


def record_held(state: Path, error_n: float) -> None:
    """A run as the gateway records one: eight forces, held."""
    recorder = Recorder(state / "recordings", {"rig": "demo"}, COLUMNS)
    row = dict.fromkeys(COLUMNS, 0.0)
    for index, wanted_n in enumerate((5.0, 20.0, 10.0, 30.0, 15.0, 25.0, 8.0, 12.0)):
        for step in range(100):
            at_s = index * 2.0 + step * 0.02
            row |= {"time_s": at_s, "setpoint_n": wanted_n, "force_n": wanted_n + error_n, "state": 3.0}
            recorder.append(tuple(row.values()))
    recorder.close()


def test_use_says_first_what_is_compensated_and_what_not(added):
    dry = call(added, "use", 1, "--dry-run").stdout
    assert "compensated: command-nonlinearity\n" in dry
    assert "not compensated: spindle-vibration: " in dry
    assert PlantStore(added).find_selected().document is None, "nothing has changed"
    used = call(added, "use", 1)
    assert used.stdout.startswith(dry)
    assert "plant 1 (bowed) will be used from the next start: no gateway runs" in used.stdout
    assert json.loads(call(added, "list", "--json").stdout)["active"] == 1
    assert "the rig's own plant will be used" in call(added, "rollback").stdout
    assert json.loads(call(added, "list", "--json").stdout)["active"] == 0


def test_use_keeps_how_large_the_error_was_before(added):
    assert "no run under force was recorded before" in call(added, "use", 1).stdout
    record_held(added, 0.4)
    answer = json.loads(call(added, "use", 1, "--json").stdout)
    assert answer["reference_rms_n"] == pytest.approx(0.4)
    assert answer["compensated"] == ["command-nonlinearity"]
    kept = read_reference(added, 1)
    assert kept is not None and (kept.recording, kept.plant_before) == ("0001.fgr", 0)
    assert read_reference(added, 2) is None, "it was kept for plant 1"


def test_a_plant_that_is_refused_leaves_the_reference_of_the_one_in_use(added, monkeypatch):
    """The watch of the plant that stayed in use had nothing to compare with any more."""
    record_held(added, 0.4)
    assert call(added, "use", 1).exit_code == 0
    before = read_reference(added, 1)
    file = added.parent / "another.yaml"
    file.write_text(plant_text(bowed()), encoding="utf-8")
    call(added, "add", file)
    answer = {"busy": False, "job": 1, "failed": True, "said": "W246 the output is enabled"}
    monkeypatch.setattr(store_access, "ask_until_done", lambda directory, verb, request: answer)
    with hold_state_lock(added):
        refused = call(added, "use", 2)
    assert refused.exit_code == exit_codes.DATA and "the output is enabled" in refused.stderr
    assert before and read_reference(added, 1) == before


def test_a_plant_that_a_silent_gateway_may_take_has_its_own_reference(added, monkeypatch):
    """The old one was put back, and the gateway took the plant: its watch had nothing to compare with, and nobody was told."""
    record_held(added, 0.4)

    def silent(*_):
        raise NoAnswerError("E431 the gateway has not answered for 20 s")

    monkeypatch.setattr(store_access, "ask_until_done", silent)
    with hold_state_lock(added):
        unknown = call(added, "use", 1)
    assert unknown.exit_code == exit_codes.FAILED
    assert "not answered for 20 s; the reference of the watch is kept for plant 1" in unknown.stderr
    kept = read_reference(added, 1)
    assert kept and kept.recording == "0001.fgr"


def test_show_and_compare(added):
    shown = call(added, "show", 1).stdout
    assert "added from bowed.yaml" in shown
    assert "regulator:" in shown
    facts = json.loads(call(added, "show", 1, "--json").stdout)
    assert (facts["number"], facts["plant"]["regulator"]["command_bow"]) == (1, 0.06)
    assert facts["not_compensated"][0]["name"] == "spindle-vibration"
    differing = json.loads(call(added, "compare", "0", "1", "--json").stdout)["differing"]
    assert differing == {"regulator.command_bow": [0.0, 0.06], "contact.spindle_n": [0.0, 1.0]}
    assert "same numbers" in call(added, "compare", "1", "1").stdout


def test_the_rigs_own_plant_is_shown_by_the_number_that_the_list_gives_it(state):
    """`0 is not in the range x>=1` was the answer, below a list with 0 in it."""
    shown = call(state, "show", 0)
    assert (shown.exit_code, shown.stdout.splitlines()[0]) == (0, "plant 0 (paper-slide), the rig's own"), shown.output
    assert "regulator:" in shown.stdout and "provenance" not in shown.stdout
    facts = json.loads(call(state, "show", 0, "--json").stdout)
    assert (facts["number"], facts["name"], facts["provenance"]) == (0, "paper-slide", None)


def test_of_a_rig_that_names_no_plant_the_one_that_stands_in_is_shown(state, tmp_path):
    """It was refused (E433), although `run --sim` simulates it and changes are compared with it."""
    text = (shipped_profiles_folder() / "rigs" / "irc5-cell.yaml").read_text(encoding="utf-8")
    rig = tmp_path / "bare.yaml"
    rig.write_text(text.replace("plant: paper-slide", "#"), encoding="utf-8")
    shown = call(state, "show", 0, "--rig", rig)
    assert (shown.exit_code, shown.stderr) == (0, "")
    assert shown.stdout.startswith("plant 0 (paper-slide), stands in: the rig names none")
    assert "same numbers" in call(state, "compare", 0, 0, "--rig", rig).stdout


def test_compare_draws_both_plants_over_a_recording(added, tmp_path):
    plot, recording = tmp_path / "plants.html", table(tmp_path / "run.csv")
    told = call(added, "compare", "0", "1", "--plot", plot, "--recording", recording)
    assert told.exit_code == 0, told.output
    html = plot.read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    answer = "B (1) differs from A (0) in 2 numbers: regulator.command_bow 0 -> 0.06, contact.spindle_n 0 -> 1"
    assert f"\n{answer}\n" in told.stdout and f"<p class='verdict'>{escape(answer)}.</p>" in html
    closer = re.search(
        r"<h1>(On run\.csv, [AB] is closer than [AB]: A is off by \d+\.\d+ N RMS, B by \d+\.\d+ N RMS)</h1>", html
    )
    assert closer and told.stdout.startswith(f"{closer[1]}\n")
    assert html.count('class="plot"') == 2 and "Largest of A: " in html
    assert call(added, "compare", "0", "1", "--recording", recording).exit_code == exit_codes.USAGE


@pytest.mark.parametrize(("words", "code"), [(("use", 7), "E433"), (("rollback",), "E433"), (("show", 3), "E433")])
def test_a_plant_that_is_not_there_is_named(state, words, code):
    answer = call(state, *words)
    assert (answer.exit_code, answer.output.startswith(code)) == (exit_codes.DATA, True), answer.output


def test_a_diagnosis_is_kept_as_the_next_plant_with_its_provenance(tmp_path, state, monkeypatch):
    monkeypatch.setattr(gateway.diagnosis, "diagnose", lambda measurements, plant, options: diagnosis())
    recording = table(tmp_path / "run.csv")
    told = CliRunner().invoke(command, ["diagnose", str(recording), "--save", "--state", str(state)])
    assert "plant 1; force-gateway plant use 1" in told.output, told.output
    provenance = PlantStore(state).load(1).provenance
    assert (provenance.rig, provenance.verdict, provenance.recordings[0].name) == (
        "demo",
        diagnosis().verdict,
        "run.csv",
    )
    assert [cause.name for cause in provenance.causes] == [cause.name for cause in diagnosis().causes]
    assert provenance.causes[0].parameters["load_dependent_n_per_n"]["ci95"] == [0.0482, 0.0511]
    assert "load-dependent-friction" in call(state, "list").stdout
    words = ["diagnose", str(recording), "--save", "--state", str(state), "--json", "-"]
    told = CliRunner().invoke(command, words)
    assert json.loads(told.stdout)["verdict"] == diagnosis().verdict
    assert "plant 2; force-gateway plant use 2" in told.stderr, "whoever reads JSON wants its number, too"
