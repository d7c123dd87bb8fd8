"""One experiment: zero and noise, the calibration's coarse check, then the plan by the clock.

The check is the ladder's own: it stops at a wrong sign, a wrong scale or no force, and settles the friction, so that every
experiment starts from the same history. After it the plan alone says what is put out; nothing waits for the data, so that
a recording is as long as its plan. Supervision is the controller's, as always.
"""

from typing import Final

from gateway.bsfm import Bsfm
from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.control.runs.experiment_schedule import schedule_of
from gateway.control.runs.ladder_run import LadderRun, RunStep
from gateway.control.runs.ladder_stairs import CalibrationPlan, check_stairs
from gateway.control.sample_conditioning import Reading
from gateway.control.settings import ControlSettings
from gateway.control.supervision.fault_detection import StopCause
from gateway.registers.words import CalibrationPhase


class ExperimentRun:
    """Run of an experiment plan, asked as a LadderRun is. given_n: contact force that presses besides the slide: the levels
    stay below the rig's largest with it. ValueError for a plan that the rig does not allow."""

    end_phase: Final = CalibrationPhase.RECORDED

    def __init__(self, plan: ExperimentPlan, settings: ControlSettings, model: Bsfm, given_n: float) -> None:
        self.plan, self.model = plan, model
        limits = settings.limits
        self.schedule = schedule_of(plan, limits, model, given_n)
        top_v = self.schedule.top_v
        stairs = (
            check_stairs(top_v, model, limits.safe_voltage_v) if plan.check and top_v > limits.safe_voltage_v else ()
        )
        self._check = LadderRun(CalibrationPlan(), settings, model, stairs)
        self._began_s: float | None = None
        self._elapsed_s = 0.0

    @property
    def stop_cause(self) -> StopCause | None:
        """Cause of which the run has to stop, None while it may go on."""
        return self._check.stop_cause

    @property
    def noise_n(self) -> float:
        """Noise of the cell at rest, N."""
        return self._check.noise_n

    @property
    def is_done(self) -> bool:
        """Decide whether the schedule is over."""
        return self._began_s is not None and self._elapsed_s >= self.schedule.duration_s

    @property
    def eta_s(self) -> float:
        """Time until the end, s."""
        return self._check.eta_s + max(0.0, self.schedule.duration_s - self._elapsed_s)

    @property
    def branch_share(self) -> float:
        """The branch that the plant is on: 1 rising, -1 falling."""
        return self._check.branch_share if self._began_s is None else float(self.schedule.direction(self._elapsed_s))

    @property
    def part(self) -> int:
        """Index of the plan's part that runs; 0 before the first."""
        return self.schedule.segments[self.schedule.index(self._elapsed_s)].part

    @property
    def end_sentence(self) -> str:
        """Sentence of a message at its end."""
        return f"experiment {self.plan.name} done: {len(self.plan.parts)} parts, {self.schedule.duration_s:.0f} s"

    def step(self, now_s: float, reading: Reading) -> RunStep:
        """Advance to now_s and return the voltage and labels to apply. reading: of this moment."""
        if not self._check.is_done or self._check.is_waiting:
            check = self._check.step(now_s, reading)
            if not self._check.is_done or self._check.is_waiting:
                return check._replace(progress=0.0, eta_s=self.eta_s)
        if self._began_s is None:
            self._began_s = now_s
        self._elapsed_s = now_s - self._began_s
        volts = self.schedule.voltage_v(self._elapsed_s)
        progress = min(1.0, self._elapsed_s / self.schedule.duration_s)
        return RunStep(volts, CalibrationPhase.EXPERIMENT, progress, self.eta_s)
