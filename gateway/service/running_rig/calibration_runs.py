"""Keeps a calibration run or experiment: starts it for this machine, records it, and has a ladder fitted when it is done.

The recording is one of its own, beside whatever else is recorded, with the plan in its header and, of a ladder, the stair in
each row; it stays whatever becomes of the run, whose end is told here once its file is closed. A disk that does not take it
ends the run: a ladder without data is wear for nothing. One more row after the last stair says that this one was finished,
too. A run that a person at this machine has started is stopped when nobody has asked for its status for FOLLOWED_S: a closed
terminal must not leave a tool climbing stairs.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from math import isfinite
from pathlib import Path
from typing import Any, Final

from gateway.bsfm.ladder.plan import LABELS
from gateway.control import Controller
from gateway.control.inputs import Output
from gateway.control.runs.active_run import RecordedPlan
from gateway.control.runs.experiment_run import ExperimentRun
from gateway.devices.messages import ForceSample
from gateway.plants.in_use import in_use_facts
from gateway.processes.disk_worker import DiskWorker
from gateway.processes.state_directory import RECORDINGS
from gateway.profiles import Rig
from gateway.profiles.kinds.plans import plan_of
from gateway.recording import Recorder
from gateway.registers.words import CalibrationPhase
from gateway.service.running_rig.fit_launcher import FitLauncher, Result
from gateway.service.running_rig.lines.output_line import LineState
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.service.running_rig.recording.recordings import END_BOUND_S
from gateway.service.running_rig.recording.run_recording import RunRecording
from gateway.service.running_rig.run_descriptions import describe_experiment, describe_progress, header_of_plan
from gateway.service.socket_requests import CalibrateRequest, EmptyRequest, parse_request

FOLLOWED_S: Final = 3.0
_CLOSING_S: Final = 1.0  # without a sample for so long after the last stair the run is recorded as cut there
_NOTHING_TAKEN: Final = "the disk took no recording"
_WAITED: Final = "run refused: more is asked here than is answered, so that this has waited: wait for each answer"
Answer = dict[str, Any]


class CalibrationRuns:
    """stored: number of the calibration that the last run gave, 0 for none. disk: what the recordings wait for. decide: has the
    loop decide now, where a run has been asked for: a stop right behind that must find it. Called from the loop only."""

    def __init__(
        self, controller: Controller, rig: Rig, state: Path, clock: Callable[[], float], log: Callable[[str, str], None]
    ) -> None:
        self.stored = 0
        self._controller = controller
        self._calibrating = controller.active_run
        self._rig = rig
        self._state = state
        self._clock = clock
        self._log = log
        self.disk, self.syncing = DiskWorker(), DiskWorker()
        self._continues: tuple[int, ...] = ()
        self._name = ""
        self._stairs = 0
        self._closing_s: float | None = None
        self._payload_n = 0.0
        self._recording: RunRecording | None = None
        self._last: RunRecording | None = None
        self._phase_before_end = CalibrationPhase.IDLE
        self._is_closing = False
        self._child: FitLauncher | None = None
        self._result: Result = {}
        self._ended = ""
        self._was_running = self._is_self_test = False
        self._decision: Output | None = None
        self._followed_s = 0.0
        self.decide: Callable[[], None] = lambda: None

    # -- asked by this machine

    def answer(self, request: Answer, *, has_waited: bool = False) -> Answer:
        """Start a run, stop it or tell how it is. ValueError refuses.

        {"plan": {...}, "continues": [numbers], "name": text} starts, with "dry_run": true it is only tried; {"stop": true}
        stops; neither tells how it is. has_waited: behind others of its caller, which may be gone.
        """
        query = parse_request(CalibrateRequest, request)
        if not has_waited:
            self._followed_s = self._clock()
        elif query.plan is not None and not query.dry_run:
            raise ValueError(_WAITED)
        if query.dry_run:
            return self._try_plan(_parse_plan(query.plan))
        if query.stop:
            self._calibrating.ask_stop(f"{self._calibrating.kind} stopped at this machine")
        elif query.plan is not None:
            self._start(query)
        if refused := self._calibrating.take_refused():
            self._continues, self._name = (), ""  # or a master's next run would bear them
            raise ValueError(refused)
        return self.status()

    def answer_self_test(self, request: Answer) -> Answer:
        """Tell what the last self-test found; a master starts it (control_word bit 6)."""
        parse_request(EmptyRequest, request)
        report = self._calibrating.self_test
        return {
            "number": report.number,
            "result": report.result.name.lower(),
            "items": {
                str(one.item): {"verdict": one.verdict.name.lower(), "text": one.text} for one in report.findings
            },
        }

    def _try_plan(self, plan: RecordedPlan) -> Answer:
        """Return what a plan would do; ValueError where the rig does not allow it."""
        run = self._calibrating.build_recorded(plan)
        top_v = run.schedule.top_v if isinstance(run, ExperimentRun) else max(stair.voltage_v for stair in run.stairs)
        top_n = self._calibrating.most_contact_n(top_v)
        return {
            "stairs": 0 if isinstance(run, ExperimentRun) else len(run.stairs),
            "eta_s": run.eta_s,
            "v_max_v": top_v,
            "force_max_n": top_n,
            "simulated": self._rig.simulated,
            "rig": self._rig.name,
            "rig_fingerprint": self._rig.fingerprint,
            **describe_experiment(plan),
        }

    def _start(self, query: CalibrateRequest) -> None:
        plan = _parse_plan(query.plan)
        if refused := self._controller.refusal_of_run(self._clock(), plan):
            raise ValueError(refused)
        self._calibrating.ask(plan)
        self._continues, self._ended, self._result = query.continues, "", {}
        self._name = query.name
        self.decide()

    def status(self) -> Answer:
        """Return how the run is: phase, progress, time left, and the result of the last one."""
        calibrating, decision = self._calibrating, self._decision
        run = calibrating.recorded
        return {
            "running": calibrating.running or self._is_closing,
            "phase": (self._phase_before_end if self._is_closing else calibrating.phase).name.lower(),
            "progress": calibrating.progress,
            "eta_s": round(calibrating.eta_s, 1),
            **describe_progress(run),
            "noise_n": run.noise_n if run else None,
            "voltage_v": decision.voltage_v if decision else None,
            "force_n": decision.force_measured_n
            if decision and decision.force_measured_n == decision.force_measured_n
            else None,
            "recording": str(self._last.path) if self._last and self._last.path and not self._is_self_test else None,
            "ended": self._ended,
            "result": self._result,
        }

    def use_plant(self, rig: Rig) -> None:
        """Take the rig with another plant in use: the recording of the next run says how its rows were read."""
        self._rig = rig

    # -- from the loop

    def follow(self, decision: Output) -> None:
        """Follow the run; to be called after each step of the controller."""
        self._decision = decision
        calibrating = self._calibrating
        is_running = calibrating.running
        if is_running:
            self._phase_before_end = calibrating.phase
        if is_running is not self._was_running:
            self._follow_ends(decision)
        if not is_running and self._recording is None and self._closing_s is None:
            return  # nobody calibrates, most of the time
        if calibrating.recorded and self._recording is None:
            self._begin()
        elif self._closing_s is not None:
            if self._clock() - self._closing_s > _CLOSING_S:
                self._close_ladder()
        elif self._recording is not None and not is_running:
            self._end(decision)
        elif self._recording is not None and (failure := self._recording.failure):
            calibrating.ask_stop(f"A330 calibration stopped: {failure}")
        elif is_running and calibrating.is_local and self._clock() - self._followed_s > FOLLOWED_S:
            calibrating.ask_stop("A330 calibration stopped: nobody at this machine follows it any more")

    def _follow_ends(self, decision: Output) -> None:
        """Forget what the run before has left, whoever has begun this one; of a self-test nothing else tells its end."""
        self._was_running = not self._was_running
        if self._was_running:
            self._ended, self._result, self._is_self_test = "", {}, self._calibrating.recorded is None
        elif self._is_self_test:
            self._ended = decision.events[0] if decision.events else ""

    def append(self, sample: ForceSample, decision: Output, line: LineState) -> None:
        """Record a sample with the cell's own force, without the payload's weight: the model means that force."""
        if self._recording and self._calibrating.running:
            payload_n = decision.force_measured_n - self._calibrating.cell_n
            self._payload_n = payload_n if isfinite(payload_n) else self._payload_n  # not by what is no reading
            row = decision._replace(force_measured_n=self._calibrating.cell_n)
            self._recording.append(sample, row, line, *self._labels())
        elif self._recording and self._closing_s is not None:
            row = decision._replace(force_measured_n=decision.force_measured_n - self._payload_n)
            self._recording.append(sample, row, line, float(self._calibrating.phase), -1.0, float(self._stairs))
            self._close_ladder()

    def _labels(self) -> tuple[float, ...]:
        """Return where a ladder is, in the columns LABELS."""
        run = self._calibrating.recorded
        if run is None or isinstance(run, ExperimentRun):
            return ()
        group = run.stairs[min(run.done, len(run.stairs) - 1)].group
        self._stairs = len(run.stairs)  # some may have been left out by now
        return float(self._calibrating.phase), float(group), float(run.done)

    def flush(self, now_s: float) -> None:
        """Hand over what has been recorded, once a tick."""
        if self._last:
            self._last.flush(now_s)

    async def close(self) -> None:
        """Close the recording and the line to a fit under way. A disk that takes nothing for a second is not waited for."""
        if self._recording:
            closed: Future[None] = Future()
            self._recording.close(lambda: closed.set_result(None))
            await asyncio.wait([asyncio.wrap_future(closed)], timeout=END_BOUND_S)
        if self._child:
            self._child.close()
        self.disk.close()
        self.syncing.close()

    def _begin(self) -> None:
        run, rig = self._calibrating.recorded, self._rig
        assert run
        header = {
            "rig": rig.name,
            "rig_fingerprint": rig.fingerprint,
            "rig_file": str(rig.file),
            "rig_texts": dict(rig.texts),
            "calibration": self._controller.calibration_id,
            "plant_in_use": in_use_facts(rig),
            "simulated": rig.simulated,
            "seed": rig.seed,
            **header_of_plan(run),
            "continues": list(self._continues),
            "name": self._name,
            "zero_n": self._controller.zero_n,
        }
        columns = COLUMNS if isinstance(run, ExperimentRun) else (*COLUMNS, *LABELS)
        folder = self._state / RECORDINGS
        self._recording = self._last = RunRecording(
            self.disk, self.syncing, lambda: Recorder(folder, header, columns), self._log
        )
        self._is_closing = False
        self._recording.begin(self._on_opened)
        self._continues, self._name = (), ""

    def _on_opened(self, error: OSError | None) -> None:
        if error and self._calibrating.running:
            self._calibrating.ask_stop(f"A330 calibration stopped: the recording cannot be written: {error.strerror}")

    def _end(self, decision: Output) -> None:
        assert self._recording
        self._ended = decision.events[0] if decision.events else ""
        if self._calibrating.phase is CalibrationPhase.FITTING:
            self._closing_s = self._clock()
            return
        recording, self._recording = self._recording, None
        self._is_closing = True
        recording.close(lambda: self._on_closed(recording))

    def _on_closed(self, recording: RunRecording) -> None:
        if recording is not self._last:
            return
        self._is_closing = False
        is_recorded = self._calibrating.phase is CalibrationPhase.RECORDED
        if recording.failure or (is_recorded and not recording.path):
            self._tell_failure(recording.failure or _NOTHING_TAKEN)
        elif is_recorded:
            self._log("calibration", f"experiment recorded in {recording.path}; force-gateway diagnose takes it")

    def _tell_failure(self, failure: str) -> None:
        self._ended = failure
        self._calibrating.phase = CalibrationPhase.STOPPED

    def _close_ladder(self) -> None:
        """A finished ladder is fitted, if the disk took all of it."""
        assert self._recording
        recording, self._recording, self._closing_s = self._recording, None, None
        recording.close(lambda: self._fit(recording))

    def _fit(self, recording: RunRecording) -> None:
        if recording.failure or not recording.path:
            self._tell_failure(recording.failure or _NOTHING_TAKEN)
            return
        try:
            self._child = FitLauncher(recording.path, self._rig.file, self._state, self._on_result)
        except OSError as error:  # no process, memory or descriptor
            self._on_result(
                {"refused": f"A331 the fit did not start: {error.strerror}; force-gateway fit {recording.number}"}
            )

    def _on_result(self, result: Result) -> None:
        self._child, self._result = None, result
        if "stored" in result:
            self.stored = int(result["stored"])
            self._calibrating.phase = CalibrationPhase.STORED
            self._log("calibration", f"calibration {self.stored} stored, not active{_describe_report(result)}")
        else:
            self._calibrating.phase = CalibrationPhase.REFUSED
            self._log("calibration", f"{result.get('refused')}{_describe_report(result)}")


def _describe_report(result: Result) -> str:
    return f"; report {result['report']}" if "report" in result else f"; {result.get('unreported', '')}".rstrip("; ")


def _parse_plan(fields: Any) -> RecordedPlan:
    """Return a plan from JSON; ValueError for a name or a type that it does not have."""
    if not isinstance(fields, dict):
        raise ValueError("plan: a JSON object is expected")
    return plan_of(fields)
