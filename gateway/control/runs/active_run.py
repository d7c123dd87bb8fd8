"""The calibration run, experiment or self-test that the controller conducts, if any, and what remains to be said about the
last one.

Asked for by control_word bit 5 or 6 with the rig's own plan, or by a person at this machine with a plan of theirs. A local run
does not depend on the master's lease: nobody on the fieldbus has asked for it; the service ends it when the person is gone.
A run never takes the force beyond the rig's force_max_n (`ceiling`): a ladder leaves out what would, any other run ends.
"""

from collections.abc import Callable
from dataclasses import replace
from math import nan
from typing import Final, TypeAlias

from gateway.bsfm import Bsfm
from gateway.codes.faults import FaultCode
from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.inputs import LineStatus
from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.control.runs.experiment_run import ExperimentRun
from gateway.control.runs.ladder_run import LadderRow, LadderRun, RunStep
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.sample_conditioning import Reading
from gateway.control.self_test.items import SelfTestPlan, SelfTestReport
from gateway.control.self_test.judgement import Known
from gateway.control.self_test.self_test_run import SelfTestRun
from gateway.control.settings import ControlSettings, LoopTiming
from gateway.control.supervision.fault_detection import StopCause
from gateway.control.supervision.force_ceiling import ForceCeiling
from gateway.registers.words import CalibrationPhase, SelfTestResult

RecordedPlan: TypeAlias = CalibrationPlan | ExperimentPlan
RecordedRun: TypeAlias = LadderRun | ExperimentRun
AnyPlan: TypeAlias = RecordedPlan | SelfTestPlan
AnyRun: TypeAlias = RecordedRun | SelfTestRun

_PHASES: Final = {phase: phase.name.lower().replace("_", " ") for phase in CalibrationPhase}


class ActiveRun:
    """The run under way, if any; phase and progress stay after its end."""

    def __init__(self, settings: ControlSettings, model: Bsfm, given_n: Callable[[], float] = lambda: 0.0) -> None:
        """given_n: contact force of now that the slide need not give."""
        self.phase = CalibrationPhase.IDLE
        self.progress = 0.0
        self.eta_s = 0.0
        self.cell_n = nan  # of the last step, without the payload's weight
        self.target_n = 0.0  # what the model expects of the voltage that the run wants
        self.message = ""  # a sentence for the log
        self.refused = ""  # why the last plan asked for was not begun
        self.is_local = False  # begun at this machine; stays until the output is off
        self.has_risen = False  # this run has left the safe voltage
        self.run: AnyRun | None = None
        self.last_row: LadderRow | None = None
        self.self_test = SelfTestReport()  # of the last one, or that one runs
        self._settings, self._given_n = settings, given_n
        self._cell_noise_n = 0.0
        self._is_report_told = True
        self.model = model  # what the check of the next run compares with
        self._asked: RecordedPlan | None = None
        self._stop_asked = ""
        self._ceiling = self._new_ceiling()

    @property
    def running(self) -> bool:
        """Decide whether a run is under way."""
        return self.run is not None

    @property
    def recorded(self) -> RecordedRun | None:
        """The run under way, if it is one that is recorded: a self-test is not, its figures are in the log."""
        return None if isinstance(self.run, SelfTestRun) else self.run

    @property
    def is_busy(self) -> bool:
        """Decide whether a run, or the fit of one, is under way."""
        return self.running or self.phase is CalibrationPhase.FITTING

    @property
    def what(self) -> str:
        """The run in words: `calibration (ladder, 43 %)`."""
        if isinstance(self.run, SelfTestRun):
            return f"a self-test ({self.progress:.0%})"
        name = f"experiment {self.run.plan.name}" if isinstance(self.run, ExperimentRun) else "a calibration"
        return f"{name} ({_PHASES[self.phase]}, {self.progress:.0%})"

    @property
    def kind(self) -> str:
        """Word for what runs."""
        if isinstance(self.run, SelfTestRun):
            return "self-test"
        return "experiment" if isinstance(self.run, ExperimentRun) else "calibration"

    def use(self, model: Bsfm, timing: LoopTiming | None = None, cell_noise_n: float = 0.0, lag_s: float = 0.0) -> None:
        """Set what later runs compare with: the model, and what its calibration has measured of response and noise; lag_s:
        from voltage to force, 0 as it was. A run that is under way keeps its own."""
        supervision = self._settings.supervision
        if lag_s > 0.0:
            supervision = replace(supervision, response_lag_s=lag_s)
        self._settings = replace(self._settings, timing=timing, supervision=supervision)
        self.model, self._cell_noise_n = model, cell_noise_n

    def ask(self, plan: RecordedPlan) -> RecordedRun:
        """Ask for a local run for the next step to begin. ValueError with a sentence for a plan that the rig does not allow."""
        run = self.build_recorded(plan)
        self._asked, self.refused = plan, ""
        self.phase = CalibrationPhase.IDLE
        return run

    def build(self, plan: AnyPlan) -> AnyRun:
        """Return the run that a plan makes. ValueError with a sentence for one that the rig does not allow."""
        if isinstance(plan, SelfTestPlan):
            return SelfTestRun(plan, Known(self._settings, self.model, self._cell_noise_n))
        return self.build_recorded(plan)

    def build_recorded(self, plan: RecordedPlan) -> RecordedRun:
        """Return the calibration or experiment that a plan makes; ValueError as `build`."""
        if isinstance(plan, ExperimentPlan):
            return ExperimentRun(plan, self._settings, self.model, self._given_n())
        return LadderRun(plan, self._settings, self.model)

    def most_contact_n(self, voltage_v: float) -> float:
        """Return what presses at most up to this voltage, by the model and with the payload; the rig's largest is the end."""
        pressed_n = self.model.force_n(voltage_v, 1.0) + max(0.0, self._given_n())
        return min(self._settings.limits.force_max_n, pressed_n)

    def ask_stop(self, sentence: str) -> None:
        """Ask the next step to end the run: the force goes to 0 along the rig's ramp."""
        self._stop_asked = sentence

    def take_asked(self) -> RecordedPlan | None:
        """Return the plan that was asked for, once."""
        plan, self._asked = self._asked, None
        return plan

    def begin(self, plan: AnyPlan, *, is_local: bool) -> None:
        """Begin the run of this plan. ValueError for a plan that the rig does not allow."""
        self.run = self.build(plan)
        self.is_local, self.has_risen, self._stop_asked = is_local, False, ""
        self.phase, self.progress, self.last_row = CalibrationPhase.ZERO, 0.0, None
        self.eta_s, self.target_n = self.run.eta_s, 0.0
        if isinstance(self.run, SelfTestRun):
            self.phase = CalibrationPhase.SELF_TEST
            self.self_test = SelfTestReport(self.self_test.number + 1, SelfTestResult.RUNNING)
        self._ceiling = self._new_ceiling()

    def step(self, now_s: float, reading: Reading, loop: ForceLoop, line: LineStatus) -> StopCause | None:
        """Make one step of the run, through the limits of the force loop; return what ended it (a fault, or a sentence), None
        while it goes on."""
        run = self.run
        assert run
        if isinstance(run, SelfTestRun):
            run.observe_line(line)
            if reading.is_usable:
                run.outside_n = self._given_n() - (reading.contact_n - reading.cell_n)
        self.cell_n = reading.cell_n
        if self._stop_asked:
            return StopCause(FaultCode.NONE, self._stop_asked)
        step = run.step(now_s, reading)
        self.phase, self.progress, self.eta_s = step.phase, step.progress, step.eta_s
        self.last_row, self.message = step.row or self.last_row, step.said or self.message
        if run.stop_cause:
            return run.stop_cause
        if run.is_done:
            return StopCause(FaultCode.NONE, run.end_sentence)
        voltage_v = self._below_ceiling(now_s, reading, step, loop.voltage_v)
        if voltage_v is None:
            return StopCause(FaultCode.NONE, self._too_high(step.highest_v, "the run is stopped"))
        self.has_risen = self.has_risen or voltage_v > self._settings.limits.safe_voltage_v
        self.target_n = max(0.0, run.model.force_n(voltage_v, run.branch_share))
        loop.drive_run(voltage_v, run.branch_share)
        return None

    def leave(self, loop: ForceLoop, given_n: float) -> None:
        """End, and let the force loop go on from the run's force. given_n: contact force that the slide need not give."""
        if run := self.run:
            loop.leave_run(run.model.force_n(loop.voltage_v, run.branch_share), run.branch_share, given_n)
        self.end()

    def end(self, fault: FaultCode = FaultCode.NONE) -> None:
        """End the run, for whatever reason; the run itself knows whether it is complete. fault: that ended it."""
        if self.run:
            self.phase = self.run.end_phase if self.run.is_done else CalibrationPhase.STOPPED
        if isinstance(self.run, SelfTestRun):
            self.self_test, self._is_report_told = self.run.report(self.self_test.number, fault), False
        self.run, self.eta_s, self.target_n = None, 0.0, 0.0

    def rest(self, fault: FaultCode = FaultCode.NONE) -> None:
        """End what a run has left behind: the output is off, for this fault."""
        self.end(fault)
        self.is_local = False

    def take_report(self) -> tuple[str, ...]:
        """Return the sentences of a self-test that has ended, once."""
        is_told, self._is_report_told = self._is_report_told, True
        return () if is_told else self.self_test.sentences

    def take_refused(self) -> str:
        """Return why the last plan asked for was not begun, once; empty for nothing."""
        refused, self.refused = self.refused, ""
        return refused

    def take_message(self) -> str:
        """Return what the run has said, once; empty for nothing."""
        sentence, self.message = self.message, ""
        return sentence

    # -- the rig's largest force

    def _new_ceiling(self) -> ForceCeiling:
        limits = self._settings.limits
        return ForceCeiling(limits.force_max_n, self.model, limits.safe_voltage_v)

    def _below_ceiling(self, now_s: float, reading: Reading, step: RunStep, present_v: float) -> float | None:
        """The voltage that this step may put out; None where the run cannot go on without passing the ceiling. What has
        to be left out of a ladder is left out from its next step on."""
        run, ceiling = self.run, self._ceiling
        assert run
        ceiling.observe(reading)
        if step.row:
            ceiling.observe_row(step.row)
        rises = run.branch_share > 0.0 or step.voltage_v > present_v
        was_reached = ceiling.is_reached(run.noise_n) if rises else ceiling.is_passed(run.noise_n)
        if not was_reached and not (step.row and ceiling.is_beyond(step.highest_v, run.noise_n)):
            return step.voltage_v
        if not isinstance(run, LadderRun):
            return None
        stands_v, highest_v = min(present_v, step.voltage_v), step.highest_v
        while run.leave_out(now_s, highest_v, stands_v, was_there=was_reached):
            self.message = self._too_high(highest_v, "the run goes on with the stairs below")
            if not ceiling.is_beyond(run.next_v, run.noise_n):
                return stands_v
            highest_v, was_reached = run.next_v, False
        self.message = ""
        return None

    def _too_high(self, voltage_v: float, what_now: str) -> str:
        return (
            f"A350 {self._ceiling.measured_n:.1f} N measured, {voltage_v:.2f} V would take it beyond what this rig allows, "
            f"force_max_n = {self._settings.limits.force_max_n:g} N: {what_now}"
        )
