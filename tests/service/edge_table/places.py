"""Where a rig may stand when a write arrives: the states, and within them what makes a difference to the answer."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from gateway.control import ControlSettings
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.settings import LeaseAction, SelfTestSettings
from gateway.registers.words import CalibrationPhase, State
from tests.control.bench import settings
from tests.service.running_rig.simulated_rig import CALIBRATE, ENABLE, SmallRig, with_limits

LEASE_S: Final = 0.35


def control(leased: bool, ramp_n_per_s: float | None = None, **supervision: object) -> ControlSettings:
    whole = replace(settings(lease_s=LEASE_S if leased else None, **supervision), self_test=SelfTestSettings())
    if ramp_n_per_s is None:
        return whole
    return replace(whole, defaults=replace(whole.defaults, force_ramp_n_per_s=ramp_n_per_s))


def rig(leased: bool) -> SmallRig:
    return SmallRig(control(leased))


def ready(leased: bool) -> SmallRig:
    begun = rig(leased)
    begun.write(0, ENABLE)
    return begun.run(0.3)


def slow(leased: bool) -> SmallRig:
    """A force that takes seconds to get anywhere."""
    begun = SmallRig(control(leased, 5.0))
    begun.write(0, ENABLE, 3000)
    return begun.until(State.RAMPING).run(1.0)


def local(leased: bool) -> SmallRig:
    begun = rig(leased)
    begun.controller.active_run.ask(CalibrationPlan())
    return begun.until(State.CALIBRATING).run(2.5)


def ending(leased: bool) -> SmallRig:
    """Bit 5 has been cleared, and the ramp takes a while."""
    begun = SmallRig(with_limits(control(leased, 1.0), force_max_n=50.0)).calibrating()
    begun.write(0, 0)
    assert begun.state is State.CALIBRATING
    return begun


def stopping(leased: bool) -> SmallRig:
    begun = slow(leased)
    begun.run(2.0)
    begun.controller.stop()
    return begun.run(0.1)


def stopped(leased: bool) -> SmallRig:
    begun = rig(leased).holding()
    begun.controller.stop()
    return begun.until(State.OFF).run(1.5)


def fitting(leased: bool) -> SmallRig:
    begun = rig(leased)
    begun.controller.active_run.phase = CalibrationPhase.FITTING
    return begun


def abandoned(action: LeaseAction) -> SmallRig:
    """The master's heartbeat has stood still for longer than its lease."""
    begun = SmallRig(control(True, 5.0 if action is LeaseAction.RAMP else None, lease_action=action)).holding()
    begun.beats = False
    return begun.run(LEASE_S + 0.2)


def given_up(leased: bool) -> SmallRig:
    """The same behind the ramp: the output is off."""
    begun = SmallRig(control(leased, lease_action=LeaseAction.RAMP)).holding()
    begun.beats = False
    begun.until(State.OFF).run(1.5).beats = True  # of who owns it then
    return begun


@dataclass(frozen=True)
class Place:
    """stands: bits of the control word that are 1; force_n: the setpoint that stands; presses: a voltage is out; runs: a run
    has the output, or its end; is_going: the force is on its way to 0 for good; is_given_up: the
    master was lost, and has not beaten since; leases: with which kinds of rig."""

    name: str
    make: Callable[[bool], SmallRig]
    state: State
    stands: int = 0
    force_n: float = 0.0
    presses: bool = False
    runs: bool = False
    is_going: bool = False
    is_fitting: bool = False
    is_stopped: bool = False
    is_given_up: bool = False
    leases: tuple[bool, ...] = (False, True)


_BOTH: Final = ENABLE | CALIBRATE
PLACES: Final = (
    Place("off", rig, State.OFF),
    Place("off, last ladder being fitted", fitting, State.OFF, is_fitting=True),
    Place("off, gateway stopping", stopped, State.OFF, is_stopped=True),
    Place("off, master lost", given_up, State.OFF, is_given_up=True, leases=(True,)),
    Place("ready", ready, State.READY, ENABLE),
    Place("ramping to 30 N", slow, State.RAMPING, ENABLE, 30.0, presses=True),
    Place("holding 12 N", lambda leased: rig(leased).holding(), State.HOLDING, ENABLE, 12.0, presses=True),
    Place("holding, master lost", lambda leased: abandoned(LeaseAction.HOLD), State.HOLDING, ENABLE, 12.0, presses=True,
          is_given_up=True, leases=(True,)),
    Place("ramping to 0, master lost", lambda leased: abandoned(LeaseAction.RAMP), State.RAMPING, ENABLE, 12.0,
          presses=True, is_going=True, leases=(True,)),
    Place("ramping to 0, gateway stopping", stopping, State.RAMPING, ENABLE, 30.0, presses=True, is_going=True),
    Place("fault", lambda leased: rig(leased).faulted(), State.FAULT),
    Place("calibrating", lambda leased: rig(leased).calibrating(), State.CALIBRATING, CALIBRATE, presses=True, runs=True),
    Place("calibrating, enable kept", lambda leased: rig(leased).calibrating(_BOTH), State.CALIBRATING, _BOTH, presses=True,
          runs=True),
    Place("calibrating, begun here", local, State.CALIBRATING, presses=True, runs=True),
    Place("calibration ended, force to 0", ending, State.CALIBRATING, presses=True, runs=True, is_going=True),
)  # fmt: skip
"""Every state, and within it every situation to which an answer may differ."""
