"""Laws of friction, pad and slide."""

import numpy as np
import pytest

from gateway.twin import Contact, Cylinder, Friction, Plant, Regulator, Twin
from gateway.twin.experiment import Floats
from gateway.twin.friction import age_stiction
from gateway.twin.slide import SlideState, advance_slide, slide_of
from tests.twin.traces import trace

NEWTON_PER_VOLT = 9.0


def forces(plant: Plant, voltages_v: Floats | list[float], each_s: float = 0.02) -> Floats:
    """Force at the end of each held voltage."""
    twin, found = Twin(plant, 1), []
    for voltage_v in voltages_v:
        twin.command(float(voltage_v))
        twin.advance(each_s)
        found.append(float(twin.force_n))
    return np.array(found)


def loop_v(top_v: float = 8.0, stairs: int = 80) -> Floats:
    return np.concatenate([np.linspace(0.0, top_v, stairs + 1), np.linspace(top_v, 0.0, stairs + 1)])


def test_rigid_coulomb_friction_is_a_loop_of_twice_its_size() -> None:
    plant = Plant(friction=Friction(coulomb_n=2.0))
    rising, falling = np.split(forces(plant, loop_v()), 2)
    middle = slice(20, 60)
    thrust = NEWTON_PER_VOLT * np.linspace(0.0, 8.0, 81)
    np.testing.assert_allclose(rising[middle], thrust[middle] - 2.0, atol=1.0e-3)
    np.testing.assert_allclose(falling[::-1][middle], thrust[middle] + 2.0, atol=1.0e-3)


def test_stiction_holds_until_the_thrust_exceeds_it() -> None:
    found = forces(Plant(friction=Friction(coulomb_n=2.0)), [0.1, 0.2, 0.3, 0.2, 0.1])
    np.testing.assert_allclose(found, [0.0, 0.0, 0.7, 0.7, 0.7], atol=1.0e-3)


@pytest.mark.parametrize("presliding_m", [0.0, 5.0e-5, 3.0e-4])
def test_the_falling_branch_lies_above_the_rising_one(presliding_m: float) -> None:
    """Friction pushes back while the force rises and holds on while it falls: the loop runs counter-clockwise."""
    plant = Plant(friction=Friction(coulomb_n=1.0, load_dependent_n_per_n=0.03, presliding_m=presliding_m))
    voltages_v = np.tile(loop_v(), 2)
    found = forces(plant, voltages_v)[162:]
    rising, falling = found[:81], found[81:][::-1]
    assert np.all(falling - rising >= -1.0e-9)
    assert np.trapezoid(found, voltages_v[162:]) < 0.0
    assert np.all(np.diff(rising) > -1.0e-9)
    assert np.all(np.diff(falling) > -1.0e-9)


@pytest.mark.parametrize("presliding_m", [0.0, 2.5e-4])
def test_a_minor_loop_stays_inside_the_major_loop(presliding_m: float) -> None:
    plant = Plant(friction=Friction(coulomb_n=2.0, presliding_m=presliding_m))
    major = forces(plant, np.concatenate([loop_v(), loop_v()]))[162:]
    stairs = np.linspace(0.0, 8.0, 81)
    minor_v = np.concatenate(
        [loop_v(), np.arange(0, 60), np.arange(60, 30, -1), np.arange(30, 50), np.arange(50, 20, -1)]
    )
    minor_v[162:] *= 0.1
    minor = forces(plant, minor_v)[162:]
    low = np.interp(minor_v[162:], stairs, major[:81])
    high = np.interp(minor_v[162:], stairs, major[81:][::-1])
    assert np.all(minor >= low - 1.0e-3)
    assert np.all(minor <= high + 1.0e-3)


def test_the_slide_remembers_its_return_points() -> None:
    """A closed inner loop leaves no trace: after it, the force is the one the outer path would have had."""
    plant = Plant(friction=Friction(coulomb_n=2.0, presliding_m=3.0e-4))
    out = [1.0, 2.0, 3.0, 4.0, 5.0]
    plain = forces(plant, [*out, 4.0, 3.5, 6.0])
    looped = forces(plant, [*out, 4.0, 3.5, 4.2, 4.4, 3.8, 3.5, 6.0])
    assert looped[-2] == pytest.approx(plain[-2], abs=1.0e-9)
    assert looped[-1] == pytest.approx(plain[-1], abs=1.0e-9)


def test_friction_opposes_the_motion_and_takes_energy() -> None:
    plant = Plant(
        regulator=Regulator(lag_s=0.03),
        friction=Friction(coulomb_n=2.0, stribeck_n=1.0, viscous_n_s_per_m=20.0),
        contact=Contact(mass_kg=0.6, pad_damping_n_s_per_m=40.0),
    )
    twin, rows = Twin(plant, 1), []
    for voltage_v in (5.0, 2.0, 7.0, 0.0):
        twin.command(voltage_v)
        rows.append(trace(twin, 0.3, lambda running: (running.speed_m_per_s, running.friction_n)))
    speed, friction = np.concatenate(rows).T
    moving = np.abs(speed) > 1.0e-4
    np.testing.assert_array_equal(np.sign(friction[moving]), np.sign(speed[moving]))
    assert np.all(np.cumsum(speed * friction) >= 0.0)
    assert moving.mean() > 0.2


def test_the_pad_never_pulls() -> None:
    plant = Plant(friction=Friction(coulomb_n=1.0), contact=Contact(mass_kg=0.6, tilt_deg=150.0, gap_m=1.0e-3))
    twin = Twin(plant, 1)
    for voltage_v in (3.0, 0.0, 1.0, 0.0):
        twin.command(voltage_v)
        assert np.all(trace(twin, 0.3, lambda running: running.force_n) >= 0.0)
    assert twin.position_m == 0.0  # the tool points up: its weight takes it back to the stop


@pytest.mark.parametrize(("tilt_deg", "weight_n"), [(0.0, 5.88399), (60.0, 2.941995), (90.0, 0.0), (180.0, -5.88399)])
def test_the_weight_presses_with_the_cosine_of_the_tilt(tilt_deg: float, weight_n: float) -> None:
    plant = Plant(contact=Contact(mass_kg=0.6, tilt_deg=tilt_deg, pad_damping_n_s_per_m=400.0))
    assert forces(plant, [3.0], 1.0)[0] == pytest.approx(27.0 + weight_n, abs=1.0e-6)


def test_a_gap_is_crossed_before_there_is_force_and_the_impact_is_the_masses() -> None:
    twin = Twin(
        Plant(friction=Friction(viscous_n_s_per_m=50.0), contact=Contact(mass_kg=0.6, gap_m=0.02, tilt_deg=90.0)), 1
    )
    twin.command(2.0)
    force = trace(twin, 3.0, lambda running: running.force_n)
    touch = int(np.flatnonzero(force)[0])
    assert touch > 50
    assert force.max() > 1.5 * 18.0
    assert force[-1] == pytest.approx(18.0, abs=0.01)


def test_with_the_workpiece_gone_the_slide_runs_to_its_end_and_pressing_resumes_when_it_is_back() -> None:
    plant = Plant(cylinder=Cylinder(stroke_m=0.03), friction=Friction(coulomb_n=1.0, viscous_n_s_per_m=50.0))
    twin = Twin(plant, 1)
    twin.command(3.0)
    twin.advance(0.5)
    twin.set_contact(False)
    twin.advance(1.0)
    assert (twin.force_n, twin.position_m) == (0.0, 0.03)
    twin.set_contact(True)
    assert trace(twin, 0.5, lambda running: running.force_n).max() <= 27.0
    assert twin.force_n == pytest.approx(26.0, abs=0.01)


def test_the_end_stop_takes_the_thrust_from_the_pad() -> None:
    plant = Plant(cylinder=Cylinder(stroke_m=4.0e-4))  # the pad is 16.4 N strong there
    np.testing.assert_allclose(forces(plant, [1.0, 5.0, 1.0]), [9.0, 16.4, 9.0], atol=1.0e-9)


@pytest.mark.parametrize("presliding_m", [0.0, 3.0e-4])
def test_a_machine_that_has_worked_begins_as_a_stroke_and_its_vent_leave_it(presliding_m: float) -> None:
    """Friction keeps the pad pressed by its whole limit, in time and noise nothing has passed."""
    plant = Plant(friction=Friction(coulomb_n=2.0, load_dependent_n_per_n=0.03, presliding_m=presliding_m))
    worked, stroke = Twin(plant, 1), Twin(plant, 1)
    worked.press_and_vent()
    for voltage_v in [*loop_v(5.0, 50), 0.0]:
        stroke.command(float(voltage_v))
        stroke.advance(0.02)
    assert (worked.force_n, worked.time_s) == (pytest.approx(2.0, abs=0.01), 0.0)
    assert worked.force_n == pytest.approx(float(stroke.force_n), abs=0.01)
    for twin in (worked, stroke):
        twin.command(0.5)
        twin.advance(0.5)
    assert float(worked.force_n) == pytest.approx(float(stroke.force_n), abs=0.01)


def test_a_pad_above_the_workpiece_has_nothing_to_keep() -> None:
    plant = Plant(friction=Friction(coulomb_n=2.0), contact=Contact(gap_m=0.002))
    twin = Twin(plant, 1)
    twin.press_and_vent()
    assert (twin.force_n, twin.position_m) == (0.0, 0.0)


def test_a_motion_takes_away_what_its_own_step_has_rested_too() -> None:
    assert age_stiction(0.0, 2.0, 1.0e9, 0.0) == (2.0, 2.0)
    assert age_stiction(1.0, 2.0, 1.0e9, 1.0e3) == (1.0, 0.0)
    assert age_stiction(1.0, 2.0, 0.0, 1.0) == (0.0, pytest.approx(np.exp(-1.0)))


def test_what_drags_more_on_its_way_out_drags_less_on_its_way_back() -> None:
    friction = Friction(viscous_n_s_per_m=50.0, asymmetry_n_s_per_m=30.0)
    slide = slide_of(Plant(friction=friction, cylinder=Cylinder(stroke_m=1.0), contact=Contact(gap_m=0.9)))
    state = SlideState(position_m=0.4)
    for outside_n, speed_m_per_s in ((8.0, 8.0 / 80.0), (-8.0, -8.0 / 20.0)):
        for _ in range(50):
            state = advance_slide(slide, state, (0.0, 0.0, 0.0, outside_n), 1.0e-3, 1.0e-3)
        assert state.travel_m / 1.0e-3 == pytest.approx(speed_m_per_s, rel=1.0e-3)
