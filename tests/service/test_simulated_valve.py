"""The simulated rig's valve: the relay answers, the valve moves a moment later, and then the slide pulls, weaker by the rod."""

from collections.abc import Callable
from dataclasses import replace
from math import exp

import pytest

from gateway.devices import ValveDirection, ValveHost
from gateway.profiles import load_rig
from gateway.service.simulation.valve import SimulatedValve
from gateway.service.simulation.world import SimulatedRig
from tests.service.rigs import demo

PUSH, PULL = ValveDirection


class Rig:
    """A simulated rig whose wires take no time. Times are virtual seconds."""

    def __init__(self) -> None:
        rig = load_rig("paper-pull")
        assert rig.valve
        self.simulated = SimulatedRig(rig, send_output=lambda data: None, send_cell=lambda data: None, now_s=0.0)
        self.host = ValveHost(rig.valve.device)
        self.now_s = 0.0

    def run(self, seconds: float) -> "Rig":
        for _ in range(round(100 * seconds)):
            self.now_s += 0.01
            self.simulated.advance(self.now_s)
        return self

    def ask(self, question: ValveDirection | None) -> list[object]:
        return list(self.host.receive(self.simulated.on_valve_bytes(self.host.request(question), self.now_s)))

    @property
    def force_n(self) -> float:
        return self.simulated.valve.sign * float(self.simulated.twin.force_n)


def test_a_pull_is_the_push_by_the_share_of_the_area_and_negative() -> None:
    rig = Rig()
    rig.simulated.twin.command(4.0)
    pushed_n = rig.run(2.0).force_n
    rig.simulated._setting_v = 4.0
    assert rig.ask(PULL) == [PULL] and rig.ask(None) == [PUSH], "the valve takes its time"
    pulled_n = rig.run(2.0).force_n
    assert rig.ask(None) == [PULL]
    assert pushed_n > 20.0 and pulled_n == pytest.approx(-0.75 * pushed_n, rel=0.1)


def test_stuck_it_answers_and_stands_cut_it_is_silent() -> None:
    rig = Rig()
    rig.simulated.fault({"do": "fault", "name": "valve-stuck", "on": True})
    assert rig.ask(PULL) == [PULL]
    assert rig.run(1.0).ask(None) == [PUSH]
    rig.simulated.fault({"do": "fault", "name": "valve-cut", "on": True})
    assert rig.ask(None) == []


def test_what_presses_from_outside_is_against_a_pull() -> None:
    """A weight that helps the push keeps the pull back, and the tool is tilted the other way round."""
    valve, plant = SimulatedValve(load_rig("paper-pull")), demo().plant
    assert plant
    contact = replace(plant.contact, tilt_n=3.0, feed_drag_n=2.0, tilt_deg=30.0)
    plant = replace(plant, contact=contact)
    assert valve.plant_of(plant) == plant
    valve.receive(ValveHost(load_rig("paper-pull").valve.device).request(PULL), 0.0)
    assert valve.move(1.0)
    pulling = valve.plant_of(plant).contact
    assert (pulling.tilt_n, pulling.feed_drag_n, pulling.tilt_deg) == (-3.0, -2.0, 150.0)
    assert valve.sign == -1.0


@pytest.mark.parametrize(
    ("setting", "value", "reads_n"),
    [
        ("sensor-quadratic.quadratic_per_n", 0.01, lambda force_n: force_n + 0.01 * force_n**2),
        ("sensor-cubic.cubic_per_n2", 0.001, lambda force_n: force_n + 0.001 * force_n**3),
        ("valve-crosstalk.crosstalk_n_per_v", 1.0, lambda force_n: force_n + 4.0),
        ("sign-loss.sign_lost", 1.0, abs),
        ("thermal-zero-drift.zero_n_per_k", 0.5, lambda force_n: force_n + 0.5 * 10.0),
    ],
)
def test_a_defect_of_the_cell_is_the_same_whichever_way_the_tool_acts(
    setting: str, value: float, reads_n: Callable[[float], float]
) -> None:
    """A zero that had drifted by 5 N was -5 N as soon as the tool pulled, and a pull without its sign a pull all the same."""
    rig = Rig()
    settings = {setting: value, "cell.noise": 0.0, "around.temperature_c": 30.0}
    rig.simulated.simulate({"do": "sim", "set": settings})
    rig.simulated._setting_v = 4.0
    rig.ask(PULL)
    rig.run(2.0).simulated.stream(rig.now_s)
    assert rig.force_n < -15.0
    assert rig.simulated._shown_n == pytest.approx(reads_n(rig.force_n), abs=0.1)


def test_the_time_of_the_cell_goes_on_when_the_valve_moves() -> None:
    """A drift of 4 N was gone, and a warm-up began anew, with each turn of the valve."""
    rig = Rig()
    drifts = {"linear-drift.drift_n_per_s": 0.5, "cell.noise": 0.0, "warm-up.warm_up_n": 3.0, "warm-up.warm_up_s": 2.0}
    rig.simulated.simulate({"do": "sim", "set": drifts})
    rig.run(8.0).ask(PULL)
    rig.run(2.0).simulated.stream(rig.now_s)
    assert rig.simulated._shown_n == pytest.approx(5.0 + 3.0 * exp(-5.0), abs=0.1)
    rig.ask(PUSH)
    rig.run(2.0).simulated.stream(rig.now_s)
    assert rig.simulated._shown_n == pytest.approx(6.0 + 3.0 * exp(-6.0), abs=0.1)


def test_a_clock_that_is_late_is_late_behind_a_turn_of_the_valve_too() -> None:
    shown_n = {}
    for offset_s in (0.0, 0.5):
        rig = Rig()
        rig.simulated.simulate({"do": "sim", "set": {"clock-offset.clock_offset_s": offset_s, "cell.noise": 0.0}})
        rig.run(3.0).ask(PULL)
        rig.run(1.0).simulated._setting_v = 4.0
        rig.simulated.twin.command(4.0)
        for _ in range(40):
            rig.run(0.05).simulated.stream(rig.now_s)
            shown_n.setdefault(offset_s, []).append(rig.simulated._shown_n)
    assert shown_n[0.0][-1] < -15.0
    assert shown_n[0.5][10:] == pytest.approx(shown_n[0.0][:-10], abs=0.2)
