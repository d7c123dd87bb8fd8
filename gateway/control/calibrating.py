"""The calibration run or experiment that the controller conducts, if any, and what remains to be said about the last one.

Asked for by control_word bit 5 with the rig's own plan, or by a person at this machine with a plan of theirs. A local run
does not depend on the master's lease: nobody on the fieldbus has asked for it; the service ends it when the person is gone.
"""

from math import nan
from typing import Final, TypeAlias

from gateway.bsfm import Bsfm
from gateway.control.experiment_plan import ExperimentPlan
from gateway.control.experiment_run import ExperimentRun
from gateway.control.ladder_run import LadderRow, LadderRun
from gateway.control.ladder_stairs import RunPlan
from gateway.control.pursuit import Pursuit
from gateway.control.reading import Reading
from gateway.control.response import ModelResponse
from gateway.control.settings import ControlSettings
from gateway.control.supervision import Finding
from gateway.registers.words import CalibrationPhase, FaultCode

AnyPlan: TypeAlias = RunPlan | ExperimentPlan
AnyRun: TypeAlias = LadderRun | ExperimentRun

RAMPING_DOWN: Final = Finding(FaultCode.NONE, "info calibration stopped: ramping down")


class Calibrating:
    """phase and progress stay after the end. model: what the check of the next run compares with; cell_n: cell force of the
    last step, without the payload's weight."""

    def __init__(self, settings: ControlSettings, model: Bsfm) -> None:
        self.phase = CalibrationPhase.IDLE
        self.progress = 0.0
        self.eta_s = 0.0
        self.cell_n = nan
        self.is_local = False
        self.run: AnyRun | None = None
        self.last_row: LadderRow | None = None
        self._settings = settings
        self.model = model
        self._asked: AnyPlan | None = None
        self._stop_asked = ""

    @property
    def running(self) -> bool:
        return self.run is not None

    @property
    def is_busy(self) -> bool:
        """A run, or the fit of one."""
        return self.running or self.phase is CalibrationPhase.FITTING

    def use(self, model: Bsfm) -> None:
        """Of a later run; one that runs keeps what it was begun with."""
        self.model = model

    def ask(self, plan: AnyPlan) -> AnyRun:
        """A local run for the next step to begin. ValueError with a sentence for a plan that the rig does not allow."""
        run = self.tried(plan)
        self._asked = plan
        self.phase = CalibrationPhase.IDLE
        return run

    def tried(self, plan: AnyPlan) -> AnyRun:
        """What a plan would do. ValueError with a sentence for one that the rig does not allow."""
        if isinstance(plan, ExperimentPlan):
            return ExperimentRun(plan, self._settings, self.model)
        return LadderRun(plan, self._settings, self.model)

    def ask_stop(self, sentence: str) -> None:
        """The next step ends the run: the output goes to the safe voltage."""
        self._stop_asked = sentence

    def take_asked(self) -> AnyPlan | None:
        asked, self._asked = self._asked, None
        return asked

    def begin(self, plan: AnyPlan, *, is_local: bool) -> None:
        self.run = self.tried(plan)
        self.is_local, self._stop_asked = is_local, ""
        self.phase, self.progress, self.last_row = CalibrationPhase.ZERO, 0.0, None

    def climb(self, now_s: float, reading: Reading, pursuit: Pursuit, response: ModelResponse) -> Finding | None:
        """One step of the run, through the voltage stage; what ended it (a fault, or a sentence), None while it goes on."""
        run = self.run
        assert run
        self.cell_n = reading.cell_n
        if self._stop_asked:
            return Finding(FaultCode.NONE, self._stop_asked)
        step = run.step(now_s, reading)
        self.phase, self.progress, self.eta_s = step.phase, step.progress, step.eta_s
        self.last_row = step.row or self.last_row
        if run.found:
            return run.found
        if run.is_done:
            return Finding(FaultCode.NONE, run.ended)
        pursuit.follow(step.voltage_v, response.force_n(run.direction), run.direction)
        return None

    def end(self) -> None:
        """Whatever ends it; complete or not is told by the run itself."""
        if self.run:
            self.phase = self.run.end_phase if self.run.is_done else CalibrationPhase.STOPPED
        self.run, self.is_local, self.eta_s = None, False, 0.0
