"""A payload that hangs on the load cell in the air, and is carried by the workpiece in contact, is no fault of any item; nor is
a force that the plant in use knows of tilt and feed."""

from math import cos, radians

import pytest

from gateway.control.compensation.compensation import Compensation, OutsideForce
from gateway.control.self_test.items import Item
from gateway.registers.words import SelfTestResult, SelfTestVerdict
from gateway.units import STANDARD_GRAVITY_M_PER_S2
from tests.control.self_test.rig import SelfTestRig, verdict_on

FORCE_N = 34.0
_TOUCHES_N = 0.8  # of thrust, from which on the tool stands on the workpiece


def hanging(payload_kg: float, tilt_deg: float = 0.0, off_n: float = 0.0, unit: float = 1.0) -> SelfTestRig:
    """The cell feels the thrust in contact, in the air the weight; off_n: that its zero is off by."""
    hangs_n = -payload_kg * STANDARD_GRAVITY_M_PER_S2 * cos(radians(tilt_deg))
    rig = SelfTestRig(5, FORCE_N)
    rig.reading = lambda force_n: unit * ((max(force_n, hangs_n) if force_n > _TOUCHES_N else hangs_n) + off_n)
    told = {"payload_kg": payload_kg, "tilt_angle_rad": radians(tilt_deg)}
    rig.command = rig.command._replace(number=rig.command.number + 1, peer="m", **told)
    rig.run(0.5)
    return rig


@pytest.mark.sampled
@pytest.mark.parametrize("payload_kg", [0.3, 1.0, 2.0])
@pytest.mark.parametrize("tilt_deg", [0.0, 60.0, 90.0, 110.0])
def test_a_healthy_machine_passes_with_it_in_the_air(payload_kg: float, tilt_deg: float) -> None:
    """0.3 kg were a zero that is off, told to be tared; of 1 kg the way down was half a force, and a scale that is wrong."""
    rig = hanging(payload_kg, tilt_deg)
    report = rig.tested()
    assert report.result is SelfTestResult.PASSED, report.sentences
    assert rig.peak_n < FORCE_N


@pytest.mark.parametrize(("tilt_deg", "off_n"), [(0.0, -3.0), (180.0, 8.0)])
def test_a_zero_that_is_off_by_more_is_found_all_the_same(tilt_deg: float, off_n: float) -> None:
    report = hanging(0.3, tilt_deg, off_n).tested()
    assert verdict_on(report, Item.ZERO) is SelfTestVerdict.FAILED
    (said,) = (one for one in report.sentences if "self-test zero failed" in one)
    assert "and the payload's 2.9 N" in said
    assert "tilt and feed" not in said, "its weight is no force from outside"


@pytest.mark.parametrize(("unit", "item"), [(-1.0, Item.SIGN), (4.0, Item.SCALE)])
def test_a_cell_that_is_wrong_is_found_with_it_all_the_same(unit: float, item: Item) -> None:
    rig = hanging(1.0, 90.0, unit=unit)
    assert verdict_on(rig.tested(), item) is SelfTestVerdict.FAILED
    assert rig.peak_n < FORCE_N


def pushed(outside_n: float, shows_n: float) -> SelfTestRig:
    """The plant in use knows that tilt brings outside_n; the cell shows shows_n of it."""
    rig = SelfTestRig(5, FORCE_N)
    control = rig.controller
    known = Compensation(outside=OutsideForce(tilt_n=outside_n))
    control.compensate(control._rig_settings, known, control._calibration)
    rig.reading = lambda force_n: force_n + shows_n
    rig.run(0.5)
    return rig


@pytest.mark.parametrize("shows", [1.0, 0.0], ids=["shows", "was there at the tare"])
@pytest.mark.parametrize("outside_n", [9.0, -9.0])
def test_a_force_that_the_plant_knows_from_outside_is_no_wrong_zero(outside_n: float, shows: float) -> None:
    """`lift the tool and tare` was the answer to what is compensated while it works."""
    report = pushed(outside_n, shows * outside_n).tested()
    assert not [one for one in report.sentences if "self-test zero" in one and "passed" not in one], report.sentences


def test_a_zero_that_is_off_beyond_it_is_found_and_told_with_it() -> None:
    (said,) = (one for one in pushed(9.0, 18.0).tested().sentences if "self-test zero failed" in one)
    assert "and the 9.0 N that tilt and feed bring; lift the tool and tare" in said
