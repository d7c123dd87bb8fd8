"""A payload that hangs on the load cell in the air and is carried by the workpiece in contact is no wrong sign or gain."""

from dataclasses import replace
from math import cos, radians

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices.messages import ForceSample
from gateway.registers.words import ControlBit, State
from gateway.units import STANDARD_GRAVITY_M_PER_S2
from tests.control.bench import Bench, settings


class HangingBench(Bench):
    """Tared in the air and enabled; the cell feels the slide's thrust in contact, in the air the payload's weight."""

    def __init__(self, payload_kg: float, tilt_deg: float, unit: float = 1.0) -> None:
        super().__init__(settings(), seed=1)
        self._payload_kg, self._unit = payload_kg, unit
        self.tilt(tilt_deg)
        self.plant.contact = False
        self.alter_sample = self._with_payload
        self.write(payload_kg=payload_kg)
        self.run(0.3)
        self.write(control_word=ControlBit.TARE)
        self.run(0.1)
        self.enable(0.0)
        self.run(0.3)

    def tilt(self, to_deg: float) -> None:
        self._tilt_rad = radians(to_deg)
        self.write(tilt_angle_rad=self._tilt_rad)

    def _with_payload(self, sample: ForceSample) -> ForceSample:
        hangs_n = -self._payload_kg * STANDARD_GRAVITY_M_PER_S2 * cos(self._tilt_rad)
        return replace(sample, force_n=self._unit * (max(sample.force_n, hangs_n) if self.plant.contact else hangs_n))

    def press(self, force_n: float) -> FaultCode:
        """On the way to the workpiece for a while, then in contact."""
        self.force(force_n)
        self.run(1.5)
        self.plant.contact = True
        self.run(4.0)
        return self.last.fault


@pytest.mark.sampled
@pytest.mark.parametrize("payload_kg", [0.1, 0.2, 1.0, 2.0])
@pytest.mark.parametrize(("from_deg", "to_deg"), [(0.0, 0.0), (0.0, 90.0), (90.0, 0.0), (180.0, 0.0), (180.0, 60.0)])
def test_it_may_come_down_and_be_tilted_before(payload_kg: float, from_deg: float, to_deg: float) -> None:
    """1 kg that came down on the workpiece was A303, kgf and N mixed up; 0.1 kg tilted in the air A302."""
    bench = HangingBench(payload_kg, from_deg)
    bench.tilt(to_deg)
    assert bench.press(25.0) is FaultCode.NONE
    assert bench.last.state is State.HOLDING
    assert bench.last.force_measured_n == pytest.approx(25.0, abs=1.0)


@pytest.mark.sampled
@pytest.mark.parametrize("payload_kg", [0.0, 0.3, 1.0])
@pytest.mark.parametrize(("unit", "faults"), [(-1.0, {"SIGN_INVERTED"}), (9.81, {"GAIN_WRONG", "OVER_FORCE"})])
def test_a_cell_that_is_wrong_is_found_with_it_all_the_same(payload_kg: float, unit: float, faults: set[str]) -> None:
    bench = HangingBench(payload_kg, 90.0, unit)  # where it hangs on nothing, so that a tare takes nothing of it
    bench.press(25.0)
    assert bench.last.fault.name in faults
    assert max(record.force_n for record in bench.history) < 12.0
