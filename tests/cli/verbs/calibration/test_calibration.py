"""`calibration` on a state directory: what is in it, which one is used, how two differ, and taking one along."""

import fcntl
import json
import re
from pathlib import Path

import pytest

from gateway.calibrations.store import CalibrationStore, as_text
from gateway.profiles import load_calibration
from gateway.registers.upload.coefficients import model_hash
from tests.calibrations.coefficients import calibration, mark_of


@pytest.fixture
def state(tmp_path: Path) -> Path:
    """Marks 16 and 24 as calibrations 2 and 3 of the demo rig, 3 in use from slot 4."""
    store = CalibrationStore(tmp_path / "state", load_calibration("demo"))
    store.use(store.add(calibration(16)))
    store.use(store.add(calibration(24, rms_n=-1.0, max_n=-1.0)), 4)
    return tmp_path / "state"


def active(state: Path) -> int | None:
    return CalibrationStore(state, load_calibration("demo")).find_selected().selection.number


def entries(output: str) -> list[list[str]]:
    """The lines of each entry of the list, the later ones without what they hang behind."""
    found: list[list[str]] = []
    for line in output.splitlines():
        if line.startswith(" " * 6):
            found[-1].append(line.strip())
        elif line[:4].strip(" *x").isdigit():
            found.append([line])
    return found


@pytest.mark.parametrize("columns", [44, 60, 80])
def test_no_line_of_the_list_is_wider_than_the_terminal(state, call, columns, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    CalibrationStore(state, load_calibration("demo")).add(
        calibration(32, rejected="0.600 N RMS on all 59 measured points")
    )
    output = call("calibration", "list", "--state", state).output
    assert max(map(len, output.splitlines())) < columns
    assert "measured" in output and "points" in output


def test_list_shows_all_and_which_one_is_used(state, call):
    done = call("calibration", "list", "--state", state)
    assert done.exit_code == 0
    own, second, third = entries(done.output)
    assert own[0].startswith("   1  ") and own[0].endswith("(the rig's own)")
    assert second[0] == "   2  mark 16"
    assert second[1].endswith("0.0 .. 52.0 N")
    assert second[2:] == ["rms 0.125 N, max 0.500 N", "a test, mark 16"]
    assert third[0] == "*  3  mark 24"
    assert third[2] == "in slot 4"  # and no error, which is not known
    facts = json.loads(call("calibration", "list", "--state", state, "--json").output)
    assert facts["active"] == 3
    assert [(entry["number"], entry["active"], entry["slots"]) for entry in facts["calibrations"]] == [
        (2, False, []),
        (3, True, [4]),
    ]


def test_the_rigs_own_shows_the_slots_that_hold_it(state, call):
    CalibrationStore(state, load_calibration("demo")).use(None, 6)
    own = entries(call("calibration", "list", "--state", state).output)[0]
    assert own[0] == "*  1  demo (the rig's own)"
    assert own[2:4] == ["rms 0.131 N, max 0.401 N", "in slot 6"]
    facts = json.loads(call("calibration", "list", "--state", state, "--json").output)
    own = {
        "number": 1,
        "name": "demo",
        "active": True,
        "slots": [6],
        "model_hash": model_hash(load_calibration("demo")),
    }
    assert facts["built_in"] == own
    assert facts["calibrations"][0]["model_hash"] == model_hash(calibration(16)) != own["model_hash"]


def test_an_empty_state_has_the_rigs_own(tmp_path, call):
    (tmp_path / "nothing").mkdir()
    done = call("calibration", "list", "--state", tmp_path / "nothing")
    assert done.output.startswith("*  1  ")
    assert not list((tmp_path / "nothing").iterdir())
    shown = call("calibration", "show", "--state", tmp_path / "nothing")
    assert 'name: "demo"' in shown.output


def test_a_damaged_calibration_is_listed_with_its_fault(state, call):
    (state / "calibrations" / "0003.yaml").write_bytes(b"number: 3\n")
    done = call("calibration", "list", "--state", state)
    assert done.exit_code == 0
    assert "3 unusable: E432 " in " ".join(done.output.split())
    assert done.stderr.startswith("E432 ")
    assert done.output.count("*  2  ") == 1


def test_use_and_rollback_without_a_gateway_act_at_the_next_start(state, call):
    done = call("calibration", "use", 2, "--state", state)
    assert done.output == "calibration 2 (mark 16) will be used from the next start: no gateway runs\n"
    assert active(state) == 2
    assert json.loads(call("calibration", "rollback", "--state", state, "--json").output)["active"] == 3
    assert active(state) == 3
    call("calibration", "use", 1, "--state", state)
    assert active(state) is None


def test_what_cannot_be_used_changes_nothing(state, call):
    done = call("calibration", "use", 9, "--state", state)
    assert done.exit_code == 65
    assert done.stderr.startswith("E433 there is no calibration 9 in ")
    store = CalibrationStore(state)
    wide = calibration(4, rising_handles_n=(0.0, 25.0, 120.0), falling_handles_n=(0.0, 60.0, 120.0))
    done = call("calibration", "use", store.add(wide), "--state", state)
    assert done.exit_code == 65
    assert done.stderr.startswith("E401 index 2, handle_range: ") and "active set 3 unchanged" in done.stderr
    assert active(state) == 3
    (state / "elsewhere").mkdir()
    done = call("calibration", "rollback", "--state", state / "elsewhere")
    assert done.exit_code == 65
    assert "nothing to go back to" in done.stderr


def test_a_directory_in_use_is_never_changed_behind_the_gateways_back(state, call):
    """A gateway holds the lock and does not answer: nothing is done."""
    with (state / "lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = call("calibration", "use", 2, "--state", state)
    assert done.exit_code == 69
    assert done.stderr.startswith("E140 ")
    assert active(state) == 3


def test_show_is_a_file_that_loads(state, call, tmp_path):
    for which, mark in ((), 24), ((2,), 16):
        text = call("calibration", "show", *which, "--state", state).output
        (tmp_path / "shown.yaml").write_text(text, encoding="utf-8")
        assert load_calibration(tmp_path / "shown.yaml").name == f"mark {mark}"
    assert json.loads(call("calibration", "show", 2, "--json", "--state", state).output)["order"] == 2


def test_compare_tells_the_differences_of_the_branches(state, call, tmp_path):
    """Marks 16 and 24 differ by 1 N at the top: linear in the voltage, the same on both branches."""
    facts = json.loads(call("calibration", "compare", 2, 3, "--state", state, "--json").output)
    for branch in ("rising", "falling"):
        assert facts[branch]["max_n"] == pytest.approx(1.0)
        assert facts[branch]["at_v"] == 8.0
        assert facts[branch]["rms_n"] == pytest.approx(3**-0.5, rel=5e-3)
    back = json.loads(call("calibration", "compare", 3, 2, "--state", state, "--json").output)
    assert back["rising"]["max_n"] == pytest.approx(-1.0)
    plot = tmp_path / "plot.html"
    text = call("calibration", "compare", "2", "demo", "--state", state, "--plot", plot)
    assert text.output.startswith("A  calibration 2 (mark 16, 2026-11-21), blend 5 N\nB  calibration 1 (demo, ")
    html = plot.read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert html.count('class="plot"') == 2
    answer = re.search(r"<h1>(.*?)</h1>", html)
    assert answer and f"{answer[1]}.\n" in text.output
    assert "No measured points of A: " in html


def test_a_difference_that_rounds_to_nothing_has_no_sign(state, call, tmp_path):
    """The branches of two calibrations of one machine read -0.000 N in terminal and report."""
    for name, top_n in (("one", 50.0001), ("other", 50.0)):
        given = calibration(rising_handles_n=(0.0, 25.0, top_n), falling_handles_n=(0.0, 27.0, top_n))
        (tmp_path / name).write_text(as_text(given), encoding="utf-8")
    plot = tmp_path / "plot.html"
    told = call("calibration", "compare", tmp_path / "one", tmp_path / "other", "--state", state, "--plot", plot)
    assert told.exit_code == 0 and "+0.000 N at 8.00 V" in told.output and "-0.000" not in told.output
    assert not re.search(r"\N{MINUS SIGN}0\.000\b", plot.read_text(encoding="utf-8"))


def test_only_the_common_voltages_are_compared(state, call, tmp_path):
    for name, low_v, high_v in (("half", 4.0, 9.0), ("apart", 8.5, 9.5)):
        (tmp_path / f"{name}.yaml").write_text(as_text(calibration(16, x0_v=low_v, x1_v=high_v)), encoding="utf-8")
    facts = json.loads(call("calibration", "compare", 2, tmp_path / "half.yaml", "--state", state, "--json").output)
    assert facts["voltage_range_v"] == [4.0, 8.0]
    done = call("calibration", "compare", 2, tmp_path / "apart.yaml", "--state", state)
    assert done.exit_code == 65
    assert "no voltage in common" in done.stderr


def test_export_as_yaml_comes_back_the_same(state, call, tmp_path):
    target = tmp_path / "out.yaml"
    assert call("calibration", "export", 2, "--yaml", target, "--state", state).exit_code == 0
    assert mark_of(load_calibration(target)) == 16
    assert call("calibration", "export", 2, "--state", state).output == target.read_text(encoding="utf-8")
    done = call("calibration", "export", 3, "--yaml", target, "--state", state)
    assert (done.exit_code, done.stderr[:5]) == (1, "E405 ")
    assert call("calibration", "export", 3, "--yaml", target, "--force", "--state", state).exit_code == 0
    assert load_calibration(target).name == "mark 24"


def test_export_as_c_writes_a_header_and_a_source(state, call, tmp_path):
    done = call("calibration", "export", 2, "--c", tmp_path / "c", "--state", state)
    assert done.exit_code == 0, done.output
    assert sorted(path.name for path in (tmp_path / "c").iterdir()) == ["bsfm_mark_16.c", "bsfm_mark_16.h"]
    done = call("calibration", "export", 2, "--c", tmp_path / "c", "--state", state)
    assert (done.exit_code, done.stderr[:5]) == (1, "E405 ")
    assert call("calibration", "export", 2, "--c", "x", "--yaml", "y", "--state", state).exit_code == 2


def test_a_state_of_a_rig_that_cannot_be_read_works_without_its_own_calibration(state, call):
    done = call("calibration", "list", "--state", state, "--rig", "no-such-rig")
    assert [head[:4].split() for head, *_ in entries(done.output)] == [["2"], ["*", "3"]]


def test_where_the_rigs_own_is_not_known_the_list_says_so_and_whether_it_is_in_use(state, call, tmp_path):
    """A gateway of a file elsewhere was asked, and the answer was an empty line."""
    rig = ("--rig", "nowhere")
    (tmp_path / "fresh").mkdir()
    nothing = call("calibration", "list", "--state", tmp_path / "fresh", *rig)
    assert (nothing.stdout, nothing.stderr) == (
        "",
        "the rig's own, in use, is not shown: give the rig's file by --rig\n",
    )
    stored = call("calibration", "list", "--state", state, *rig)
    assert [entry[0][:4] for entry in entries(stored.stdout)] == ["   2", "*  3"]
    assert "the rig's own is not shown" in stored.stderr


def test_beside_a_broken_rig_file_all_that_is_stored_is_at_hand_and_what_to_mend_is_said(state, call, tmp_path):
    """`list` and `show` asked for the rig's file by --rig, which had been given."""
    rig = tmp_path / "own.yaml"
    rig.write_text("name: own\nloop_hz: [\n")
    given, place = ("--state", state, "--rig", rig), f"{rig}:3:1: "
    listed = call("calibration", "list", *given)
    assert [entry[0][:4] for entry in entries(listed.stdout)] == ["   2", "*  3"]
    assert place in listed.stderr and f"force-gateway check {rig}" in listed.stderr and "--rig" not in listed.stderr
    facts = json.loads(call("calibration", "list", *given, "--json").stdout)
    assert facts["built_in"] is None and place in facts["notes"][-1]
    assert call("calibration", "show", *given).stdout.startswith("number: 3")
    assert call("calibration", "export", 2, *given).stdout.startswith("number: 2")
    used = call("calibration", "use", 2, *given)
    assert used.exit_code == 0 and f"not judged by this rig's limits: {place}" in used.output
    assert active(state) == 2 and call("calibration", "rollback", *given).exit_code == 0 and active(state) == 3
    (tmp_path / "fresh").mkdir()
    nothing = call("calibration", "show", "--state", tmp_path / "fresh", "--rig", rig)
    assert nothing.exit_code == 65 and place in nothing.stderr


def test_a_rejected_one_is_listed_as_such_and_used_only_by_force(state, call):
    store = CalibrationStore(state, load_calibration("demo"))
    number = store.add(calibration(32, rejected="0.600 N RMS on all 59 measured points"))
    listed = entries(call("calibration", "list", "--state", state).output)[-1]
    assert listed[0].startswith(f"x  {number}  ")
    assert listed[-1].endswith("rejected, not offered: 0.600 N RMS on all 59 measured points")
    refused = call("calibration", "use", number, "--state", state)
    assert refused.exit_code == 65
    assert refused.stderr.startswith(f"E436 calibration {number} was rejected: 0.600 N RMS on all 59")
    assert active(state) == 3
    assert call("calibration", "use", number, "--force", "--state", state).exit_code == 0
    assert active(state) == number


def test_the_users_name_stands_in_the_list_and_in_the_comparison(state, call):
    number = CalibrationStore(state, load_calibration("demo")).add(calibration(40, name="left cell, new seals"))
    assert f"   {number}  left cell, new seals\n" in call("calibration", "list", "--state", state).output
    assert (
        f"B  calibration {number} (left cell, new seals, "
        in call("calibration", "compare", "1", str(number), "--state", state).output
    )
