"""The model's two branches as points to draw: voltage against force, rising and falling, of the calibration in use, with the
volts as they are sent: where a plant is in use whose command map is bent, the branches are bent with it."""

from pathlib import Path
from typing import Any, Final

from gateway.calibrations.store import calibration_in_use
from gateway.plants.in_use import with_selected_plant
from gateway.profiles import Rig

_POINTS: Final = 81


def model_curves(rig: Rig, state: Path) -> dict[str, Any]:
    """Return {"number", "name", "voltage_v", "rising_n", "falling_n", "force_range_n"} of the calibration in use."""
    calibration = calibration_in_use(rig, state)
    rig, _ = with_selected_plant(rig, state)
    model = rig.model_of(calibration, calibration.model())
    low_v, high_v = model.voltage_range_v
    voltages = [low_v + (high_v - low_v) * place / (_POINTS - 1) for place in range(_POINTS)]
    branches = [model.branch_forces_n(voltage) for voltage in voltages]
    return {
        "number": calibration.number,
        "name": calibration.name,
        "voltage_v": voltages,
        "rising_n": [rising for rising, _ in branches],
        "falling_n": [falling for _, falling in branches],
        "force_range_n": list(model.force_range_n),
    }
