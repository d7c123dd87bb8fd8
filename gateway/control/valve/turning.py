"""Turn control round with the valve: readings, weight, model and limits count along the direction that its readback shows."""

from math import inf

from gateway.bsfm import Bsfm
from gateway.control.command_edges import CommandTracker
from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.inputs import CalibrationInUse, LineStatus
from gateway.control.sample_conditioning import SampleConditioner
from gateway.control.settings import ControlSettings
from gateway.control.supervision.plausibility import ExpectedForce
from gateway.control.supervision.safe_voltage import NEAR_V
from gateway.control.transitions import Transitions
from gateway.control.valve.pull_model import scale_forces
from gateway.control.valve.valve_switch import ValveSwitch
from gateway.registers.words import ControlBit

_PULL = int(ControlBit.VALVE_PULL)
_VENTED_N = 0.5  # expected above rest: less than friction holds


class Turning:
    """valve: None on a rig without one, then everything pushes. What pressure may be behind it is followed by the model; at the
    beginning as much as the rig allows, for whoever was in charge before may have been killed while the tool pressed."""

    def __init__(
        self,
        valve: ValveSwitch | None,
        commands: CommandTracker,
        conditioner: SampleConditioner,
        settings: ControlSettings,
        model: Bsfm,
    ) -> None:
        limits, lag_s = settings.limits, settings.supervision.response_lag_s
        self.valve = valve
        self._pressure = ExpectedForce(model, lag_s, limits.safe_voltage_v, limits.voltage_max_v)
        self._commands, self._conditioner = commands, conditioner
        self._last_s = inf
        self._may_stand_v: float | None = None  # highest voltage that may be out; None: as at the beginning

    def use(self, model: Bsfm, settings: ControlSettings) -> None:
        """Follow the pressure by another model, at the pace of these settings."""
        self._pressure.retime(settings.supervision.response_lag_s)
        self._pressure.use(model)

    def model_of(self, calibration: CalibrationInUse) -> Bsfm:
        """Return the model of the direction in effect."""
        return self.model_of_pull(calibration) if self.valve and self.valve.is_pulling else calibration.model

    def model_of_pull(self, calibration: CalibrationInUse) -> Bsfm:
        """Return the measured model of pulling, or the one that follows from that of pushing."""
        share = self.valve.settings.pull_area_share if self.valve else 1.0
        return calibration.pull_model or scale_forces(calibration.model, share)

    def most_pull_n(self, calibration: CalibrationInUse) -> float:
        """Return the largest pull: what the model reaches, and what its limits allow, which control holds to as well."""
        model = self.model_of_pull(calibration)
        most_n = model.force_range_n[1]
        return most_n if model.limits_n is None else min(most_n, model.limits_n[1])

    def follow(self, now_s: float, line: LineStatus, machine: Transitions) -> bool:
        """Follow the valve; return whether the direction has changed: then the caller takes the other model. A regulator that
        hears nothing keeps its pressure, so what is wanted of it does not count, but what surely stands there."""
        valve, parts, status = self.valve, machine.parts, line.valve
        if valve is None or status is None:
            return False
        pulls = bool(int(self._commands.command.control_word) & _PULL)
        wanted = valve.wanted(pulls=pulls, is_enabled=machine.is_enabled)
        is_left = self._follow_pressure(now_s, line.standing_v, parts.loop)
        is_vented = parts.loop.voltage_v <= 0.0 and not is_left
        is_vented = is_vented and line.standing_v is not None and line.standing_v <= NEAR_V
        was_switching = valve.is_switching
        if not valve.step(now_s, wanted, status, is_vented=is_vented):
            if was_switching and not valve.is_switching:
                parts.faults.start_rise()  # what was left when the output was enabled has gone meanwhile
            return False
        direction = -1.0 if valve.is_pulling else 1.0
        self._conditioner.direction = parts.faults.direction = parts.one_shot.direction = direction
        self._commands.turn(direction)
        parts.faults.shift_zero(2.0 * parts.faults.measured_n)
        parts.faults.start()
        parts.loop.rest()
        machine.tell("the valve pulls" if valve.is_pulling else "the valve pushes")
        return True

    def _follow_pressure(self, now_s: float, standing_v: float | None, loop: ForceLoop) -> bool:
        """Return whether pressure may be left. Where nobody knows what stands, what stood before may stand still."""
        dt_s, self._last_s = max(0.0, now_s - self._last_s), now_s
        before_v = self._may_stand_v
        self._may_stand_v = standing_v
        if standing_v is None and before_v is not None:
            self._may_stand_v = max(before_v, loop.voltage_v)
        if self._may_stand_v is not None:
            self._pressure.advance(self._may_stand_v, dt_s)
        return abs(self._pressure.rise_n(loop.branch_share)) > _VENTED_N
