"""The bench of a wide machine: rig files of people who know it less well, and a valve with a relay of its own."""

from dataclasses import replace
from random import Random

from gateway.control import ControlSettings, Output
from gateway.control.inputs import ValveStatus
from gateway.control.settings import SafeDirection, ValveControl
from gateway.devices.valve_profile import ValveDirection
from tests.control.drawn.machine import Machine
from tests.control.drawn.rig import DrawnRig
from tests.control.drawn.wide_machine import WideMachine, draw_wide_machine

PUSH, PULL = ValveDirection


class WideRig(DrawnRig):
    """stands: of the relay, and of the valve; told: what it was told last, told_s: when; moved_s: when it stood there;
    obeys: whether the relay follows; silent_since_s: of one that answers nothing."""

    machine: WideMachine

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        draw = Random(f"relay {seed}")
        valve = self.settings.valve
        self.moves_s = draw.choice((0.02, 0.1, 0.25))
        starts = draw.choice((PUSH, PULL)) if valve and valve.safe is SafeDirection.KEEP else PUSH
        self.stands = PULL if valve and valve.safe is SafeDirection.PULL else starts
        self.told: ValveDirection | None = self.stands
        self.told_s = self.moved_s = -10.0
        self.obeys, self.is_by_hand = True, False
        self.silent_since_s: float | None = None
        self.machine.turn(-1.0 if self.stands is PULL else 1.0)

    def drawn_machine(self, draw: Random, seed: int) -> Machine:
        return draw_wide_machine(Random(f"wide {seed}"), super().drawn_machine(draw, seed))

    def drawn_settings(self, draw: Random, machine: Machine, seed: int) -> ControlSettings:
        known, draw = super().drawn_settings(draw, machine, seed), Random(f"rig file {seed}")
        pace = draw.choice((1.0, 1.0, 1.0, 3.0, 8.0))
        self.is_tame = pace == 1.0 and not machine.stick_share and not machine.creep_share
        trim = replace(known.trim, gain_v_per_n_s=pace * known.trim.gain_v_per_n_s)
        band_n = draw.choice((known.defaults.in_band_tolerance_n, 1.0, 2.0))
        self.is_tame = self.is_tame and band_n >= known.defaults.in_band_tolerance_n
        known = replace(known, trim=trim, defaults=replace(known.defaults, in_band_tolerance_n=band_n))
        if draw.random() < 0.5:
            return known
        valve = ValveControl(
            dwell_s=draw.choice((0.0, 0.1, 0.3, 0.6)),
            timeout_s=draw.choice((0.3, 0.5, 1.0)),
            safe=draw.choice(tuple(SafeDirection)),
            pull_area_share=0.75,
        )
        limits = replace(known.limits, safe_voltage_v=0.0, voltage_min_v=0.0)  # others are refused beside a valve
        return replace(known, valve=valve, limits=limits)

    @property
    def is_well(self) -> bool:
        """Whether the relay follows and answers."""
        return self.obeys and self.silent_since_s is None

    def flip(self) -> None:
        """Somebody turns the valve by hand; the relay turns it back, whatever presses."""
        self.is_by_hand = True
        self._turn(PUSH if self.stands is PULL else PULL)

    def _turn(self, stands: ValveDirection) -> None:
        self.stands = stands
        self.machine.turn(-1.0 if stands is PULL else 1.0)

    def move_relay(self) -> bool:
        """Let the relay do what it was told; return whether it has just done what control has asked for."""
        if not self.obeys or self.told in (None, self.stands) or self.now_s - self.told_s < self.moves_s:
            return False
        is_asked, self.is_by_hand = not self.is_by_hand, False
        self._turn(self.told)
        self.moved_s = self.now_s if is_asked else self.moved_s
        return is_asked

    def step(self) -> Output:
        if self.settings.valve is None:
            return super().step()
        status = ValveStatus(self.stands, self.silent_since_s)
        standing_v = self.voltage_v if self.line.unanswered_since_s is None else None
        self.line = self.line._replace(valve=status, standing_v=standing_v)
        output = super().step()
        if output.valve not in (None, self.told):
            self.told, self.told_s, self.is_by_hand = output.valve, self.now_s, False
        return output
