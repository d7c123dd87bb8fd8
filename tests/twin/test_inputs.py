"""What reaches the slide from outside: the workpiece's surface and a disturbing force. Null by default."""

import math

import pytest

from gateway.twin import Contact, Cylinder, Friction, Plant, Regulator, Twin
from gateway.twin.plant import with_value

STIFFNESS_N_PER_M = 4.0e4
RICH = Plant(
    regulator=Regulator(lag_s=0.02),
    cylinder=Cylinder(stroke_m=0.03),
    friction=Friction(coulomb_n=1.0, viscous_n_s_per_m=50.0, presliding_m=2.0e-4),
    contact=Contact(pad_damping_n_s_per_m=40.0, gap_m=2.0e-3, mass_kg=0.6, tilt_deg=70.0),
)


def pressed(plant: Plant, volts: float = 3.0) -> Twin:
    twin = Twin(plant, 1)
    twin.command(volts)
    twin.advance(1.0)
    return twin


def test_null_inputs_change_nothing() -> None:
    plain, told = Twin(RICH, 1), Twin(RICH, 1)
    for volts in (3.0, 5.0, 1.0):
        plain.command(volts)
        told.command(volts)
        for _ in range(40):
            told.set_surface(0.0)
            told.set_disturbance(0.0)
            told.advance(0.005)
            plain.advance(0.005)
            assert told.force_n == plain.force_n


def test_a_frictionless_slide_follows_the_surface_and_keeps_its_force() -> None:
    twin = pressed(Plant(contact=Contact(gap_m=1.0e-3)))
    force_n, position_m = twin.force_n, twin.position_m
    twin.set_surface(2.0e-4)
    twin.advance(0.05)
    assert twin.force_n == pytest.approx(force_n)
    assert twin.position_m == pytest.approx(position_m - 2.0e-4)


def test_a_slide_that_friction_holds_feels_stiffness_times_height_up_to_its_friction() -> None:
    plant = Plant(
        friction=Friction(coulomb_n=2.0), contact=Contact(pad_stiffness_n_per_m=STIFFNESS_N_PER_M, gap_m=1.0e-3)
    )
    for height_m, rise_n in ((5.0e-5, 2.0), (1.0e-3, 4.0)):  # 27 N - 2 N held forward, at most 27 N + 2 N backward
        twin = pressed(plant)
        before_n = twin.force_n
        twin.set_surface(height_m)
        twin.advance(0.05)
        assert twin.force_n - before_n == pytest.approx(rise_n, abs=0.01)


def test_a_falling_surface_ends_contact_and_a_disturbance_adds_like_any_force() -> None:
    twin = pressed(Plant(cylinder=Cylinder(stroke_m=0.002), contact=Contact(gap_m=1.0e-3)))
    twin.set_disturbance(-5.0)
    twin.advance(0.05)
    assert twin.force_n == pytest.approx(27.0 - 5.0)
    twin.set_surface(-5.0e-3)
    twin.advance(0.5)
    assert twin.force_n == 0.0
    assert twin.position_m == 0.002


def test_a_surface_behind_the_back_stop_presses_the_pad_not_the_slide_through_the_stop() -> None:
    twin = Twin(Plant(contact=Contact(pad_stiffness_n_per_m=STIFFNESS_N_PER_M)), 1)
    twin.set_surface(1.0e-4)
    twin.advance(0.1)
    assert twin.position_m == 0.0
    assert twin.force_n == pytest.approx(4.0)


def test_reset_takes_the_inputs_back() -> None:
    twin = Twin(with_value(RICH, "contact", "gap_m", 0.0), 1)
    twin.set_surface(1.0e-3)
    twin.set_disturbance(9.0)
    twin.advance(0.1)
    assert twin.force_n > 0.0
    twin.reset()
    twin.set_contact(True)
    assert twin.position_m == 0.0
    twin.advance(0.1)
    assert twin.force_n < 5.0


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_inputs_that_are_not_finite_are_refused(value: float) -> None:
    twin = Twin(RICH, 1)
    with pytest.raises(ValueError, match="not finite"):
        twin.set_surface(value)
    with pytest.raises(ValueError, match="not finite"):
        twin.set_disturbance(value)
