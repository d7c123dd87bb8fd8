"""Turn control round with the valve: readings, weight, model and limits count along the direction that its readback shows."""

from gateway.bsfm import Bsfm
from gateway.control.command_edges import CommandTracker
from gateway.control.inputs import CalibrationInUse, LineStatus
from gateway.control.sample_conditioning import SampleConditioner
from gateway.control.transitions import Transitions
from gateway.control.valve.pull_model import scale_forces
from gateway.control.valve.valve_switch import ValveSwitch
from gateway.registers.words import ControlBit

_PULL = int(ControlBit.VALVE_PULL)
_VENTED_N = 0.5  # expected above rest: less than friction holds
_VENTED_V = 0.05  # a device answers in steps of its own


class Turning:
    """valve: None on a rig without one, then everything pushes."""

    def __init__(self, valve: ValveSwitch | None, commands: CommandTracker, conditioner: SampleConditioner) -> None:
        self.valve = valve
        self._commands, self._conditioner = commands, conditioner

    def model_of(self, calibration: CalibrationInUse) -> Bsfm:
        """Return the model of the direction in effect."""
        return self.model_of_pull(calibration) if self.valve and self.valve.is_pulling else calibration.model

    def model_of_pull(self, calibration: CalibrationInUse) -> Bsfm:
        """Return the measured model of pulling, or the one that follows from that of pushing."""
        share = self.valve.settings.pull_area_share if self.valve else 1.0
        return calibration.pull_model or scale_forces(calibration.model, share)

    def follow(self, now_s: float, line: LineStatus, machine: Transitions) -> bool:
        """Follow the valve; return whether the direction has changed: then the caller takes the other model. A regulator that
        hears nothing keeps its pressure, so what is wanted of it does not count, but what surely stands there."""
        valve, parts, status = self.valve, machine.parts, line.valve
        if valve is None or status is None:
            return False
        pulls = bool(self._commands.command.control_word & _PULL)
        wanted = valve.wanted(pulls=pulls, is_enabled=machine.is_enabled)
        is_vented = parts.loop.voltage_v <= 0.0 and abs(parts.loop.compute_expected_rise()) <= _VENTED_N
        is_vented = is_vented and line.standing_v is not None and line.standing_v <= _VENTED_V
        if not valve.step(now_s, wanted, status, is_vented=is_vented):
            return False
        direction = -1.0 if valve.is_pulling else 1.0
        self._conditioner.direction = direction
        self._commands.turn(direction)
        parts.faults.shift_zero(2.0 * parts.faults.measured_n)
        parts.faults.start()
        parts.loop.rest()
        machine.tell("the valve pulls" if valve.is_pulling else "the valve pushes")
        return True
