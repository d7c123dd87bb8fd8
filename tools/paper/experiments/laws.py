"""Who turns a wanted force into volts, ten milliseconds at a time. One object per lane.

- Switched: the paper's way. Inverse of the branch of the present direction, open loop, branches switched at a reversal.
- Ours: gateway.control.Controller as shipped: slip-selected reversal, lead and the load-cell trim, with the rig's lags told to
  it and its ramps opened as far as the registers allow (the paper's law has none).
"""

from typing import Final, Protocol

from gateway.bsfm.branches import Branches
from gateway.bsfm.model import Bsfm
from gateway.control import (
    CalibrationInUse,
    Controller,
    ControlSettings,
    Defaults,
    LeadSettings,
    Limits,
    LineStatus,
    Supervision,
    Trim,
)
from gateway.devices.messages import ForceSample, Quality
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, State
from paper.experiments.calibration import Calibrated

TICK_S: Final = 0.01
OFF_TICKS: Final = 20  # samples that the controller sees before it is enabled
LAG_S: Final = 0.072  # each of the regulator's two, nominal: what the lead is told
FASTEST_N_PER_S: Final = 3276.7  # what the force_ramp register can say
TRIM: Final = Trim(gain_v_per_n_s=0.4, limit_v=0.5, dead_zone_n=0.05)
RESPONSE_LAG_S: Final = 0.224  # the area of delay and lags
LEAD: Final = LeadSettings(lag_s=LAG_S, second_lag_s=LAG_S)
LAW_NAMES: Final = ("psfm", "psfm 2", "bsfm", "ours")


class Law(Protocol):
    """Turns a wanted force into volts, tick by tick."""

    def command_v(self, desired_n: float, measured_n: float) -> float:
        """Return the volts for this tick."""
        ...


class Switched:
    """The paper's open loop. The direction is that of the last change of the wanted force, rising at first."""

    def __init__(self, branches: Branches) -> None:
        self._branches = branches
        self._desired_n, self._rising = 0.0, True

    def command_v(self, desired_n: float, measured_n: float) -> float:
        """Return the inverse of the branch of the present direction, V."""
        if desired_n != self._desired_n:
            self._rising = desired_n > self._desired_n
            self._desired_n = desired_n
        if desired_n <= 0.0:
            return 0.0
        curve = self._branches.rising if self._rising else self._branches.falling
        return curve.inverse(desired_n)[0]


def settings(response_lag_s: float, trim: Trim, precontact_n: float = 60.0) -> ControlSettings:
    """Return a rig's settings for these experiments; precontact 60 N: no soft approach, as the paper has none."""
    return ControlSettings(
        limits=Limits(force_max_n=60.0, over_force_n=75.0, voltage_max_v=8.5, voltage_slew_v_per_s=1.0e4),
        defaults=Defaults(force_ramp_n_per_s=FASTEST_N_PER_S, precontact_force_n=precontact_n),
        trim=trim,
        lead=LEAD,
        supervision=Supervision(response_lag_s=response_lag_s, sample_quantum_n=1.0e-3),
    )


class Ours:
    """The gateway's controller on one lane."""

    def __init__(self, model: Bsfm, chosen: ControlSettings | None = None) -> None:
        self._controller = Controller(chosen or settings(RESPONSE_LAG_S, TRIM), CalibrationInUse(model, 1))
        self._voltage_v, self._ticks, self._command = 0.0, 0, Command()

    def command_v(self, desired_n: float, measured_n: float) -> float:
        """Return what the gateway's controller puts out at this tick, V."""
        now_s = self._ticks * TICK_S
        self._tell(desired_n, now_s)
        sample = ForceSample(measured_n, measured_n, Quality.OK, now_s)
        output = self._controller.step(now_s, self._command, sample, LineStatus(acknowledged_v=self._voltage_v))
        if output.state is State.FAULT:
            raise RuntimeError("; ".join(output.events) or f"fault {output.fault}")
        self._ticks += 1
        self._voltage_v = output.voltage_v
        return output.voltage_v

    def _tell(self, desired_n: float, now_s: float) -> None:
        word = ControlBit.ENABLE if self._ticks >= OFF_TICKS else ControlBit(0)
        if desired_n != self._command.force_setpoint_n or word != self._command.control_word:
            number = self._command.number + 1
            self._command = Command(word, desired_n, number=number, received_s=now_s)


def law(name: str, calibrated: Calibrated) -> Law:
    """Return a fresh law by its name in LAW_NAMES."""
    branches = {"psfm": calibrated.psfm, "psfm 2": calibrated.psfm_same_order, "bsfm": calibrated.bsfm}
    if name in branches:
        return Switched(branches[name])
    return Ours(calibrated.ours)
