"""A machine that sticks and slips, creeps, has play in its regulator, strikes when it touches, hears its voltages in turns, and
may pull: what a drawn machine has not."""

from dataclasses import dataclass
from random import Random

from tests.control.drawn.machine import STEP_S, Machine

STANDS_MS = 50  # behind which a slide sticks
STRIKE_S = 0.01


@dataclass
class WideMachine(Machine):
    """stick_share: how much more friction holds what stands; creep_share: what the thrust gains within creep_s;
    play_v: of the regulator; strike_n: when the tool touches; heard_every_ms: of the output's line; pull_share: of the piston;
    direction: -1 where it pulls, and then force_n counts so."""

    stick_share: float = 0.0
    creep_share: float = 0.0
    creep_s: float = 8.0
    play_v: float = 0.0
    strike_n: float = 0.0
    heard_every_ms: int = 1
    pull_share: float = 0.75
    direction: float = 1.0
    _stood_ms: int = 0
    _crept_n: float = 0.0
    _struck_n: float = 0.0
    _heard_v: float = 0.0
    _ms: int = 0

    def turn(self, direction: float) -> None:
        """Give the pressure to the other chamber."""
        if direction != self.direction:
            self.direction, self._slide_n, self._crept_n = direction, -self._slide_n, 0.0

    @property
    def thrust_n(self) -> float:
        """Of the pressure that is in the chamber."""
        return self.along_n_per_v * self._pressure

    @property
    def along_n_per_v(self) -> float:
        return self.gain_n_per_v * (self.pull_share if self.direction < 0.0 else 1.0)

    def advance(self, voltage_v: float, steps: int) -> None:
        for _ in range(steps):
            self._ms += 1
            if self._ms % self.heard_every_ms == 0:
                self._heard_v = round(voltage_v / self.count_v) * self.count_v
            self._follow_pressure()
            self._slide()
            self._touch()
        if self.drift_per_s:
            self.gain_n_per_v *= 1.0 + self.drift_per_s * STEP_S * steps

    def _follow_pressure(self) -> None:
        self._waiting.append(self._heard_v)
        goal_v = self._waiting.popleft() if len(self._waiting) > round(self.delay_s / STEP_S) else 0.0
        if abs(goal_v - self._stage_v) > self.dead_band_v:
            goal_v = min(goal_v + self.play_v, max(goal_v - self.play_v, self._stage_v))
            most_v = self.slew_v_per_s * STEP_S
            self._stage_v = max(0.0, min(self._stage_v + most_v, max(self._stage_v - most_v, goal_v)))
        supplied_v = min(self._stage_v, self.supply_v) if self.air else 0.0
        self._pressure += (supplied_v - self._pressure) * STEP_S / self.lag_s

    def _slide(self) -> None:
        drive_n = self.along_n_per_v * self._pressure * (1.0 + self.curve_per_v * self._pressure)
        self._crept_n += (self.creep_share * drive_n - self._crept_n) * STEP_S / self.creep_s
        drive_n += self._crept_n
        play_n = min(self.friction_n, self.friction_share * drive_n)
        held_n = play_n * (1.0 + self.stick_share) if self._stood_ms >= STANDS_MS else play_n
        if drive_n - held_n <= self._slide_n <= drive_n + held_n:
            self._stood_ms += 1
            return
        slides_to_n = min(drive_n + play_n, max(drive_n - play_n, self._slide_n))
        self._stood_ms, self._slide_n = 0, slides_to_n

    def _touch(self) -> None:
        given_n = self._slide_n + self.direction * self.weight_n
        if self.gap_s > 0.0 and given_n > 0.2:
            self.gap_s -= STEP_S
            self._struck_n = self.strike_n if self.gap_s <= 0.0 else 0.0
        self._struck_n -= self._struck_n * STEP_S / STRIKE_S
        self.force_n = max(0.0, given_n) + self._struck_n if self.gap_s <= 0.0 else 0.0
        felt_n = self.direction * self.force_n - self.weight_n + self.push_n
        self._cell_n += (felt_n - self._cell_n) * STEP_S / self.cell_lag_s

    def bounds_n(self, voltage_v: float) -> tuple[float, float]:
        off_v = self.dead_band_v + self.play_v + 0.5 * self.count_v
        ends = []
        for way in (-1.0, 1.0):
            there_v = max(0.0, min(voltage_v, self.supply_v) + way * off_v)
            drive_n = self.along_n_per_v * there_v * (1.0 + self.curve_per_v * there_v)
            drive_n *= 1.0 + max(0.0, way * self.creep_share)
            held_n = min(self.friction_n, self.friction_share * drive_n) * (1.0 + self.stick_share)
            ends.append(drive_n + way * held_n + self.direction * self.weight_n)
        return max(0.0, ends[0]), max(0.0, ends[1])


def draw_wide_machine(draw: Random, machine: Machine) -> WideMachine:
    """Return this machine with about two of what it had not."""
    wide = WideMachine(**{name: getattr(machine, name) for name in machine.__dataclass_fields__ if name[0] != "_"})

    def one_in(n: int) -> bool:
        return draw.random() < 1.0 / n

    if one_in(3):
        wide.stick_share = draw.choice((0.2, 0.5, 1.0))
    if one_in(4):
        wide.creep_share, wide.creep_s = draw.choice((-0.08, 0.05, 0.1, 0.2)), draw.choice((3.0, 10.0))
    if one_in(4):
        wide.play_v = draw.choice((0.02, 0.05, 0.1))
    if one_in(3):
        wide.strike_n = draw.choice((3.0, 10.0, 30.0))
    if one_in(4):
        wide.count_v = draw.choice((0.04, 0.1))
    if one_in(3):
        wide.heard_every_ms = draw.choice((5, 20, 50))
    if one_in(4):
        wide.noise_n = draw.choice((0.5, 1.0))
    wide.pull_share = draw.uniform(0.68, 0.82)
    return wide
