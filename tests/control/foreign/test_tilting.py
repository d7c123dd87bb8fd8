"""On machines that nobody here has built a tool is tilted under force: friction turns with what the slide has to give."""

from math import cos, radians

import pytest

from gateway.control import CalibrationInUse, Controller, Trim
from gateway.registers.words import ControlBit
from gateway.units import STANDARD_GRAVITY_M_PER_S2
from tests.control.foreign.kept_calibrations import kept
from tests.control.foreign.stand import Stand, settings

HELD_N = 25.0
STEPS = 50  # of a tilt, in a second


def tilted(stand: Stand, to_deg: float) -> float:
    """Tilt, wait, and return by how much the contact force is off."""
    from_rad = stand.command.tilt_angle_rad
    for k in range(1, STEPS + 1):
        stand.write(tilt_angle_rad=from_rad + (radians(to_deg) - from_rad) * k / STEPS)
        stand.run(1.0 / STEPS)
    stand.run(1.0)
    return stand.slide.force_n + STANDARD_GRAVITY_M_PER_S2 * cos(radians(to_deg)) - HELD_N


@pytest.mark.sampled
@pytest.mark.parametrize(("gain", "most_off_n"), [(0.0, 1.0), (0.3, 0.5)], ids=["feedforward alone", "with the trim"])
@pytest.mark.parametrize("seed", [1, 5])
def test_there_and_back_the_contact_force_stays(seed: int, gain: float, most_off_n: float) -> None:
    """It was 5 N too much behind the way back: friction had turned, and nobody reckoned with it."""
    one = kept()[seed]
    model = CalibrationInUse(one.calibration.model(), 1, one.response)
    stand = Stand(one.machine, Controller(settings(Trim(gain_v_per_n_s=gain, limit_v=0.5)), model))
    stand.worked().run(0.5)
    stand.write(control_word=ControlBit.ENABLE, force_setpoint_n=HELD_N, payload_kg=1.0)
    stand.run(3.0)
    off_n = [tilted(stand, to_deg) for to_deg in (120.0, 0.0)]
    assert max(abs(one_n) for one_n in off_n) < most_off_n
