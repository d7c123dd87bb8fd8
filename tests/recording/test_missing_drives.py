"""Of what drives the force something is missing: what stands in its place is told."""

import numpy as np
import pytest

from tests.recording.test_measurement_of import TIME_S, N, measured, noted


def test_a_command_without_a_value_leaves_the_pressure_to_drive_and_is_told() -> None:
    found = measured(command_v=np.full(N, np.nan), pressure_kpa=100.0 + TIME_S)
    assert found.command_v is None and found.pressure_pa is not None and found.usable.all()
    assert noted(found, "command_v holds no value")


@pytest.mark.parametrize("missing", [0, 2])
def test_a_pressure_with_holes_is_drawn_straight_and_told_with_their_number(missing: int) -> None:
    pressure_kpa = 100.0 + TIME_S
    pressure_kpa[5 : 5 + missing] = np.nan
    found = measured(pressure_kpa=pressure_kpa)
    np.testing.assert_allclose(found.pressure_pa, 1e3 * (100.0 + TIME_S))
    assert noted(found, "pressure_kpa is missing in 2 rows") is bool(missing)
    assert bool(found.notes) is bool(missing)
