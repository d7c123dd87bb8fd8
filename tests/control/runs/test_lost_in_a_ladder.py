"""What is lost in the midst of a ladder, behind its check, is told at the next stair and not at the fit."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers.words import CalibrationPhase, ControlBit, State
from tests.control.bench import Bench, settings
from tests.control.runs.test_ladder_run import begun, roomy

BEHIND_THE_CHECK_S = 9.0


@pytest.mark.sampled
@pytest.mark.parametrize("lost", ["air", "contact"])
@pytest.mark.parametrize("at_s", [BEHIND_THE_CHECK_S, 14.0, 20.0])
def test_a_ladder_without_air_or_contact_ends_within_seconds(lost: str, at_s: float) -> None:
    """It climbed all the rest, half a minute or an hour, and the air that came back would have pressed at once."""
    bench = begun(Bench(roomy(), seed=16))
    bench.run(at_s)
    phase = bench.last.calibration_phase
    assert phase in (CalibrationPhase.LADDER, CalibrationPhase.MINOR_LOOPS)
    setattr(bench.plant, lost, False)
    bench.seconds_until(lambda output: output.state is State.OFF, 6.0)
    assert bench.last.calibration_phase == CalibrationPhase.STOPPED and bench.last.voltage_v == 0.0
    (told,) = [event for event in bench.events if event.startswith("A301")]
    assert "no air, valve closed or no contact" in told


def test_the_way_to_0_behind_a_run_that_a_master_has_ended_needs_it_no_more() -> None:
    """It would be a fault, and the force would fall at once where the rig has it go along its ramp."""
    bench = Bench(settings(lease_s=0.05), seed=15)
    bench.heartbeat_every_ms = 10
    bench.run(0.5)
    bench.write(control_word=ControlBit.START_CALIBRATION)
    bench.seconds_until(lambda output: output.force_measured_n > 20.0, 12.0)
    bench.heartbeat_every_ms = 0
    bench.write(control_word=ControlBit(0))
    bench.line = bench.line._replace(owner_connected=False)
    assert bench.run(0.08).state is State.CALIBRATING and bench.last.voltage_v > 0.0
    assert (bench.run(0.5).state, bench.last.fault) == (State.OFF, FaultCode.NONE)
    assert bench.events[-1] == "force ramped to 0, output disabled"
