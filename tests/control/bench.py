"""A rig in virtual time for the tests of control: a small plant, a stand-in for bank and output line, and the history.

The plant shares nothing with the product's twin nor with its model: delay, first-order lag, a play operator for
friction, a rest, a cell with lag, noise and quantum. Its loop differs from the model's by a few newtons, so that the
trim has something to do.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from math import ceil, nan
from random import Random

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse, Controller, ControlSettings, Limits, LineStatus, Output, Supervision, Trim
from gateway.devices.messages import ForceSample, Quality
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, Mode
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite

STEP_S = 0.001
MOMENTARY = ControlBit.RESET_FAULT | ControlBit.TARE | ControlBit.TAKE_OWNERSHIP
"""Bits that read back as 0."""


@cache
def bsfm(scale: float = 1.0, span_n: float = 6.0) -> Bsfm:
    """0..8 V, 0..57 N, a loop 4 N wide; scale multiplies all forces."""
    rising = RationalBezier(0.0, 8.0, [0.0, 26.0 * scale, 57.0 * scale], [1.0, 1.0, 1.0])
    falling = RationalBezier(0.0, 8.0, [0.0, 34.0 * scale, 57.0 * scale], [1.0, 1.0, 1.0])
    return Bsfm(Branches(rising, falling), LinearBlend(span_n))


def settings(**supervision: object) -> ControlSettings:
    """Of a rig as fast as SmallPlant; supervision: fields to change."""
    return ControlSettings(
        limits=Limits(force_max_n=50.0, over_force_n=60.0, smallest_force_n=0.2, voltage_max_v=9.0),
        trim=Trim(gain_v_per_n_s=0.8, limit_v=0.6),
        supervision=Supervision(**{"response_lag_s": 0.12, **supervision}),  # type: ignore[arg-type]
    )


@dataclass
class SmallPlant:
    """Regulator, friction and cell. contact False: nothing pushes back; air False: no pressure comes."""

    rng: Random
    gain_n_per_v: float = 7.4
    friction_n: float = 2.0
    lag_s: float = 0.08
    delay_s: float = 0.02
    cell_lag_s: float = 0.015
    noise_n: float = 0.04
    quantum_n: float = 0.098
    contact: bool = True
    air: bool = True
    sign: float = 1.0
    unit: float = 1.0
    force_n: float = 0.0
    _pressure: float = 0.0
    _cell_n: float = 0.0
    _waiting: deque[float] = field(default_factory=deque)

    def advance(self, voltage_v: float, steps: int = 1) -> None:
        """Steps of 1 ms under one voltage: by the million in the gate, hence the local names."""
        waiting, arriving_v, delay = self._waiting, voltage_v if self.air else 0.0, round(self.delay_s / STEP_S)
        gain, friction_n, force_n, has_contact = self.gain_n_per_v, self.friction_n, self.force_n, self.contact
        pressure, cell_n, lag_s, cell_lag_s = self._pressure, self._cell_n, self.lag_s, self.cell_lag_s
        for _ in range(steps):
            waiting.append(arriving_v)
            delayed_v = waiting.popleft() if len(waiting) > delay else 0.0
            pressure += (delayed_v - pressure) * STEP_S / lag_s
            drive_n = gain * pressure
            play_n = 0.25 * drive_n
            if play_n > friction_n:
                play_n = friction_n
            low_n, high_n = drive_n - play_n, drive_n + play_n
            held_n = force_n if force_n < high_n else high_n
            if held_n < low_n:
                held_n = low_n
            force_n = held_n if has_contact and held_n > 0.0 else 0.0
            cell_n += (force_n - cell_n) * STEP_S / cell_lag_s
        self.force_n, self._pressure, self._cell_n = force_n, pressure, cell_n

    def reading_n(self) -> float:
        noisy_n = self.sign * self.unit * self._cell_n + self.rng.gauss(0.0, self.noise_n)
        return round(noisy_n / self.quantum_n) * self.quantum_n


@dataclass(frozen=True)
class Record:
    """One step: what went in, what came out, and the true force at that time."""

    time_s: float
    output: Output
    force_n: float
    command: Command
    sample: ForceSample | None
    line: LineStatus


class Bench:
    """Control at 100 Hz ticks, on each sample (of a 100 Hz cell, 5 ms apart from the ticks) and on each command."""

    sample_every_ms = 10

    def __init__(self, control: ControlSettings | None = None, seed: int = 1, **plant: float | bool) -> None:
        self.settings = control or settings()
        self.rng = Random(seed)
        self.plant = SmallPlant(self.rng, **plant)  # type: ignore[arg-type]
        self.controller = Controller(self.settings, CalibrationInUse(bsfm(), 1))
        self.line = LineStatus(acknowledged_v=0.0)
        self.command = Command()
        self.sample: ForceSample | None = None
        self.history: list[Record] = []
        self.events: list[str] = []
        self.voltage_v = 0.0
        self.ms = 0
        self.heartbeat_every_ms = 0
        self.cell_silent = self.output_silent = self.cell_frozen = self.loop_blocked = False
        self.alter_sample: Callable[[ForceSample], ForceSample] = lambda sample: sample
        self.releases = 0
        self.refused: EdgeRefusal | None = None
        self.ignores_clearing = False

    @property
    def now_s(self) -> float:
        return self.ms * STEP_S

    @property
    def last(self) -> Output:
        return self.history[-1].output

    def write(self, **changes: object) -> Output:
        """A master's write of some registers, as the bank would pass it on, or keep to itself (`refused`)."""
        number = self.command.number + 1
        changed = {**changes, "number": number, "received_s": self.now_s, "peer": "10.0.0.5"}
        stands = self.command._replace(control_word=self.command.control_word & ~MOMENTARY)
        wanted = stands._replace(**changed)  # type: ignore[arg-type]
        silent = {"control_word", "heartbeat", "command_sequence"}
        names = tuple(name for name in changes if name not in silent and changes[name] != getattr(stands, name))
        self.refused = self.controller.refusal_of(self.now_s, ProposedWrite(wanted, lambda: names), self.line)
        if self.refused is None:
            self.command = wanted
        return self.step()

    def enable(self, force_n: float = 0.0, **changes: object) -> Output:
        return self.write(control_word=ControlBit.ENABLE, force_setpoint_n=force_n, **changes)

    def force(self, force_n: float) -> Output:
        return self.write(force_setpoint_n=force_n)

    def voltage(self, voltage_v: float) -> Output:
        return self.write(control_word=ControlBit.ENABLE, mode=Mode.VOLTAGE, voltage_setpoint_v=voltage_v)

    def disable(self) -> Output:
        return self.write(control_word=ControlBit(0))

    def reset(self) -> Output:
        self.write(control_word=ControlBit(0), force_setpoint_n=0.0)
        return self.write(control_word=ControlBit.RESET_FAULT, heartbeat=self.command.heartbeat + 1)

    def step(self) -> Output:
        if self.output_silent and self.line.unanswered_since_s is None:
            self.line = self.line._replace(unanswered_since_s=self.now_s)
        output = self.controller.step(self.now_s, self.command, self.sample, self.line)
        self.voltage_v = output.voltage_v
        self.history.append(Record(self.now_s, output, self.plant.force_n, self.command, self.sample, self.line))
        if self.line.late_s:
            self.line = self.line._replace(late_s=0.0)
        self.events.extend(output.events)
        self.releases += output.release_owner
        if output.clear_command and not self.ignores_clearing:
            self.command = self.command._replace(
                control_word=ControlBit(0),
                force_setpoint_n=0.0,
                voltage_setpoint_v=0.0,
                number=self.command.number + 1,
            )
        return output

    def run(self, seconds: float) -> Output:
        left = round(seconds / STEP_S)
        while left > 0:
            steps = min(left, self._steps_to_next())
            self._advance(steps)
            left -= steps
        return self.last

    @property
    def _sampled_at_ms(self) -> int:
        """Of each period of the load cell."""
        return min(5, self.sample_every_ms - 1)

    def _steps_to_next(self) -> int:
        """Steps until something may happen besides the plant's motion: until then nobody looks at it."""
        to_sample = (self._sampled_at_ms - self.ms - 1) % self.sample_every_ms + 1
        to_beat = self.heartbeat_every_ms - self.ms % self.heartbeat_every_ms if self.heartbeat_every_ms else to_sample
        return min(10 - self.ms % 10, to_sample, to_beat)

    def _advance(self, steps: int) -> None:
        """No more than `_steps_to_next`."""
        self.ms += steps
        self.plant.advance(self.voltage_v, steps)
        if self.loop_blocked:
            return
        if self.ms % self.sample_every_ms == self._sampled_at_ms and not self.cell_silent:
            self._measure()
            self.step()
        if self.heartbeat_every_ms and self.ms % self.heartbeat_every_ms == 0:
            self.write(heartbeat=(self.command.heartbeat + 1) % 1000)
        if self.ms % 10 == 0:
            self.step()

    def _measure(self) -> None:
        if self.cell_frozen and self.sample:
            self.sample = replace(self.sample, time_s=self.now_s)
            return
        force_n = self.plant.reading_n()
        self.sample = self.alter_sample(ForceSample(force_n, force_n, Quality.OK, self.now_s))

    def block_loop(self, seconds: float) -> None:
        """The process stands still; the plant does not."""
        self.loop_blocked = True
        self.run(seconds)
        self.loop_blocked = False
        self.line = self.line._replace(late_s=seconds)

    def silence_output(self) -> None:
        self.output_silent = True

    def heal(self) -> None:
        """Everything outside control works again."""
        self.cell_silent = self.output_silent = self.cell_frozen = False
        self.line = LineStatus(acknowledged_v=self.voltage_v)
        self.alter_sample = lambda sample: sample
        self.plant.sign = self.plant.unit = 1.0
        self.plant.contact = self.plant.air = True

    def seconds_until(self, done: Callable[[Output], bool], limit_s: float) -> float:
        """Virtual time until a step answers what is waited for; nan when it does not within limit_s."""
        start_ms = self.ms
        seen = len(self.history)
        while self.ms - start_ms < limit_s / STEP_S:
            self._advance(min(self._steps_to_next(), ceil(limit_s / STEP_S - (self.ms - start_ms))))
            if any(done(record.output) for record in self.history[seen:]):
                return (self.ms - start_ms) * STEP_S
            seen = len(self.history)
        return nan

    def voltages(self) -> Iterator[tuple[float, float]]:
        return ((record.time_s, record.output.voltage_v) for record in self.history)


def has_fault(code: FaultCode) -> Callable[[Output], bool]:
    return lambda output: output.fault is code


def enabled(control: ControlSettings | None = None, seed: int = 1, **plant: float) -> Bench:
    """A bench whose output is on, at 0 N."""
    bench = Bench(control, seed, **plant)
    bench.run(0.1)
    bench.enable(0.0)
    return bench
