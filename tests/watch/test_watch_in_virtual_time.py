"""The residual watch over a whole gateway in virtual time: looks are cheap, searches rare, a changed plant is seen.

The search itself is a stub here (the engine has tests of its own, and tests/end_to_end runs both): it answers with the plant
that the test put behind the wires.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from gateway.diagnosis import Diagnosis, Verdict
from gateway.diagnosis.result import Baseline, Cause, Estimate, Extended, Gain, Leftover
from gateway.recording.ring import RingReader, SampleRing
from gateway.registers.residual_cause import ResidualCause
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.twin import Plant
from gateway.twin.plant import with_value
from gateway.watch.plant_comparison import PlantComparison
from gateway.watch.reference import WatchReference
from gateway.watch.residual_watch import Watch, WatchSettings
from gateway.watch.watch_process import diagnose_window
from gateway.watch.window_verdict import judge_window
from tests.service.wired import ENABLE, Wired

WIRE_S = 0.012  # what 9600 and 115200 baud add to the plant's delay
WINDOW_S, EVERY_S, SETPOINT_S = 10.0, 2.5, 0.5  # as short as the watch's laws hold: a second of all this takes 0.08 s
FIRST_WINDOW_S = 12.5
GAIN = Gain(1.0, 0.2, (0.7, 0.9), 0.9)


@dataclass
class StubDiagnosis:
    """Answers as the engine would that finds exactly this."""

    plant: Plant
    causes: tuple[Cause, ...] = ()
    leftover: tuple[Leftover, ...] = ()
    rms_n: float = 0.15
    requests: int = 0
    references: list[Plant] = field(default_factory=list)

    def __call__(self, measurements, plant: Plant) -> Diagnosis:
        self.requests += 1
        self.references.append(plant)
        return Diagnosis(
            verdict=Verdict.PARTIAL,
            baseline=Baseline(self.rms_n, 0.13, 3000, 30.0),
            causes=self.causes,
            leftover=self.leftover,
            not_identifiable=(),
            rejected=(),
            extended=Extended(self.rms_n, False),
            base=plant,
            plant=self.plant,
        )


class Scene:
    """A gateway that works, its ring, and a watch with a stub behind it."""

    def __init__(self, descriptor: int) -> None:
        self.wired = Wired(seed=3)
        self.ring, self.reader = SampleRing(descriptor, COLUMNS), RingReader(descriptor)
        self.wired.loop.ring = self.ring
        plant = self.wired.rig.plant
        assert plant is not None
        self.plant = with_value(plant, "regulator", "delay_s", plant.regulator.delay_s + WIRE_S)
        self.search = StubDiagnosis(self.plant)
        setup = WatchSettings(window_s=WINDOW_S, every_s=EVERY_S)
        self.reference = WatchReference(plant)
        comparison = PlantComparison(self.reference, self.search, 0.25)
        self.watch = Watch(self.reader, comparison, setup, lambda: self.wired.now_s)
        self._rng = np.random.default_rng(3)
        self.wired.ready()

    def close(self) -> None:
        self.ring.close()
        self.reader.close()

    def work(self, duration_s: float) -> "Scene":
        """Random setpoints, two a second."""
        for _ in range(round(duration_s / SETPOINT_S)):
            self.wired.write(0, ENABLE, int(self._rng.integers(400, 4000)))
            self.wired.run(SETPOINT_S)
        return self

    def change(self, **values: float) -> None:
        """The machine changes, and the search will say so."""
        paths = {name.replace("__", "."): value for name, value in values.items()}
        self.wired.world.fault({"do": "fault", "name": "plant", "values": paths})
        plant = self.plant
        for path, value in paths.items():
            plant = with_value(plant, *path.split("."), value)
        self.search.plant = plant

    def looks(self, count: int) -> list[ResidualCause]:
        causes = []
        for _ in range(count):
            self.work(EVERY_S)
            self.watch.check_newest_window()
            causes.append(self.watch.published.cause)
        return causes


@pytest.fixture
def scene() -> Iterator[Scene]:
    descriptor = os.memfd_create("ring")
    scene = Scene(descriptor)
    yield scene
    scene.close()
    os.close(descriptor)


def test_a_healthy_machine_is_searched_once_and_then_only_looked_at(scene):
    scene.work(FIRST_WINDOW_S)
    assert scene.looks(4) == [ResidualCause.NONE] * 4
    assert scene.search.requests == 1
    assert scene.watch.counters["rms_n"] < 0.3


def test_what_the_wire_adds_is_taken_into_the_reference_and_nothing_more(scene):
    scene.search.plant = with_value(scene.plant, "friction", "coulomb_n", 1.1)
    scene.work(FIRST_WINDOW_S)
    scene.looks(1)
    reference = scene.reference.plant
    assert reference.regulator.delay_s == pytest.approx(scene.plant.regulator.delay_s)
    assert reference.friction.coulomb_n == scene.plant.friction.coulomb_n
    assert reference.cell.noise_n == 0.0


def test_a_hose_that_is_longer_than_a_wire_can_be_is_a_finding_from_the_start(scene):
    delay = Estimate("regulator", 0.2, "s", (0.19, 0.21))
    scene.change(regulator__delay_s=0.2)
    scene.search.causes = (
        Cause("transport-delay", ("transport-delay", "clock-offset"), 0.9, {"delay_s": delay}, GAIN),
    )
    scene.work(FIRST_WINDOW_S)
    assert scene.looks(2)[-1] is ResidualCause.TRANSPORT_DELAY
    assert "cannot tell it from clock-offset" in scene.watch.published.sentence


def test_more_friction_raises_the_warning_by_its_name_and_its_end_clears_it(scene):
    scene.work(FIRST_WINDOW_S)
    scene.looks(2)
    scene.change(friction__coulomb_n=3.0)
    result = scene.looks(5)
    assert result[0] is ResidualCause.NONE, "one window is not enough"
    assert result[-1] is ResidualCause.COULOMB_FRICTION
    assert "coulomb_n 1 -> 3 N" in scene.watch.published.sentence
    scene.wired.fault("plant", on=False)
    scene.search.plant = scene.plant
    scene.work(WINDOW_S + EVERY_S)
    assert scene.looks(2)[-1] is ResidualCause.NONE


@pytest.mark.long
def test_a_standing_cause_is_searched_for_less_and_less(scene):
    scene.work(FIRST_WINDOW_S)
    scene.looks(1)
    scene.change(friction__coulomb_n=3.0)
    scene.looks(4)
    requests = scene.search.requests
    scene.looks(6)
    assert scene.search.requests - requests <= 2


@pytest.mark.long
def test_a_change_that_hardly_moves_the_force_disturbs_nobody(scene):
    scene.work(FIRST_WINDOW_S)
    scene.looks(1)
    scene.reference.floors_n.clear()  # so that every look searches
    scene.search.plant = with_value(scene.plant, "friction", "coulomb_n", 1.05)
    assert scene.looks(3) == [ResidualCause.NONE] * 3


@pytest.mark.long
def test_a_name_for_a_force_that_is_where_it_should_be_disturbs_nobody(scene):
    """The demo, clean, raised A345 for a refit that changed two numbers against each other and the force not at all."""
    scene.work(FIRST_WINDOW_S)
    scene.looks(1)
    scene.reference.floors_n.clear()
    worn = with_value(with_value(scene.plant, "friction", "coulomb_n", 2.0), "cylinder", "area_m2", 9.8e-5)
    scene.search.plant = with_value(worn, "cell", "warm_up_n", 3.0)
    size = Estimate("cell", 3.0, "N", (2.0, 4.0))
    scene.search.causes = (Cause("warm-up", ("warm-up",), 0.9, {"warm_up_n": size}, GAIN),)
    assert scene.looks(3) == [ResidualCause.NONE] * 3
    assert scene.search.requests >= 2


def test_what_no_effect_explains_is_an_unknown_cause(scene):
    scene.work(FIRST_WINDOW_S)
    scene.looks(1)
    scene.change(regulator__hysteresis_pa=3.0e4)
    scene.search.plant = scene.plant
    scene.search.leftover = (Leftover("time", "jumps", 0.8),)
    assert scene.looks(4)[-1] is ResidualCause.UNKNOWN
    assert "jumps, depending on time" in scene.watch.published.sentence


def test_an_idle_gateway_is_never_searched(scene):
    scene.wired.run(2.0 * WINDOW_S)
    scene.watch.check_newest_window()
    assert scene.watch.why_skipped == "nothing was commanded"
    assert scene.search.requests == 0


def test_the_first_window_must_have_seen_something(scene):
    scene.wired.write(0, ENABLE, 1200)
    scene.wired.run(2.0 * WINDOW_S)
    scene.watch.check_newest_window()
    assert "too little" in scene.watch.why_skipped
    assert scene.search.requests == 0


@pytest.mark.long
def test_a_gain_has_no_name_in_the_catalogue_but_is_told(scene):
    scene.work(FIRST_WINDOW_S)
    scene.looks(1)
    area_m2 = scene.plant.cylinder.area_m2
    scene.change(cylinder__area_m2=1.15 * area_m2)
    assert scene.looks(6)[-1] is ResidualCause.UNKNOWN
    assert "gain, area_m2 9.5e-05 -> 0.0001092 m2" in scene.watch.published.sentence


def test_a_cell_whose_sign_turned_is_told_as_such(scene):
    """By the engine itself: it looks for no cause in such a window, so that this is fast."""
    scene.work(FIRST_WINDOW_S)
    scene.looks(1)
    window = scene.watch._window(WINDOW_S)
    turned = replace(window.measurement, force_n=-window.measurement.force_n)
    result = diagnose_window([turned], scene.plant)
    sentence = judge_window(replace(window, measurement=turned), result, scene.reference, 0.25).sentence
    assert "E522" in sentence
    assert "falls where it should rise" in sentence
