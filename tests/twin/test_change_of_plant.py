"""A plant that changes while the twin moves: what moves goes on from where it is."""

from copy import deepcopy
from dataclasses import replace
from functools import cache

import pytest

from gateway.service.simulation.demonstration import DEMONSTRATIONS
from gateway.service.simulation.settings import SimulationSettings
from gateway.service.socket_requests import SimulationRequest
from gateway.twin import Contact, LoadCell, Plant, Surroundings, Twin
from gateway.twin.contact import ContactState
from gateway.twin.load_cell import LoadCellState
from gateway.twin.plant import with_value
from gateway.twin.surroundings import TwinConditions
from tests.service.rigs import demo

AROUND = Surroundings(
    temperature_c=40.0,
    supply_kpa=500.0,
    spindle_rpm=3000.0,
    feed_mm_s=20.0,
    tilt_deg=40.0,
    position_mm=12.0,
    distance_m=3.0,
)
AT_ONCE = frozenset(
    """command-nonlinearity command-quantisation supply-droop contact-nonlinearity tilt-gravity feed-drag pad-wear
    position-dependence position-ripple spindle-vibration backlash end-stop regulator-hunting regulator-hysteresis
    supply-saturation""".split()
)
"""Effects whose force is another one at once, or within the regulator's lag: that is their physics."""
NOT_AT_REST = frozenset(
    """transport-delay extra-lag slew-limit viscous-friction stribeck-friction dwell-stiction pressure-lag
    coulomb-friction presliding load-dependent-friction asymmetric-friction position-dependent-friction side-load dead-band
    clock-offset clock-skew""".split()
)
"""Effects of motion: a force that stands does not change by them."""


def plant() -> Plant:
    """The demo's, without noise."""
    own = demo().plant
    assert own
    return with_value(own, "cell", "noise_n", 0.0)


def changed(name: str) -> Plant:
    return SimulationSettings().changed(SimulationRequest(set={name: "on"})).plant_of(plant())


def pressing() -> Twin:
    return deepcopy(_pressed())


@cache
def _pressed() -> Twin:
    twin = Twin(plant(), 3)
    twin.set_surroundings(AROUND)
    twin.command(5.0)
    twin.advance(1.5)
    return twin


def readings_of(twin: Twin) -> list[float]:
    """Over steps of the command, small and large, up and down."""
    found = []
    for voltage_v in (5.0, 5.05, 5.3, 3.0, 3.3, 0.0, 4.2):
        twin.command(voltage_v)
        for _ in range(4):
            twin.advance(0.05)
            found.append(twin.read())
    return found


@cache
def readings_without() -> list[float]:
    twin = pressing()
    twin.advance(0.002)
    return readings_of(twin)


def test_the_same_plant_again_changes_nothing() -> None:
    one, other = pressing(), pressing()
    for voltage_v in (5.0, 2.0, 4.0):
        other.change_plant(replace(plant()))
        for twin in (one, other):
            twin.command(voltage_v)
            twin.advance(0.2)
        assert (one.force_n, one.pressure_pa, one.read()) == (other.force_n, other.pressure_pa, other.read())


@pytest.mark.sampled
@pytest.mark.parametrize("name", DEMONSTRATIONS)
def test_an_effect_begins_without_a_jump_and_then_shows(name: str) -> None:
    twin = pressing()
    before_n = twin.force_n
    twin.change_plant(changed(name))
    twin.advance(0.002)
    if name not in AT_ONCE:
        assert twin.force_n == pytest.approx(before_n, abs=0.02)
    largest_n = max(abs(one - other) for one, other in zip(readings_of(twin), readings_without(), strict=True))
    assert largest_n > (1e-4 if name == "clock-skew" else 0.02)


@pytest.mark.parametrize("name", sorted(NOT_AT_REST))
def test_an_effect_of_motion_leaves_a_force_that_stands(name: str) -> None:
    twin = pressing()
    before_n = twin.force_n
    twin.change_plant(changed(name))
    twin.advance(0.5)
    assert twin.force_n == pytest.approx(before_n, abs=0.05)


def test_a_drift_begins_when_it_is_set() -> None:
    twin = pressing()
    before_n = twin.read()
    twin.change_plant(changed("linear-drift"))
    assert twin.read() == pytest.approx(before_n, abs=1e-3)
    twin.advance(2.0)
    assert twin.read() - before_n == pytest.approx(0.03, abs=0.01)


def test_a_shorter_delay_lets_nothing_old_arrive_after_what_is_new() -> None:
    slow = with_value(plant(), "regulator", "delay_s", 0.5)
    twin = Twin(slow, 3)
    twin.command(8.0)
    twin.advance(0.1)
    twin.change_plant(with_value(slow, "regulator", "delay_s", 0.0))
    twin.command(2.0)
    twin.advance(2.0)
    direct = Twin(with_value(slow, "regulator", "delay_s", 0.0), 3)
    direct.command(2.0)
    direct.advance(2.0)
    assert twin.pressure_pa == pytest.approx(direct.pressure_pa, rel=0.01)


@pytest.mark.parametrize("name", ["drift_n_per_s", "warm_up_n"])
def test_a_drift_and_a_warm_up_go_on_where_something_else_is_changed(name: str) -> None:
    drifting = with_value(plant(), "cell", name, 2.0)
    courses = []
    for others in ((), ("hardening", "creep_share")):
        twin = Twin(drifting, 3)
        twin.advance(3.0)
        for other in others:
            twin.change_plant(with_value(drifting, "contact", other, 0.2))
        twin.advance(1.0)
        courses.append(twin.read())
    assert courses[1] == pytest.approx(courses[0], abs=1e-9) and abs(courses[0]) > 0.1


def test_a_machine_that_has_worked_before_stands_still() -> None:
    twin = Twin(plant(), 3)
    twin.press_and_vent()
    assert twin.speed_m_per_s == 0.0 and twin.force_n > 0.0
    before_n = twin.force_n
    twin.advance(0.1)
    assert twin.force_n == pytest.approx(before_n, abs=1e-3)


def test_a_filter_and_a_play_begin_at_the_force_that_stands() -> None:
    """One that began at 0 N would have pulled a reading of 10 N down, and a force by half of the play."""
    cell = LoadCellState(LoadCell(), 0.001)
    cell.step(10.0)
    cell.change_cell(LoadCell(filter_s=0.05), begins=False)
    cell.step(10.0)
    assert cell.filtered_n == pytest.approx(10.0)
    contact = ContactState(Contact(), 0.001, TwinConditions())
    contact.change_contact(Contact(backlash_n=1.0, creep_share=0.1), 10.0)
    assert contact.step(10.0) == pytest.approx(10.0, abs=1e-3), "nothing has crept yet"
    assert contact.step(9.5) == pytest.approx(10.0, abs=1e-3)
    assert contact.step(9.0) == pytest.approx(9.5, abs=1e-3)
