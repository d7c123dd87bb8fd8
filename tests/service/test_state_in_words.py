"""The whole state that control answers is its own: each figure from where it is made, under its own name, and none invented."""

import json
import math
import time
from pathlib import Path
from typing import Any

import pytest

from gateway.live.live_state import LiveState
from gateway.recording.label import RecordingLabel
from gateway.registers.words import LimitedBy, State
from gateway.service.live_answers import _age_s
from tests.service.requests.stage import Stage, stage
from tests.service.requests.test_hostile_requests import PLAN
from tests.service.wired import ENABLE

__all__ = ["stage"]


def ask(stage: Stage, **request: Any) -> dict[str, Any]:
    return stage.ask(json.dumps(request).encode())


def state_of(stage: Stage) -> LiveState:
    return LiveState.from_json(ask(stage, do="state"))


def test_forces_lines_and_loop_are_those_of_control(stage: Stage) -> None:
    stage.wired.write(0, ENABLE, 1200)
    stage.wired.until(lambda: stage.wired.state is State.HOLDING, 3.0)
    state, loop = state_of(stage), stage.wired.loop
    decision, force = loop.decision, state.force
    assert decision is not None
    assert (force.requested_n, force.accepted_n, force.applied_n) == (
        decision.force_requested_n,
        decision.force_accepted_n,
        decision.force_applied_n,
    )
    assert (force.measured_n, force.model_residual_n) == (decision.force_measured_n, decision.model_residual_n)
    assert (force.voltage_v, force.feedforward_v, force.trim_v) == (
        decision.voltage_v,
        decision.feedforward_v,
        decision.trim_v,
    )
    assert force.pressure_kpa == pytest.approx(loop.output.pressure_pa / 1e3)
    assert (force.limited_by, state.faults) == ("", ())
    assert (state.mode, state.enable_block) == ("force", "")
    assert set(state.status) == {str(bit.name).lower() for bit in decision.status} != set()
    counts, cell = loop.output.counts, loop.cell_counts
    assert (state.output.port, state.output.device) == ("/dev/pts/1", stage.wired.rig.output.device.name)
    assert (state.output.asked, state.output.heard, state.output.garbled) == (counts.asked, counts.heard, 0)
    assert (state.load_cell.port, state.load_cell.device) == ("/dev/pts/2", stage.wired.rig.load_cell.device.name)
    assert (state.load_cell.asked, state.load_cell.heard) == (cell.asked, cell.heard)
    assert state.load_cell.age_s is not None and 0.0 <= state.load_cell.age_s < 0.1
    health = loop.health
    assert (state.loop.hz, state.loop.ticks, state.loop.missed) == (
        stage.wired.rig.loop_hz,
        health.ticks,
        health.missed_ticks,
    )
    assert (state.loop.late_p50_us, state.loop.late_p99_us) == (health.lateness_us(0.5), health.lateness_us(0.99))
    assert state.loop.step_us == pytest.approx(health.loop_time_s * 1e6)
    assert state.limits.voltage_max_v == stage.wired.rig.control.limits.voltage_max_v
    assert state.limits.lease_s == stage.wired.rig.control.supervision.lease_s


def test_a_line_that_is_silent_is_told_with_how_long_and_one_that_never_spoke_with_nothing(stage: Stage) -> None:
    stage.wired.write(0, ENABLE, 1200)
    stage.wired.run(0.3)
    stage.wired.world.simulate({"do": "sim", "set": {"output.silent": True, "cell.silent": True}})
    stage.wired.run(0.2)
    state, loop = state_of(stage), stage.wired.loop
    since_s = loop.output.unanswered_since_s
    assert since_s
    assert state.output.age_s == pytest.approx(stage.wired.now_s - since_s) and state.output.age_s > 0.05
    assert state.load_cell.age_s == pytest.approx(0.2, abs=0.1)
    loop.output.acknowledged_v = None
    loop.sample = None
    state = state_of(stage)
    assert (state.output.age_s, state.load_cell.age_s) == (None, None)


def test_a_fault_is_told_with_its_cure_and_since_when_and_why_no_enable_is_taken(stage: Stage) -> None:
    before_s = time.time()
    stage.wired.write(0, ENABLE, 1200)
    stage.wired.run(0.3)
    stage.wired.world.simulate({"do": "sim", "set": {"cell.silent": True}})
    stage.wired.until(lambda: stage.wired.state is State.FAULT, 3.0)
    stage.server.live.alarm_times.follow(stage.wired.loop.decision)
    state = state_of(stage)
    (fault,) = state.faults
    assert fault.code == "A311" and fault.title and fault.cure
    assert before_s <= fault.since_unix_s <= time.time()
    assert state.refusals == stage.wired.bank.refusals
    assert state.state == "fault" and state.enable_block.startswith("W")
    assert state.force.measured_n is None or state.force.measured_n == pytest.approx(0.0, abs=60.0)


def test_calibration_plant_recording_run_and_residual_are_told_by_who_has_them(stage: Stage) -> None:
    rig = stage.wired.rig
    ask(stage, do="residual", cause=12, sentence="friction has doubled", counters={"looks": 3})
    stage.wired.run(1.0)
    state = state_of(stage)
    assert (state.calibration.name, state.calibration.kind) == (rig.calibration.name, "built in")
    assert state.calibration.date_utc == rig.calibration.date_utc
    assert state.calibration.age_s == pytest.approx(_age_s(rig.calibration.date_utc), abs=60.0)
    assert (state.plant.number, state.plant.name) == (0, stage.plants.status()["name"])
    assert (state.residual.cause, state.residual.effect) == (12, "coulomb-friction")
    assert (state.residual.sentence, state.residual.age_s) == ("friction has doubled", pytest.approx(1.0, abs=0.01))
    assert state.residual.why_skipped == ""
    ask(stage, do="residual", cause=0, why_skipped="a fault stood")
    assert (state_of(stage).residual.why_skipped, state_of(stage).residual.sentence) == ("a fault stood", "")
    assert state.recording.on is False and state.recording.path == ""
    assert ask(stage, do="record", on=True, name="mine")["ok"]
    stage.wired.run(0.5)
    recording = state_of(stage).recording
    assert (recording.on, recording.number, Path(recording.path).stem) == (True, 1, "0001")
    assert recording.rows == stage.recordings.status()["rows"] > 10
    assert ask(stage, do="record")["recording"] == recording.path, "a question ends nothing"
    assert ask(stage, do="record", on=False)["ok"]
    assert state_of(stage).recording.on is False
    assert ask(stage, do="calibrate", plan=PLAN)["ok"]
    stage.wired.run(1.0)
    run, status = state_of(stage).run, stage.calibration_runs.status()
    assert run.running and (run.phase, run.share, run.eta_s) == (
        status["phase"],
        status["progress"],
        status["eta_s"],
    )
    assert run.phase != "idle" and run.eta_s > 0.0


@pytest.mark.parametrize(
    ("pdu", "unit", "answer", "why"),
    [
        ("0300640001", 1, "0302", ""),
        ("0327100001", 1, "8302", "10000"),
        ("0300640001", 9, "830b", "unit id 9"),
        ("06000a0000", 1, "06000a0000", ""),
    ],
)
def test_a_request_of_a_process_beside_control_is_answered_as_on_a_face(
    stage: Stage, pdu: str, unit: int, answer: str, why: str
) -> None:
    given = ask(stage, do="modbus", via="web", unit=unit, pdu=pdu)
    assert given["pdu"].startswith(answer)
    assert why in given.get("refusal", "")
    assert ("refusal" in given) == bool(why), "a refusal of before is none of this answer"


def test_a_refusal_of_before_is_none_of_a_later_answer(stage: Stage) -> None:
    assert "refusal" in ask(stage, do="modbus", via="web", pdu="0327100001")
    assert "refusal" not in ask(stage, do="modbus", via="web", pdu="0300640001")


def test_what_others_have_is_told_as_they_tell_it(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    parts, loop = stage.server.live._parts, stage.wired.loop
    stage.wired.write(3, 1)
    stage.wired.run(1.5)
    calibration = {"active": 7, "name": "ladder", "built_in": False}
    monkeypatch.setitem(parts.status, "calibration", lambda: calibration)
    monkeypatch.setitem(parts.status, "plant", lambda: {"active": 3, "name": "stiffer"})
    run = {"running": True, "phase": "up", "progress": 0.25, "eta_s": 9.0, "ended": "well", "result": {"rms_n": 0.2}}
    monkeypatch.setattr(parts.runs, "status", lambda: run)
    monkeypatch.setattr(parts.runs, "stored", 17)
    monkeypatch.setattr(loop.health, "missed_ticks", 5)
    monkeypatch.setattr(loop.health, "loop_time_s", 2e-4)
    monkeypatch.setattr(type(loop.health), "lateness_us", lambda health, share: {0.5: 64, 0.99: 1024}[share])
    loop.cell_counts.garbled, loop.cell_counts.asked = 4, 9
    loop.output.counts.garbled = 2
    stage.wired.bank.refusals = 6
    state = state_of(stage)
    assert (state.calibration.number, state.calibration.name, state.calibration.kind) == (7, "ladder", "stored")
    assert (state.plant.number, state.plant.name, state.mode) == (3, "stiffer", "voltage")
    told = state.run
    assert (told.share, told.said, told.stored, told.result) == (0.25, "well", 17, {"rms_n": 0.2})
    assert (state.loop.missed, state.loop.late_p50_us, state.loop.late_p99_us) == (5, 64, 1024)
    assert state.loop.step_us == pytest.approx(200.0)
    assert (state.output.garbled, state.refusals) == (2, 6)
    assert state.writers["mode"].age_s == pytest.approx(1.5, abs=0.06)
    assert (state.load_cell.garbled, state.load_cell.asked) == (4, 9)


def test_what_is_no_number_is_told_as_nothing_and_a_limit_by_its_name(stage: Stage) -> None:
    loop = stage.wired.loop
    assert loop.decision is not None
    nothing = {"force_measured_n": math.nan, "model_residual_n": math.nan, "voltage_v": math.inf}
    loop.decision = loop.decision._replace(limited_by=LimitedBy.VOLTAGE_SLEW, **nothing)
    loop.output.pressure_pa = math.nan
    loop.health.loop_time_s = math.nan
    state = state_of(stage)
    force = state.force
    assert (force.measured_n, force.model_residual_n, force.voltage_v, force.pressure_kpa) == (None,) * 4
    assert state.loop.step_us is None
    assert force.limited_by == "voltage slew"


@pytest.mark.parametrize("pdu", ["", "zz", "0" * 508])
def test_what_is_no_request_is_refused(stage: Stage, pdu: str) -> None:
    assert ask(stage, do="modbus", via="web", pdu=pdu)["ok"] is False


def test_a_calibration_is_as_old_as_its_date_says() -> None:
    now_s = time.time()
    two_days = now_s - 2 * 86400.0
    for form in ("%Y-%m-%dT%H:%M:%SZ", "%Y-%m-%dT%H:%M:%S+00:00", "%Y-%m-%dT%H:%M:%S"):
        assert _age_s(time.strftime(form, time.gmtime(two_days))) == pytest.approx(2 * 86400.0, abs=5.0)
    assert _age_s(time.strftime("%Y-%m-%d", time.gmtime(now_s + 3 * 86400.0))) == 0.0
    assert _age_s("some day") is None


def test_what_the_socket_answers_of_changes_is_what_was_asked(stage: Stage) -> None:
    asked = list[Any]()
    stage.upload.use = lambda number, force=False: asked.append((number, force)) or {}  # type: ignore[method-assign]
    stage.upload.rollback = lambda: asked.append("back") or {}  # type: ignore[method-assign]
    ask(stage, do="calibration")
    ask(stage, do="calibration", use=7)
    ask(stage, do="calibration", use=8, force=True)
    ask(stage, do="calibration", rollback=True)
    assert asked == [(7, False), (8, True), "back"]
    assert ask(stage, do="last-refusal")["sentence"] == ""
    ask(stage, do="modbus", via="web", pdu="0327100001")
    refusal = ask(stage, do="last-refusal")
    assert refusal["address"] == 10000 and refusal["reason"] == 1 and "10000" in refusal["sentence"]
    for verb in ("last-writer", "last-refusal", "health", "running", "state"):
        assert ask(stage, do=verb, more=1)["ok"] is False
    stage.wired.write(1, 500)
    writer = ask(stage, do="last-writer")
    assert writer["owner"] == "10.0.0.5" and writer["writers"]["force_setpoint"]["time_s"] == stage.wired.now_s
    health = ask(stage, do="health")
    assert health["ticks"] == stage.wired.loop.health.ticks
    assert health["loop_time_us"] == pytest.approx(stage.wired.loop.health.loop_time_s * 1e6)


@pytest.mark.parametrize("via", ["web", "mqtt", "opcua"])
def test_who_commands_by_another_way_is_named_by_it(stage: Stage, via: str) -> None:
    ask(stage, do="modbus", via=via, pdu="060001" + "01f4")
    assert state_of(stage).owner == via
    assert ask(stage, do="modbus", via="mqtt" if via == "web" else "web", pdu="0600010064")["pdu"] == "8606"


def test_a_recording_is_begun_with_what_was_said_of_it_and_how_long_it_may_last(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = list[Any]()
    monkeypatch.setattr(stage.recordings, "start", lambda label, for_s: begun.append((label, for_s)) or {})
    assert ask(stage, do="record", on=True, name="mine", note="a note", for_s=2.5)["ok"]
    assert begun == [(RecordingLabel("mine", "a note"), 2.5)]
