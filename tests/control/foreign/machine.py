"""Machines that nobody here has built: a family of plants drawn from a seed, which shares no code with the twin.

Dead time, a second-order regulator with a command map of its own, a slide with LuGre friction (presliding, Stribeck, viscous)
pressing a damped pad, a load cell with filter, noise and quantum, and a wire to the output device that takes its time and
carries one setting after the other. Integrated with a fixed quarter of a millisecond, semi-implicit.
"""

from collections import deque
from dataclasses import dataclass
from math import exp
from random import Random
from typing import Final

MS: Final = 0.001
SUBSTEPS: Final = 4
COUNT_V: Final = 10.0 / 1023.0
RISE_V: Final = 0.25  # of the command before the valve opens


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """One plant. Seconds, newtons, volts, metres. damping: of the regulator where it is below 1, else its two lags hold."""

    name: str = ""
    dead_time_s: float = 0.05
    lag_s: float = 0.08
    second_lag_s: float = 0.04
    coulomb_n: float = 1.5
    static_share: float = 1.1  # breakaway over Coulomb friction
    presliding_m: float = 1.0e-4
    viscous_n_s_per_m: float = 60.0
    load_share: float = 0.02  # of the thrust that is friction besides
    gain_n_per_v: float = 8.0
    bow: float = 0.1  # of the command map at mid range
    pad_n_per_m: float = 3.0e4
    mass_kg: float = 0.7
    cell_lag_s: float = 0.006
    noise_n: float = 0.1
    quantum_n: float = 0.01
    rate_hz: float = 100.0
    damping: float = 1.0
    wire_s: float = 0.012

    def drive_n(self, voltage_v: float) -> float:
        """Thrust at rest for a command: not straight, and nothing below RISE_V."""
        share = min(1.0, max(0.0, (voltage_v - RISE_V) / (10.0 - RISE_V)))
        return self.gain_n_per_v * 10.0 * (share + self.bow * 4.0 * share * (1.0 - share) * (0.7 - share))


def drawn(seed: int) -> Machine:
    """The machine of a seed: log-uniform in times and friction, over the whole family."""
    rng = Random(1000 + seed)

    def between(low: float, high: float) -> float:
        return low * (high / low) ** rng.random()

    longer_s = between(0.03, 0.3)
    return Machine(
        name=f"plant {seed}",
        dead_time_s=between(0.02, 0.15),
        lag_s=longer_s,
        second_lag_s=longer_s * rng.choice([0.0, 0.3, 0.6, 1.0]),
        coulomb_n=between(0.5, 4.0),
        static_share=rng.choice([1.0, 1.1, 1.25]),
        presliding_m=between(3.0e-5, 2.5e-4),
        viscous_n_s_per_m=between(20.0, 200.0),
        load_share=rng.choice([0.0, 0.02, 0.04]),
        gain_n_per_v=between(6.5, 10.0),
        bow=rng.uniform(-0.25, 0.35),
        pad_n_per_m=between(1.5e4, 6.0e4),
        noise_n=between(0.02, 0.25),
        quantum_n=rng.choice([0.001, 0.01, 0.05]),
        rate_hz=rng.choice([100.0, 100.0, 50.0, 80.0]),
        wire_s=rng.choice([0.003, 0.008, 0.015]),
    )


class Slide:
    """The moving part of a machine: `step` for every millisecond of a voltage."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.force_n = self.cell_n = 0.0
        self._first_n = self._second_n = 0.0
        self._at_m = self._speed = self._bristle_m = 0.0
        delay = round(machine.dead_time_s / MS)
        self._on_the_way: deque[float] = deque([0.0] * delay)
        self._first_share = 1.0 - exp(-MS / machine.lag_s)
        self._second_share = 1.0 - exp(-MS / machine.second_lag_s) if machine.second_lag_s > 0.0 else 1.0
        self._cell_share = 1.0 - exp(-MS / machine.cell_lag_s)
        self._volts, self._drive_n = 0.0, machine.drive_n(0.0)

    def step(self, voltage_v: float) -> None:
        machine = self.machine
        if voltage_v != self._volts:
            self._volts, self._drive_n = voltage_v, machine.drive_n(voltage_v)
        way = self._on_the_way
        way.append(self._drive_n)
        way_n = way.popleft()
        if machine.damping < 1.0:
            self._ring(way_n)
        else:
            self._first_n += self._first_share * (way_n - self._first_n)
            self._second_n += self._second_share * (self._first_n - self._second_n)
        self._slide(self._second_n)
        self.cell_n += self._cell_share * (self.force_n - self.cell_n)

    def _ring(self, way_n: float) -> None:
        """A regulator that overshoots: its natural frequency is that of the two lags, first_n its speed in N/s."""
        machine = self.machine
        natural = 1.0 / (machine.lag_s * machine.second_lag_s) ** 0.5
        pull = natural * (natural * (way_n - self._second_n) - 2.0 * machine.damping * self._first_n)
        self._first_n += MS * pull
        self._second_n += MS * self._first_n

    def _slide(self, thrust_n: float) -> None:
        machine, step_s = self.machine, MS / SUBSTEPS
        at_m, speed, bristle_m = self._at_m, self._speed, self._bristle_m
        coulomb_n = machine.coulomb_n + machine.load_share * thrust_n
        stiff = machine.coulomb_n / machine.presliding_m
        damp = 0.6 * (stiff * machine.mass_kg) ** 0.5
        pad, pad_damp, mass = machine.pad_n_per_m, 60.0, machine.mass_kg
        for _ in range(SUBSTEPS):
            limit_n = coulomb_n * (1.0 + (machine.static_share - 1.0) * exp(-((speed / 0.002) ** 2)))
            # bristles: implicit in their own length, so that any speed is stable
            new_m = (bristle_m + step_s * speed) / (1.0 + step_s * stiff * abs(speed) / limit_n)
            friction_n = stiff * new_m + damp * (new_m - bristle_m) / step_s + machine.viscous_n_s_per_m * speed
            pressed_n = max(0.0, pad * at_m + pad_damp * speed) if at_m > 0.0 else 0.0
            speed += step_s * (thrust_n - pressed_n - friction_n) / mass
            at_m += step_s * speed
            bristle_m = new_m
        self._at_m, self._speed, self._bristle_m = at_m, speed, bristle_m
        self.force_n = max(0.0, pad * at_m)
