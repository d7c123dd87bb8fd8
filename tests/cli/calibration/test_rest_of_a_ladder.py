"""What a stopped run has left: which parts count, from which group it goes on, and when nothing but the fit is left."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
from gateway.calibrations import kept_ladders
from gateway.cli.calibration import resume, store_access
from gateway.cli.calibration.resume import RestOfLadder, find_rest_of_ladder
from gateway.cli.errors import CliError
from gateway.cli.verbs.calibration.calibrate import _resume
from gateway.numbered_documents.store import StoreError
from gateway.processes import exit_codes
from gateway.recording import RecordingError

PLAN = {"groups": 4, "minor_points": 24, "v_max_v": 8.0, "tare": True, "step_v": 0.5}
REST = RestOfLadder(PLAN, 2, [1, 2], "mine", "f", Path("0002.fgr"), False)


@pytest.mark.parametrize(
    ("climbed", "changes", "first_group"),
    [
        (0, {}, 0),
        (2, {}, 2),
        (4, {}, 4),
        (5, {}, 4),
        (4, {"minor_points": 0}, 3),
        (2, {"minor_points": 0}, 2),
        (3, {"groups": 2}, 2),
        (3, {"groups": 6}, 3),
    ],
)
def test_a_run_goes_on_at_the_first_group_that_it_has_not_climbed(
    climbed: int, changes: dict[str, Any], first_group: int
) -> None:
    """With nothing but the walk left it begins behind the last group; without a walk it repeats one."""
    plan = replace(REST, groups=climbed).plan_with(changes)
    assert plan == PLAN | changes | {"first_group": first_group}


def test_other_stairs_than_those_that_were_climbed_are_no_rest_of_a_ladder(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its groups would be of two ladders, and one model be fitted to both."""
    monkeypatch.setattr(resume, "find_rest_of_ladder", lambda _state: REST)
    for key, value in (("step_v", 0.25), ("v_max_v", 6.0)):
        with pytest.raises(CliError, match=f"E437 .* not with {key} {value:g}:") as refused:
            _resume(Path(), {key: value}, "")
        assert refused.value.exit_code == exit_codes.USAGE
    assert _resume(Path(), {"step_v": 0.5, "groups": 6}, "").plan["groups"] == 6


@pytest.mark.parametrize(
    ("finished", "climbed", "walked", "wants", "is_whole"),
    [
        (True, 4, 24, 24, True),
        (False, 4, 24, 24, False),
        (True, 3, 24, 24, False),
        (True, 5, 24, 24, True),
        (True, 4, 0, 24, False),
        (True, 4, 0, 0, True),
        (True, 4, 24, 0, True),
    ],
)
def test_nothing_is_left_of_a_run_that_came_to_its_end_with_all_that_is_wanted(
    finished: bool, climbed: int, walked: int, wants: int, is_whole: bool
) -> None:
    rest = replace(REST, finished=finished, groups=climbed, plan=PLAN | {"minor_points": walked})
    assert rest.is_whole(PLAN | {"minor_points": wants}) is is_whole


class Recorded:
    """Recordings by their number: the header's ladder, and how many whole groups each has; None for one that is gone."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, groups: dict[int, int | None], finished: bool = True) -> None:
        header = {"ladder": PLAN | {"stairs": 99, "top_v": 7.5}, "continues": (1, 2), "name": "mine"}
        header["rig_fingerprint"] = "f" * 64
        none, older = {"rig": "demo"}, {"ladder": PLAN}
        self.headers: dict[Path, Any] = {Path(f"000{k}.fgr"): one for k, one in ((0, older), (3, header), (4, none))}
        monkeypatch.setattr(resume, "recording_paths", lambda state: list(self.headers))
        monkeypatch.setattr(kept_ladders, "read_header", lambda path: self.headers[path])
        monkeypatch.setattr(resume, "read_recording", self._read)
        monkeypatch.setattr(resume, "check_ladder", self._check)
        monkeypatch.setattr(resume, "_is_finished", lambda recording: finished)
        self._groups = groups

    def _read(self, path: Path) -> Any:
        if self._groups[int(path.stem)] is None:
            raise FileNotFoundError(path)
        if self._groups[int(path.stem)] == -3:
            raise RecordingError("cut off")
        return SimpleNamespace(columns=int(path.stem), header={})

    def _check(self, number: int, header: Any) -> Any:
        groups = self._groups[number]
        if groups == -1:
            raise LadderError(LadderFlaw.NO_FIT, "none")
        return SimpleNamespace(only_walk=groups == -2, ladder=SimpleNamespace(groups=range(abs(groups or 0))))


def test_the_rest_is_of_the_last_ladder_with_the_stairs_and_the_zero_that_it_had(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Recorded(monkeypatch, {1: 2, 2: 1, 3: 1})
    rest = find_rest_of_ladder(Path())
    assert rest.plan == PLAN | {"tare": False, "v_max_v": 7.5}
    assert (rest.groups, rest.earlier, rest.finished) == (4, [1, 2, 3], True)
    assert (rest.name, rest.fingerprint, rest.last) == ("mine", "f" * 64, Path("0003.fgr"))


@pytest.mark.parametrize(
    "lost", [None, 0, -1, -2, -3], ids=["gone", "no whole group", "not to be fitted", "a walk alone", "damaged"]
)
def test_a_part_without_a_whole_group_counts_for_nothing_and_the_run_is_not_finished(
    lost: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    Recorded(monkeypatch, {1: 2, 2: lost, 3: 1})
    rest = find_rest_of_ladder(Path())
    assert (rest.groups, rest.earlier, rest.finished) == (3, [1, 3], False)


def test_a_run_whose_last_stair_stood_when_it_ended_is_not_finished(monkeypatch: pytest.MonkeyPatch) -> None:
    Recorded(monkeypatch, {1: 2, 2: 1, 3: 1}, finished=False)
    assert find_rest_of_ladder(Path()).finished is False


@pytest.mark.parametrize("lost", ["groups", "minor_points", "step_v"])
def test_a_ladder_that_does_not_say_its_plan_is_no_run_to_go_on_with(
    lost: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was an internal error."""
    recorded = Recorded(monkeypatch, {3: 1})
    recorded.headers = {Path("0003.fgr"): {"ladder": {name: value for name, value in PLAN.items() if name != lost}}}
    with pytest.raises(CliError, match=f"E422 0003.fgr does not say the {lost} of its ladder") as ended:
        find_rest_of_ladder(Path())
    assert ended.value.exit_code == exit_codes.DATA


def test_without_a_ladder_there_is_nothing_to_go_on_with(monkeypatch: pytest.MonkeyPatch) -> None:
    recorded = Recorded(monkeypatch, {})
    recorded.headers = {Path("0004.fgr"): {"rig": "demo"}}
    with pytest.raises(CliError, match="E422") as ended:
        find_rest_of_ladder(Path())
    assert ended.value.exit_code == exit_codes.DATA


@pytest.mark.parametrize(("code", "exit_code"), [("E431", exit_codes.FAILED), ("E433", exit_codes.DATA)])
def test_a_full_disk_is_a_failure_and_a_wrong_number_is_wrong_data(
    code: str, exit_code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise StoreError(code, "it says why")

    monkeypatch.setattr("gateway.calibrations.activation.Activation.use_offered", refuse)
    monkeypatch.setattr("gateway.calibrations.activation.Activation.roll_back", refuse)
    for request in ({"use": 2}, {"rollback": True}):
        with pytest.raises(CliError, match=f"{code} it says why") as ended:
            store_access.change_calibration(tmp_path, "demo", request)
        assert ended.value.exit_code == exit_code


def test_the_rig_file_of_a_recording_is_taken_while_it_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "rig.yaml"
    for header, there, rig in (
        ({"rig_file": str(file)}, False, "demo"),
        ({"rig_file": str(file)}, True, str(file)),
        ({"rig_file": ""}, True, "demo"),
        ({}, True, "demo"),
    ):
        if there:
            file.touch()
        monkeypatch.setattr(resume, "read_header", lambda path, header=header: header)
        assert resume.rig_of(Path("0001.fgr"), "demo") == rig


def test_a_recording_without_labels_has_not_come_to_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    for labels, is_finished in (
        (None, False),
        (SimpleNamespace(is_finished=True), True),
        (SimpleNamespace(is_finished=False), False),
    ):
        monkeypatch.setattr(resume, "Labels", SimpleNamespace(of=lambda columns, labels=labels: labels))
        recording: Any = SimpleNamespace(columns={})
        assert resume._is_finished(recording) is is_finished


@pytest.mark.parametrize(("minor_points", "first_group"), [(0, 1), (32, 2)])
def test_a_resumed_ladder_whose_groups_are_climbed_begins_where_it_may(minor_points: int, first_group: int) -> None:
    """With a walk behind it only that is left; without, the last group is climbed again: a run has a group at least."""
    plan = {"groups": 2, "minor_points": minor_points}
    rest = RestOfLadder(plan, 2, [1], "", "", Path("0001.fgr"), finished=False)
    assert rest.plan_with({})["first_group"] == first_group
