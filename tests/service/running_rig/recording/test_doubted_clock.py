"""A clock that is years ahead at the start deletes nothing at once; one that is behind is said, for it keeps everything."""

import os
import time
from pathlib import Path

import pytest

from gateway.profiles.recordings_section import Retention
from gateway.recording import Recorder, recording_paths
from gateway.recording.care import clock_doubt
from gateway.recording.care.clock_doubt import ClockDoubt, doubt_clock
from gateway.recording.care.keeping import choose_prunable
from gateway.service.running_rig.recording import retention as module
from gateway.service.running_rig.recording.retention import RecordingRetention
from tests.recording.care.test_care import NOW_S, record

DAY_S = 86400.0


class Machine:
    """A gateway that prunes, on a machine whose clock can be set."""

    def __init__(self, state: Path, limit: Retention, monkeypatch: pytest.MonkeyPatch) -> None:
        self.state, self.said, self.wall_s = state, [], NOW_S
        for place in (module.time, time):
            monkeypatch.setattr(place, "time", lambda: self.wall_s)
        self.retention = RecordingRetention(state, limit, lambda cause, text: self.said.append(text))  # type: ignore[arg-type]
        self.retention.close()

    def prune(self, now_s: float) -> list[str]:
        return [one.path.stem for one in self.retention._prune(now_s)]


def test_a_clock_that_is_years_ahead_takes_nothing_for_a_day_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for days_ago in (400.0, 3.0, 2.0):
        record(tmp_path, days_ago=days_ago)
    machine = Machine(tmp_path, Retention(days=90.0), monkeypatch)
    machine.wall_s = NOW_S + 3650 * DAY_S
    assert machine.prune(100.0) == machine.prune(3700.0) == []
    assert len(machine.said) == 1
    assert machine.said[0].startswith(
        "W252 by this machine's clock (2033-11-11) all recordings of more than a day ago are older"
    )
    assert "0003.fgr, is of 2023-11-12" in machine.said[0]
    machine.wall_s = NOW_S + 0.5 * DAY_S  # somebody, or a time server, has set it
    assert machine.prune(7300.0) == []
    assert machine.prune(100.0 + 1.01 * DAY_S) == ["0001"], "which is really so old"
    assert len(recording_paths(tmp_path)) == 2


def test_what_was_recorded_by_the_wrong_clock_is_no_witness_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record(tmp_path, days_ago=2.0)
    machine = Machine(tmp_path, Retention(days=90.0), monkeypatch)
    machine.wall_s = NOW_S + 3650 * DAY_S
    assert machine.prune(0.0) == []
    record(tmp_path, days_ago=-3649.9)
    assert machine.prune(3600.0) == []


def test_behind_a_rest_that_was_really_so_long_they_go_a_day_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record(tmp_path, days_ago=100.0)
    machine = Machine(tmp_path, Retention(days=90.0), monkeypatch)
    assert [machine.prune(hours * 3600.0) for hours in (0, 1, 23, 24)] == [[], [], [], ["0001"]]
    assert len(machine.said) == 1


def test_what_takes_too_much_room_goes_whatever_the_clock_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = [record(tmp_path, days_ago=100.0) for _ in range(3)]
    limit = Retention(days=90.0, bytes=1_000_000)
    object.__setattr__(limit, "bytes", 2 * paths[0].stat().st_size)
    assert Machine(tmp_path, limit, monkeypatch).prune(0.0) == ["0001"]


@pytest.mark.parametrize("wall_s", [3600.0, NOW_S - 700 * DAY_S])
def test_a_clock_that_is_behind_is_said_once(wall_s: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(tmp_path, days_ago=3.0)
    machine = Machine(tmp_path, Retention(days=90.0), monkeypatch)
    machine.wall_s = wall_s
    assert machine.prune(0.0) == machine.prune(3600.0) == []
    (sentence,) = machine.said
    assert sentence.startswith("W252 ") and "timedatectl" in sentence
    assert ("nobody has set" in sentence) is (wall_s < DAY_S)


def test_a_clock_that_goes_along_is_not_doubted(tmp_path: Path) -> None:
    path = record(tmp_path, days_ago=3.0)
    assert doubt_clock([path, tmp_path / "gone.fgr"], 90.0, NOW_S).kind is ClockDoubt.NONE
    assert doubt_clock([], 90.0, NOW_S).kind is ClockDoubt.NONE
    os.utime(path, (3600.0, 3600.0))
    assert doubt_clock([path], 90.0, NOW_S).kind is ClockDoubt.NONE, "its age is not known, and it does not go"


def test_a_year_that_no_calendar_has_is_said_as_its_last_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = record(tmp_path, days_ago=3.0)
    monkeypatch.setattr(clock_doubt, "_ended", lambda paths: [(2.0e12, path.name)])
    doubt = doubt_clock([path], 90.0, NOW_S)
    assert doubt.kind is ClockDoubt.BEHIND and "ended on 9999-12-31" in doubt.sentence


def test_what_is_being_recorded_is_no_witness_for_the_clock(tmp_path: Path) -> None:
    """Its time is that of the clock itself: beside one that had just begun nothing was doubted, and all others went."""
    record(tmp_path, days_ago=2.0)
    growing = Recorder(tmp_path / "recordings", {}, ("time_s",))
    now_s = NOW_S + 3650 * DAY_S
    os.utime(growing.path, (now_s, now_s))
    paths = recording_paths(tmp_path)
    assert doubt_clock(paths, 90.0, now_s).kind is ClockDoubt.AHEAD
    growing.close()
    assert doubt_clock(paths, 90.0, now_s).kind is ClockDoubt.AHEAD


@pytest.mark.parametrize(("ahead_days", "kind"), [(0.9, ClockDoubt.NONE), (1.1, ClockDoubt.BEHIND)])
def test_a_recording_of_more_than_a_day_from_now_is_no_summer_time(
    ahead_days: float, kind: ClockDoubt, tmp_path: Path
) -> None:
    record(tmp_path, days_ago=-ahead_days)
    assert doubt_clock(recording_paths(tmp_path), 90.0, NOW_S).kind is kind


@pytest.mark.parametrize("is_restarted", [False, True])
def test_a_recording_that_ended_by_the_wrong_clock_before_anybody_looked_is_no_witness_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, is_restarted: bool
) -> None:
    """The clock leapt while the rig recorded, and the next recording that ended by its length took all others with it; so did a
    restart within the day."""
    for days_ago in (400.0, 3.0, 2.0):
        record(tmp_path, days_ago=days_ago)
    machine = Machine(tmp_path, Retention(days=90.0), monkeypatch)
    assert machine.prune(0.0) == ["0001"]
    machine.wall_s = NOW_S + 3650 * DAY_S
    if is_restarted:
        assert machine.prune(3600.0) == []
        machine = Machine(tmp_path, Retention(days=90.0), monkeypatch)
        machine.wall_s = NOW_S + 3650 * DAY_S
    record(tmp_path, days_ago=-3650.0)
    assert machine.prune(3700.0) == machine.prune(3700.0 + 0.9 * DAY_S) == []
    assert machine.said[-1].startswith(
        "W252 by this machine's clock (2033-11-11) all recordings of more than a day ago are"
    )
    assert machine.prune(3700.0 + 1.1 * DAY_S) == ["0002", "0003"], "nobody has set it: it was right"


def test_a_clock_that_leaps_again_weeks_later_is_doubted_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(tmp_path, days_ago=3.0)
    machine = Machine(tmp_path, Retention(days=90.0), monkeypatch)
    for leap in (0, 1):
        at_s = leap * 20.0 * DAY_S
        machine.wall_s = NOW_S + 3650 * DAY_S
        assert machine.prune(at_s + 3600.0) == []
        machine.wall_s = NOW_S
        assert machine.prune(at_s + 7200.0) == machine.prune(at_s + 2.0 * DAY_S) == []
    assert len(machine.said) == 2


def test_of_hours_that_are_kept_the_older_ones_go_while_the_clock_goes_along(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for hours_ago in (8.0, 5.0, 1.0):
        record(tmp_path, days_ago=hours_ago / 24.0)
    assert Machine(tmp_path, Retention(days=0.25), monkeypatch).prune(0.0) == ["0001"]


def test_what_was_recorded_before_anybody_had_set_the_clock_goes_in_its_turn(tmp_path: Path) -> None:
    """Behind a power cut, on a machine whose clock begins in 1970: it went first, before what was ten days old."""
    paths = [record(tmp_path, days_ago=days_ago) for days_ago in (10.0, 5.0, 1.0)]
    os.utime(paths[2], (3600.0, 3600.0))
    limit = Retention(days=90.0, bytes=1_000_000)
    object.__setattr__(limit, "bytes", 2 * paths[0].stat().st_size)
    assert [one.path for one in choose_prunable(paths, limit, "", NOW_S)] == paths[:1]


@pytest.mark.parametrize(("ago_days", "kind"), [(0.4, ClockDoubt.NONE), (0.6, ClockDoubt.AHEAD)])
def test_where_recordings_stay_for_less_than_a_day_a_clock_is_doubted_by_those_of_hours_ago(
    ago_days: float, kind: ClockDoubt, tmp_path: Path
) -> None:
    record(tmp_path, days_ago=ago_days)
    doubt = doubt_clock(recording_paths(tmp_path), 0.5, NOW_S)
    assert doubt.kind is kind and ("of more than 6 h ago" in doubt.sentence) is (kind is ClockDoubt.AHEAD)


@pytest.mark.parametrize(("leap_days", "days", "lost"), [(6.5, 7.0, 5), (0.9, 7.0, 0), (30.0, 90.0, 0)])
def test_a_clock_that_leaps_ahead_under_a_running_gateway_is_not_believed_for_a_day(
    leap_days: float, days: float, lost: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By less than recordings are retained: the newest one seemed young enough, and all but it went."""
    for days_ago in (6.0, 5.0, 4.0, 3.0, 2.0, 0.3):
        record(tmp_path, days_ago=days_ago)
    machine = Machine(tmp_path, Retention(days=days), monkeypatch)
    assert machine.prune(0.0) == []
    machine.wall_s = NOW_S + leap_days * DAY_S
    assert machine.prune(3600.0) == machine.prune(7200.0) == machine.prune(0.9 * DAY_S) == []
    assert [f"leapt ahead by {leap_days:.1f} days" in said for said in machine.said] == [True] * (leap_days > 1.0)
    assert len(machine.prune(3700.0 + DAY_S)) == lost, "nobody has set it: it was right"


def test_a_machine_that_sleeps_for_days_has_no_clock_that_leaps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for days_ago in (6.0, 0.3):
        record(tmp_path, days_ago=days_ago)
    machine = Machine(tmp_path, Retention(days=7.0), monkeypatch)
    assert machine.prune(0.0) == []
    machine.wall_s = NOW_S + 3.0 * DAY_S
    monkeypatch.setattr(module, "suspended_s", lambda: 3.0 * DAY_S)
    assert machine.prune(3600.0) == ["0001"] and not machine.said
