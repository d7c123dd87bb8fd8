"""A recording through the control code again: the same set-up decides the same, another one is told by signal."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gateway.bsfm.model import Calibration
from gateway.codes.faults import FaultCode
from gateway.control import CellMap
from gateway.control.settings import ValveControl
from gateway.profiles import Rig
from gateway.recording import Recording, RecordingError, list_recordings, read_recording
from gateway.recording.calibrations_used import CalibrationUsed, later_calibrations
from gateway.registers.words import State
from gateway.service.replayed_control import ReplaySetup, SignalDifference, compare_decisions, replay_control
from gateway.service.running_rig.recording.recordings import Recordings
from tests.disk.at_once import AtOnce
from tests.service.rigs import demo, with_supervision
from tests.service.wired import ENABLE, Wired


def record_work(state: Path, later: Calibration | None = None, rig: Rig | None = None) -> Recording:
    """Record some levels of force, from OFF to OFF; commands come between two rows, and one step is shorter than a row.
    later: taken into use behind the second level."""
    wired = Wired(rig).ready()
    recordings = Recordings(state / "recordings", wired.rig, lambda cause, sentence: None, AtOnce())
    recordings.start()
    wired.loop.recordings = recordings
    wired.run(0.2)
    for level_n in (20.0, 35.0, 35.1, 10.0):
        wired.write(0, ENABLE, round(level_n * 100))
        wired.run(0.804)
        if later and level_n == 35.0:
            wired.controller.use(wired.rig.calibration_in_use(later))
            recordings.calibration = later
    wired.write(0, 0, 0)
    wired.run(0.2)
    recordings.flush(1e9)
    recordings.stop()
    return read_recording(list_recordings(state)[-1].path)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record_work(tmp_path_factory.mktemp("replay"))


@pytest.fixture(scope="module")
def own() -> ReplaySetup:
    rig = Wired().rig
    return ReplaySetup("own", rig, rig.calibration)


def by_signal(differences: list[SignalDifference]) -> dict[str, SignalDifference]:
    return {one.signal: one for one in differences}


def scaled(calibration: Calibration, share: float) -> Calibration:
    """A calibration whose forces are that much larger."""
    rising, falling = (
        tuple(share * one for one in handles)
        for handles in (calibration.rising_handles_n, calibration.falling_handles_n)
    )
    return replace(calibration, rising_handles_n=rising, falling_handles_n=falling)


def test_the_same_setup_gives_no_difference_at_all(recording: Recording, own: ReplaySetup) -> None:
    one, other = replay_control(recording, own), replay_control(recording, own)
    differences = compare_decisions(recording.columns["time_s"], one, other)
    assert len(differences) == 8
    assert not [one for one in differences if one.rows]


def test_the_replay_decides_as_the_gateway_did(recording: Recording, own: ReplaySetup) -> None:
    """Up to what a recording does not hold: when between two rows a setting went out."""
    found = by_signal(compare_decisions(recording.columns["time_s"], recording.columns, replay_control(recording, own)))
    assert found["applied_n"].rms < 1e-6
    assert found["fault_code"].rows == 0
    assert found["state"].rows <= 6
    assert found["command_v"].rms < 0.17
    assert np.ptp(recording.columns["command_v"]) > 4.0


@pytest.mark.parametrize("rate_hz", [5.0, 10.0, 20.0, 25.0])
def test_a_slow_cells_recording_is_decided_on_at_the_ticks_between_its_rows(tmp_path: Path, rate_hz: float) -> None:
    """As control had. By its rows alone a ramp went on for 45 ms of 100: 5 N off, at 5 Hz a fault in place of the work."""
    rig = with_supervision(demo(), sample_timeout_s=0.5)
    assert rig.load_cell.device.stream
    device = replace(rig.load_cell.device, stream=replace(rig.load_cell.device.stream, rate_hz=rate_hz))
    control = replace(rig.control, defaults=replace(rig.control.defaults, force_ramp_n_per_s=50.0))
    rig = replace(rig, load_cell=replace(rig.load_cell, device=device), control=control)
    recording = record_work(tmp_path, rig=rig)
    replayed = replay_control(recording, ReplaySetup("own", rig, rig.calibration))
    found = by_signal(compare_decisions(recording.columns["time_s"], recording.columns, replayed))
    assert found["fault_code"].rows == 0
    assert found["applied_n"].rms < 0.25
    assert found["command_v"].rms < 0.4


def test_a_rig_with_a_valve_replays_what_it_pushed_with(recording: Recording, own: ReplaySetup) -> None:
    """Nobody read the valve back, so it was waited for to the end: 0 N in every row."""
    control = replace(own.rig.control, valve=ValveControl())
    with_valve = replace(own, rig=replace(own.rig, control=control))
    replayed, pushed = replay_control(recording, with_valve), replay_control(recording, own)
    assert pushed["applied_n"].max() == pytest.approx(35.1)
    assert not any(one.rows for one in compare_decisions(recording.columns["time_s"], pushed, replayed))


def test_another_calibration_differs_in_what_it_decides_and_not_in_what_it_was_asked(
    recording: Recording, own: ReplaySetup
) -> None:
    other = replace(own, calibration=scaled(own.calibration, 1.1))
    decided = [replay_control(recording, setup) for setup in (own, other)]
    found = by_signal(compare_decisions(recording.columns["time_s"], *decided))
    assert found["applied_n"].rows == 0
    assert found["feedforward_v"].rms > 0.1
    assert abs(found["command_v"].largest) > 0.2
    assert found["model_residual_n"].rms > 0.5


def test_a_calibration_taken_into_use_amid_a_recording_decides_from_there(own: ReplaySetup, tmp_path: Path) -> None:
    """Its header told the first one, and the replay blamed control for what the second had decided."""
    later = replace(scaled(own.calibration, 1.3), number=7)
    recorded = record_work(tmp_path, later)
    time_s = recorded.columns["time_s"]
    assert later_calibrations(recorded) == [CalibrationUsed(7, pytest.approx(1.81, abs=0.03))]
    begun_late = replace(recorded, columns=recorded.columns | {"time_s": time_s + 100.0})
    assert later_calibrations(begun_late) == [CalibrationUsed(7, pytest.approx(1.81, abs=0.03))], "since the first row"
    numbers = recorded.columns["calibration"].copy()
    numbers[5:8] = np.nan
    with_gap = replace(recorded, columns=recorded.columns | {"calibration": numbers})
    assert later_calibrations(with_gap) == later_calibrations(recorded), "what is not there is no other one"
    follows = replay_control(recorded, replace(own, later={7: later}))
    found = by_signal(compare_decisions(time_s, recorded.columns, follows))
    assert found["feedforward_v"].rms < 0.4
    alone = by_signal(compare_decisions(time_s, recorded.columns, replay_control(recorded, own)))
    assert alone["feedforward_v"].rms > 1.5


def test_a_lease_is_no_matter_of_a_replay_and_an_overload_is_one(recording: Recording, own: ReplaySetup) -> None:
    """No recording holds a heartbeat; what the cell said of a reading stands beside it. Behind a fault that the recording has
    not seen its next setpoint, as of a master that enables no more, ended the replay with an internal error."""
    supervision = replace(own.rig.control.supervision, lease_s=0.2)
    leased = replace(own.rig, control=replace(own.rig.control, supervision=supervision))
    assert not replay_control(recording, replace(own, rig=leased))["fault_code"].any()
    quality = np.zeros(recording.rows)
    quality[recording.rows // 2 :] = 2.0
    overloaded = replace(recording, columns=recording.columns | {"quality": quality})
    fault = replay_control(overloaded, own)["fault_code"]
    assert not fault[: recording.rows // 2].any() and FaultCode.OVER_FORCE in fault[recording.rows // 2 :]


def changed(recording: Recording, at: slice, **values: float) -> Recording:
    """The same with these values in some rows."""
    columns = {name: recording.columns[name].copy() for name in values}
    for name, value in values.items():
        columns[name][at] = value
    return replace(recording, columns=recording.columns | columns)


def test_behind_a_fault_that_was_reset_there_a_replay_goes_on(recording: Recording, own: ReplaySetup) -> None:
    n, lasts_s = recording.rows, float(np.ptp(recording.columns["time_s"])) + 0.01
    failed = changed(recording, slice(n // 2, n // 2 + 10), quality=2.0).columns
    again = recording.columns | {"time_s": recording.columns["time_s"] + lasts_s, "quality": np.zeros(n)}
    twice = {name: np.concatenate([failed[name], again[name]]) for name in failed}
    decided = replay_control(replace(recording, columns=twice, rows=2 * n), own)
    assert FaultCode.OVER_FORCE in decided["fault_code"][:n]
    assert not decided["fault_code"][n + n // 4 :].any()
    assert np.ptp(decided["applied_n"][n:]) > 30.0


def test_a_setpoint_that_a_row_does_not_hold_is_that_of_the_row_before(recording: Recording, own: ReplaySetup) -> None:
    at = slice(recording.rows // 3, recording.rows // 3 + 10)
    decided = replay_control(changed(recording, at, setpoint_n=np.nan), own)
    assert not [
        one
        for one in compare_decisions(recording.columns["time_s"], replay_control(recording, own), decided)
        if one.rows
    ]


def test_settings_that_nobody_saw_go_out_are_as_none_recorded(recording: Recording, own: ReplaySetup) -> None:
    without = replace(recording, columns={k: v for k, v in recording.columns.items() if not k.startswith("sent_")})
    unseen = changed(recording, slice(None), sent_v=np.nan, sent_age_s=np.nan)
    decided = [replay_control(one, own) for one in (without, unseen)]
    assert not [one for one in compare_decisions(recording.columns["time_s"], *decided) if one.rows]


def test_the_recorded_force_is_not_straightened_again(recording: Recording, own: ReplaySetup) -> None:
    bent = replace(own.rig, compensation=replace(own.rig.compensation, cell=CellMap(zero_n=5.0)))
    decided = [replay_control(recording, setup) for setup in (own, replace(own, rig=bent))]
    assert not [one for one in compare_decisions(recording.columns["time_s"], *decided) if one.rows]


def test_one_row_is_no_recording(recording: Recording, own: ReplaySetup) -> None:
    row = replace(recording, columns={name: values[:1] for name, values in recording.columns.items()}, rows=1)
    with pytest.raises(RecordingError, match="has 1 rows"):
        replay_control(row, own)


@pytest.mark.parametrize("rows", [1, None])
def test_a_recording_of_a_run_is_refused(recording: Recording, own: ReplaySetup, rows: int | None) -> None:
    """Also of one that is a part of it."""
    state = recording.columns["state"].copy()
    state[:rows] = State.CALIBRATING
    columns = recording.columns | {"state": state}
    with pytest.raises(RecordingError, match="ladder, a plan or a self-test"):
        replay_control(replace(recording, columns=columns), own)


def test_a_recording_of_a_pull_is_refused(recording: Recording, own: ReplaySetup) -> None:
    """It was replayed as a push: its readings were those of a cell whose sign has turned."""
    pulled = changed(recording, slice(100, 110), pulling=1.0)
    with pytest.raises(RecordingError, match="10 rows in which the tool pulled"):
        replay_control(pulled, own)
    before = replace(recording, columns={k: v for k, v in recording.columns.items() if k != "pulling"})
    decided = [replay_control(one, own) for one in (before, recording)]
    assert not [one for one in compare_decisions(recording.columns["time_s"], *decided) if one.rows]


def test_a_time_that_runs_backwards_is_refused_with_its_row(recording: Recording, own: ReplaySetup) -> None:
    """As by every other verb: control was played over it, and the differences told were of no machine."""
    time_s = recording.columns["time_s"].copy()
    time_s[50] = time_s[40]
    with pytest.raises(RecordingError, match=r"row 51, column time_s: .* time runs backwards"):
        replay_control(replace(recording, columns=recording.columns | {"time_s": time_s}), own)


def test_a_table_without_the_gateways_columns_is_refused(recording: Recording, own: ReplaySetup) -> None:
    columns = {name: recording.columns[name] for name in ("time_s", "force_n", "command_v")}
    with pytest.raises(RecordingError, match="has no column setpoint_n, state"):
        replay_control(replace(recording, columns=columns), own)


def test_the_largest_difference_is_told_with_its_sign_and_time() -> None:
    time_s = np.array([5.0, 5.1, 5.2])
    one = {
        "command_v": np.array([1.0, 2.0, 3.0]),
        "state": np.array([0.0, 1.0, 1.0]),
        "trim_v": np.array([1.0, 1.0, 1.0]),
    }
    other = {
        "command_v": np.array([1.0, 1.0, 3.5]),
        "state": np.array([0.0, 1.0, 4.0]),
        "trim_v": np.array([np.nan, 1.0, 1.5]),
    }
    found = by_signal(compare_decisions(time_s, one, other))
    assert (found["trim_v"].rows, found["trim_v"].largest) == (1, 0.5), "what only one of them knows is no difference"
    assert found["command_v"].largest == -1.0
    assert found["command_v"].at_s == pytest.approx(0.1)
    assert found["command_v"].rms == pytest.approx(np.sqrt(1.25 / 3))
    assert (found["state"].rows, found["state"].at_s) == (1, pytest.approx(0.2))
