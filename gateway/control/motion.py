"""What moves the output while it is enabled: force law or direct voltage, or a calibration run in their place.

One step answers with an event of the state table, or with a StopCause: of a fault, or with FaultCode.NONE of an end that
disables the output with a sentence. What the model expects is kept beside it, as both and the supervision compare with it.
"""

from collections.abc import Callable
from typing import Final, TypeAlias

from gateway.bsfm import Bsfm
from gateway.codes.faults import FaultCode
from gateway.control.demand import Demand
from gateway.control.force_loop.feedforward import ModelError
from gateway.control.force_loop.force_loop import ForceLoop, LoopInputs
from gateway.control.inputs import LineStatus
from gateway.control.limits import NotFiniteError
from gateway.control.runs.active_run import ActiveRun
from gateway.control.sample_conditioning import Reading
from gateway.control.settings import ControlSettings
from gateway.control.state_table import StateEvent
from gateway.control.supervision.fault_detection import StopCause, stop_cause
from gateway.control.supervision.plausibility import ExpectedForce

Moved: TypeAlias = StateEvent | StopCause

_RAMPED_DOWN: Final = StopCause(FaultCode.NONE, "force ramped to 0, output disabled")


class Motion:
    """ForceLoop, run and response of one rig, with one calibration for all of them."""

    def __init__(self, pursuit: ForceLoop, response: ExpectedForce, calibrating: ActiveRun) -> None:
        self.pursuit = pursuit
        self.response = response
        self._calibrating = calibrating

    def use(self, model: Bsfm, given_n: float, settings: ControlSettings) -> None:
        """Swap the calibration and the timing that goes with it. given_n: contact force that the slide need not give."""
        self.pursuit.law.use(model, given_n)
        self.pursuit.retime(settings)
        self.response.retime(settings.supervision.response_lag_s)
        self.response.use(model)
        self._calibrating.use(model)

    def elapse(self, dt_s: float, line: LineStatus) -> None:
        """dt_s has passed with the present voltage on the output, whoever drives it."""
        self.pursuit.elapse(dt_s, line)
        self.response.advance(self.pursuit.stage.voltage_v, dt_s)

    def rest(self) -> None:
        """The safe voltage at once; a run ends with it."""
        self.pursuit.rest()
        self._calibrating.rest()

    def leave_run(self, given_n: float) -> None:
        """A run has ended: the force law goes on from its force, and no higher than where the voltage would lead. given_n as
        in `use`."""
        run = self._calibrating.run
        if run is not None:
            towards_n = run.model.force_n(self.pursuit.stage.voltage_v, run.branch_share)
            reached_n = min(towards_n, self.response.force_n(run.branch_share))
            self.pursuit.law.take_over(reached_n + given_n, run.branch_share)
        self._calibrating.end()

    @property
    def expected_n(self) -> float:
        """Cell force that the model expects now."""
        return self.response.force_n(self.pursuit.law.branch_share)

    @property
    def expected_rise_n(self) -> float:
        """The same above the force at rest."""
        return self.response.rise_n(self.pursuit.law.branch_share)

    def climb(self, now_s: float, reading: Reading) -> Moved:
        """One step of the run."""
        return self._calibrating.climb(now_s, reading, self.pursuit, self.response) or StateEvent.MOVE

    def pursue(self, demand: Demand, moment: LoopInputs, *, ramps_down: bool) -> Moved:
        """One step towards the demand. ramps_down: there is nothing left to do once the force is 0."""
        return self._moved(lambda: self.pursuit.step(demand, moment), ramps_down=ramps_down)

    def descend(self, demand: Demand, dt_s: float, given_n: float) -> Moved:
        """One step from where a run has left the force to 0, by the model alone: neither trim nor lead, which a plant that is
        being calibrated may not fit, and never up."""
        return self._moved(lambda: self._descended(demand, dt_s, given_n), ramps_down=True)

    def _descended(self, demand: Demand, dt_s: float, given_n: float) -> StateEvent:
        law = self.pursuit.law
        law.advance(0.0, demand.ramp_n_per_s, dt_s, given_n)
        voltage_v, _ = law.feedforward(given_n)
        self.pursuit.follow(min(voltage_v, self.pursuit.stage.voltage_v), law.applied_n, law.branch_share)
        return StateEvent.MOVE

    def _moved(self, move: Callable[[], StateEvent], *, ramps_down: bool) -> Moved:
        try:
            event = move()
        except ModelError as error:
            return stop_cause(FaultCode.MODEL_INVALID, str(error))
        except NotFiniteError as error:
            return stop_cause(FaultCode.NOT_FINITE, str(error))
        return _RAMPED_DOWN if ramps_down and self.pursuit.law.applied_n <= 0.0 else event
