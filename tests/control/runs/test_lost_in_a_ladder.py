"""What is lost in the midst of a ladder, behind its check, is told at the next stair and not at the fit."""

import pytest

from gateway.registers.words import CalibrationPhase, State
from tests.control.bench import Bench
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
