"""A ladder that was cut, anywhere and by anything, and gone on with: nothing enters the fit twice or half, and the calibration
is as good as that of a run that nobody has cut.

The cut is made in the recording: a run that was ended, killed or unplugged leaves the rows so far and nothing else. What goes
on is a run of its own in virtual time, one for each number of groups that may be left.
"""

import errno
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gateway.bsfm import Calibration
from gateway.bsfm.ladder.labels import CHECK, DONE, WALK, Labels
from gateway.calibrations.store import CalibrationStore
from gateway.cli.calibration.resume import find_rest_of_ladder
from gateway.cli.errors import CliError
from gateway.profiles import load_rig
from gateway.recording import Recorder, Recording, RecordingError, read_recording
from gateway.registers.words import CalibrationPhase
from gateway.service.fitting.fit_process import fit_and_store
from gateway.service.fitting.ladder_source import RigContext, check_source, read_resumed
from gateway.service.running_rig import calibration_runs
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from tests.service.running_rig.runs.test_calibration_runs import kept
from tests.service.wired import Wired

PLAN = {"step_v": 1.0, "groups": 2, "minor_points": 24}
DEMO = RigContext(rig="demo")


class NoFit:
    """In place of the process that fits."""

    def __init__(self, recording: Path, *others: object) -> None:
        self.recording = recording

    def close(self) -> None: ...


def climbed(wired: Wired, runs: CalibrationRuns, request: dict[str, Any]) -> Recording:
    runs.answer(request)
    while runs.answer({})["phase"] != "fitting":
        wired.run(0.5)
    wired.run(0.1)
    return read_recording(Path(runs.status()["recording"]))


@dataclass(frozen=True)
class Runs:
    """whole: not cut; rest: by the number of groups that a cut run had, what goes on from recording 1."""

    whole: Recording
    rest: dict[int, Recording]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    state = tmp_path_factory.mktemp("runs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(calibration_runs, "FitLauncher", NoFit)
        recordings = []
        for first_group in (None, 1, 2):
            wired = Wired(seed=11 + (first_group or 0)).ready()
            runs = kept(wired, state)
            if first_group is None:
                recordings.append(climbed(wired, runs, {"plan": PLAN, "name": "left cell"}))
            else:
                plan = PLAN | {"first_group": first_group, "v_max_v": recordings[0].header["ladder"]["top_v"]}
                recordings.append(climbed(wired, runs, {"plan": plan, "continues": [1]}))
    return Runs(recordings[0], dict(zip((1, 2), recordings[1:], strict=True)))


def written(state: Path, recording: Recording, rows: int | None = None, **facts: object) -> Path:
    """The first rows of a recording, as the next one of this state directory."""
    header = {name: value for name, value in recording.header.items() if name not in ("number", "columns")} | facts
    recorder = Recorder(state / "recordings", header, tuple(recording.columns))
    for row in np.stack(list(recording.columns.values()), axis=1)[:rows].tolist():
        recorder.append(tuple(row))
    recorder.close()
    return recorder.path


def groups_left_behind(recording: Recording, rows: int) -> int:
    """Told by the plan alone: the check's 9 stairs, then 17 to a group; a stair is left when the next one has begun."""
    return min(2, max(0, int(recording.columns["stair"][rows - 1]) - 9) // 17)


def test_a_fit_that_cannot_start_is_told_and_its_ladder_waits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    monkeypatch.setattr(calibration_runs, "FitLauncher", refuse)
    wired = Wired(seed=11).ready()
    runs = kept(wired, tmp_path)
    runs.answer({"plan": {"step_v": 2.0, "groups": 1, "minor_points": 0}})
    while runs.answer({})["phase"] not in ("refused", "fitting"):
        wired.run(0.5)
    wired.run(0.1)
    assert runs.answer({})["phase"] == "refused"
    assert wired.said("A331 the fit did not start: Resource temporarily unavailable; force-gateway fit 1")


def test_the_labels_are_the_registers_words() -> None:
    assert (CalibrationPhase.CHECK, CalibrationPhase.MINOR_LOOPS, CalibrationPhase.FITTING) == (CHECK, WALK, DONE)


def test_wherever_a_run_is_cut_only_whole_groups_count_and_the_others_are_climbed_again(
    runs, tmp_path: Path, budget: int
) -> None:
    path = written(tmp_path, runs.whole)
    rows, seen, top_v = runs.whole.rows, set(), runs.whole.header["ladder"]["top_v"]
    for cut in [
        *range(1, rows, 197 if budget > 1 else 2997),
        *(np.flatnonzero(np.diff(runs.whole.columns["group"])) + 1).tolist(),
        rows - 1,
    ]:
        path.unlink()
        assert written(tmp_path, runs.whole, cut) == path
        rest, groups = find_rest_of_ladder(tmp_path), groups_left_behind(runs.whole, cut)
        assert (rest.groups, rest.earlier) == (groups, [1] if groups else []), f"cut at row {cut}"
        assert not rest.is_whole(rest.plan)
        plan = rest.plan_with({})
        assert (plan["first_group"], plan["v_max_v"], plan["step_v"]) == (groups, top_v, 1.0)
        seen.add(groups)
    assert seen == {0, 1, 2}


@pytest.mark.sampled
@pytest.mark.parametrize("stair", [0, 4, 9, 20, 26, 34, 43, 60])
def test_a_run_that_was_cut_gives_a_calibration_as_good_as_one_that_was_not(runs, stair: int, tmp_path: Path) -> None:
    cut = int(np.searchsorted(runs.whole.columns["stair"], stair)) + 20
    written(tmp_path, runs.whole, cut)
    rest = find_rest_of_ladder(tmp_path)
    last = written(tmp_path, runs.rest[rest.groups] if rest.groups else runs.whole, continues=rest.earlier)
    checked, whole = (check_source(read_recording(path), DEMO) for path in (last, runs.whole.path))
    assert checked.ladder.voltage_v == pytest.approx(whole.ladder.voltage_v)
    assert checked.ladder.direction.tolist() == whole.ladder.direction.tolist()
    assert checked.ladder.group.tolist() == whole.ladder.group.tolist()
    assert checked.minor_v == pytest.approx(whole.minor_v)
    assert np.abs(checked.ladder.force_n - whole.ladder.force_n).max() < 0.6
    assert not [
        note for note in checked.notes if rest.groups and "left out" in note and not note.startswith("0001.fgr: ")
    ]


@pytest.fixture(scope="module")
def whole_fit(runs, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The state directory of the run that nobody has cut, and what its fit answered."""
    state = tmp_path_factory.mktemp("whole")
    return state, fit_and_store(written(state, runs.whole), "demo", state)


def stored_calibration(state: Path, result: dict[str, Any]) -> Calibration:
    return CalibrationStore(state, load_rig("demo").calibration).load(result["stored"])


@pytest.mark.long
@pytest.mark.parametrize("groups", [1, 2])
def test_the_fit_of_a_resumed_run_is_offered_and_its_error_is_that_of_a_whole_one(
    runs, whole_fit, groups, tmp_path: Path
) -> None:
    written(tmp_path, runs.whole, int(np.searchsorted(runs.whole.columns["stair"], 9 + 17 * groups + 3)))
    path = written(tmp_path, runs.rest[groups])
    resumed, whole = stored_calibration(tmp_path, fit_and_store(path, "demo", tmp_path)), stored_calibration(*whole_fit)
    for stored in (resumed, whole):
        assert (stored.order, stored.rejected) == (2, "")
    assert resumed.rms_n < 1.2 * whole.rms_n + 0.02  # 59 points: two runs differ by so much for themselves


def test_a_finished_run_repeats_nothing_and_its_fit_is_made_once(whole_fit) -> None:
    state, first = whole_fit
    (path,) = (state / "recordings").iterdir()
    rest = find_rest_of_ladder(state)
    assert rest.is_whole(rest.plan)
    assert rest.name == "left cell" and rest.plan["tare"] is False
    assert fit_and_store(path, "demo", state) == first
    assert [entry.number for entry in CalibrationStore(state).list()] == [first["stored"]]
    more = rest.plan_with({"groups": 3})
    assert (more["first_group"], rest.is_whole(more)) == (2, False)


def test_of_other_recordings_only_the_headers_are_read(runs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Recordings of days have gigabytes each, and all of them were read into memory."""
    ladder = written(tmp_path, runs.whole)
    for header in ({}, {"rig": "demo"}):
        Recorder(tmp_path / "recordings", header, ("time_s",)).close()
    (tmp_path / "recordings" / "0004.fgr").write_bytes(b"damaged")
    whole: list[Path] = []
    read = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: (whole.append(path), read(path))[1])
    assert find_rest_of_ladder(tmp_path).last == ladder
    assert whole == [ladder]


def test_an_earlier_part_that_is_gone_is_climbed_again(runs, tmp_path: Path) -> None:
    gone = written(tmp_path, runs.whole, int(np.searchsorted(runs.whole.columns["stair"], 30)))
    written(tmp_path, runs.rest[1], int(np.searchsorted(runs.rest[1].columns["stair"], 12)), continues=[1])
    assert (find_rest_of_ladder(tmp_path).groups, find_rest_of_ladder(tmp_path).earlier) == (1, [1])
    gone.unlink()
    assert (find_rest_of_ladder(tmp_path).groups, find_rest_of_ladder(tmp_path).earlier) == (0, [])


def test_a_tare_that_a_restart_has_lost_moves_no_group(runs, tmp_path: Path) -> None:
    cut = int(np.searchsorted(runs.whole.columns["stair"], 30))
    tared = replace(runs.whole, columns=runs.whole.columns | {"force_n": runs.whole.columns["force_n"] - 1.7})
    written(tmp_path, tared, cut, zero_n=1.7)
    last = written(tmp_path, runs.rest[1], continues=[1], zero_n=0.0)
    checked, whole = check_source(read_recording(last), DEMO), check_source(tared, DEMO)
    assert np.abs(checked.ladder.force_n - whole.ladder.force_n).max() < 0.6
    assert any("another zero" in note for note in checked.notes)


def test_a_part_that_tells_no_zero_stays_as_it_is(tmp_path: Path) -> None:
    for header in ({"zero_n": 1.7}, {"continues": [1]}):
        recorder = Recorder(tmp_path, header, ("time_s", "force_n"))
        recorder.append((0.0, 5.0))
        recorder.close()
    forces_n = [part.columns["force_n"].tolist() for part in read_resumed(read_recording(recorder.path))]
    assert forces_n == [[5.0], [5.0]]


def test_only_the_last_stair_left_makes_a_run_whole(runs) -> None:
    labels = Labels.of(runs.whole.columns)
    assert labels is not None
    assert labels.last_stair == runs.whole.header["ladder"]["stairs"]
    assert labels.has_walk
    before = Labels.of({name: values[:-1] for name, values in runs.whole.columns.items()})
    assert before is not None
    assert not before.has_walk


def test_without_a_recorded_ladder_there_is_nothing_to_go_on_with(tmp_path: Path) -> None:
    with pytest.raises(CliError, match="E422"):
        find_rest_of_ladder(tmp_path)


def test_a_resumed_run_without_the_recording_that_it_goes_on_from_names_it(runs, tmp_path: Path) -> None:
    """`0001.fgr: No such file or directory` was the answer to `fit 0002.fgr`."""
    written(tmp_path, runs.whole, int(np.searchsorted(runs.whole.columns["stair"], 30)))
    path = written(tmp_path, runs.rest[1])
    path.with_name("0001.fgr").unlink()
    with pytest.raises(RecordingError, match=r"0002.fgr: goes on from 0001.fgr, .* copy it there"):
        check_source(read_recording(path), DEMO)
