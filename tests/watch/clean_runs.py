"""Recordings of a healthy machine as a gateway makes them, of every kind that a user's first day brings, in virtual time.

The whole wired gateway works (bank, control, codecs, wires, twin) on a machine that is busy now and then: its loop wakes
late by chance, so readings come late and in pairs, and rows are uneven. What is recorded begins where a person would
begin: at rest, in the middle of a hold, of a ramp, of a fall, after wiggles. The same kind and seed give the same rows.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

from gateway.catalogue.effect import PartName
from gateway.control.runs.active_run import AnyPlan
from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.diagnosis.experiments.blocks import BLOCKS
from gateway.profiles import Rig
from gateway.recording import Recorder
from gateway.registers.words import State
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from tests.service.rigs import demo
from tests.service.wired import ENABLE, STEP_S, Wired, _Absent

LASTS_S: Final = 70.0
_NAPS: Final = ((0.05, 0.002), (0.003, 0.012))  # chance of one per tick, and its mean, s


class Rows(list[tuple[float, ...]]):
    """Where the gateway puts its rows instead of the ring: all of them."""

    def __bool__(self) -> bool:
        return True  # there is one, however empty


class Busy(Wired):
    """A gateway on a machine that does other work besides: now and then its loop wakes late."""

    def __init__(self, rig: Rig | None = None, *, seed: int = 7) -> None:
        self._chance = np.random.default_rng([seed, 5])
        self._awake_s = 0.0
        super().__init__(rig, seed=seed)
        self.rows = Rows()
        self.loop.ring = self.rows  # type: ignore[assignment]

    def _step(self) -> None:
        if self._steps % 10 == 0:
            for chance, mean_s in _NAPS:
                if self._chance.random() < chance:
                    self._awake_s = self.now_s + float(self._chance.exponential(mean_s))
        if self.now_s >= self._awake_s:
            super()._step()
            return
        loop, waiting = self.loop, _Absent()
        self.loop = waiting  # type: ignore[assignment]
        while self.now_s < self._awake_s:
            super()._step()
        self.loop = loop
        loop.on_output_bytes(waiting.output, self.now_s)
        loop.on_cell_bytes(waiting.cell, self.now_s)
        loop.on_tick(1, 0.0)


class Run:
    """One run of a kind; `record` marks where the recording begins, which is cut off `lasts_s` later."""

    def __init__(self, seed: int, lasts_s: float = LASTS_S, rig: Rig | None = None) -> None:
        self.lasts_s = lasts_s
        self.wired = Busy(rig, seed=seed)
        self.draw = np.random.default_rng([seed, 9])
        self.wired.ready()
        self._begin_s = math.inf

    def record(self) -> None:
        self._begin_s = self.wired.now_s

    @property
    def goes_on(self) -> bool:
        return self.wired.now_s < self._begin_s + self.lasts_s

    def rest(self, duration_s: float) -> None:
        self.wired.run(duration_s)

    def hold(self, force_n: float, duration_s: float = 0.0, ramp_n_per_s: float = 0.0) -> None:
        """A setpoint, and so long with it."""
        self.wired.write(0, ENABLE, round(100.0 * force_n), round(10.0 * ramp_n_per_s))
        self.rest(duration_s)

    def off(self, duration_s: float) -> None:
        self.wired.write(0, 0)
        self.rest(duration_s)

    def conduct(self, plan: AnyPlan) -> None:
        """A calibration or an experiment of the gateway, to its end or as long as the recording goes on."""
        calibrating = self.wired.controller.active_run
        calibrating.ask(plan)
        self.rest(0.1)
        while calibrating.running and self.goes_on:
            self.rest(STEP_S * 100)

    def rows(self) -> list[tuple[float, ...]]:
        """From the beginning of the recording, times from 0."""
        remaining = [row for row in self.wired.rows if self._begin_s <= row[0] <= self._begin_s + self.lasts_s]
        return [(row[0] - remaining[0][0], *row[1:]) for row in remaining]


def _stairs(run: Run) -> None:
    """5 .. 40 N and back, some seconds each."""
    run.record()
    run.rest(1.0)
    while run.goes_on:
        for force_n in (*range(5, 45, 5), *range(35, 0, -5)):
            run.hold(force_n, 2.5)


def _ladder(run: Run) -> None:
    run.record()
    run.conduct(CalibrationPlan(step_v=0.5, groups=2, minor_points=20))


def _plan(run: Run) -> None:
    run.record()
    parts = tuple(BLOCKS[name] for name in (PartName.STEPS, PartName.REVERSALS, PartName.DWELLS))
    run.conduct(ExperimentPlan(name="a plan", parts=parts, check=False))


def _sine(run: Run) -> None:
    """0.2 Hz, a setpoint every 50 ms, as a robot would send them."""
    run.hold(20.0, 1.0)
    run.record()
    while run.goes_on:
        run.hold(20.0 + 12.0 * math.sin(2.0 * math.pi * 0.2 * run.wired.now_s), 0.05, 2000.0)


def _at_rest(run: Run) -> None:
    run.record()
    run.rest(run.lasts_s)


def _one_force(run: Run) -> None:
    run.hold(15.0, 3.0)
    run.record()
    run.rest(run.lasts_s)


def _random(run: Run) -> None:
    run.record()
    while run.goes_on:
        run.hold(run.draw.uniform(4.0, 40.0), run.draw.uniform(0.5, 2.0))


def _taps(run: Run) -> None:
    """Short presses with rests between."""
    run.record()
    while run.goes_on:
        run.hold(run.draw.choice((8.0, 12.0, 20.0)), 0.6)
        run.off(run.draw.uniform(0.8, 2.0))


def _job(run: Run) -> None:
    """What a robot does: approach, press for a while, lift, wait."""
    run.record()
    while run.goes_on:
        run.rest(2.0)
        for force_n in run.draw.uniform(8.0, 30.0, 3):
            run.hold(force_n, 3.0, 20.0)
        run.off(1.5)


def _from_a_hold(run: Run) -> None:
    run.hold(30.0, 2.0)
    run.hold(12.0, 2.0)
    run.record()
    run.rest(4.0)
    _go_on(run)


def _from_a_ramp(run: Run) -> None:
    run.hold(8.0, 2.0)
    run.hold(32.0, 2.0, 5.0)
    run.record()
    run.rest(5.0)
    _go_on(run)


def _from_a_fall(run: Run) -> None:
    run.hold(35.0, 2.0)
    run.hold(5.0, 1.5, 10.0)
    run.record()
    run.rest(3.0)
    _go_on(run)


def _from_wiggles(run: Run) -> None:
    run.hold(25.0, 2.0)
    run.hold(20.0, 1.0)
    for force_n in (20.6, 19.7, 20.4, 19.9, 20.2):
        run.hold(force_n, 0.7)
    run.record()
    run.rest(2.0)
    for force_n in (20.5, 19.8, 20.6, 20.0):
        run.hold(force_n, 0.8)
    _go_on(run)


def _go_on(run: Run) -> None:
    """Slow moves within a part of the range: what was before is forgotten late."""
    while run.goes_on:
        run.hold(run.draw.uniform(10.0, 26.0), run.draw.uniform(1.0, 3.0), run.draw.choice((5.0, 15.0, 200.0)))


KINDS: Final[dict[str, Callable[[Run], None]]] = {
    "stairs": _stairs,
    "ladder": _ladder,
    "plan": _plan,
    "sine": _sine,
    "at rest": _at_rest,
    "one force": _one_force,
    "random": _random,
    "taps": _taps,
    "job": _job,
    "from a hold": _from_a_hold,
    "from a ramp": _from_a_ramp,
    "from a fall": _from_a_fall,
    "from wiggles": _from_wiggles,
}


def rows_of(kind: str, seed: int, lasts_s: float = LASTS_S) -> list[tuple[float, ...]]:
    """Rows in the order of COLUMNS."""
    run = Run(seed, lasts_s)
    KINDS[kind](run)
    assert run.wired.state is not State.FAULT, run.wired.log[-5:]
    return run.rows()


def recorded(kind: str, seed: int, directory: Path, lasts_s: float = LASTS_S) -> Path:
    """The run as a file of the gateway's own, with its rig's texts."""
    rig = demo()
    header = {"rig": rig.name, "rig_fingerprint": rig.fingerprint, "rig_texts": dict(rig.texts), "simulated": True}
    recorder = Recorder(directory, header, COLUMNS)
    for row in rows_of(kind, seed, lasts_s):
        recorder.append(row)
    recorder.close()
    return recorder.path
