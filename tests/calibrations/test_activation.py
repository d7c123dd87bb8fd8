"""Taking a calibration into use: nothing is selected that has no model, and a damaged neighbour hides nobody."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.bsfm import Calibration, CoefficientLimits
from gateway.calibrations.activation import Activation
from gateway.calibrations.store import CalibrationStore
from tests.calibrations.coefficients import calibration


def test_what_makes_no_model_is_not_selected(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next start would come up with it, and without a model."""
    selected = list[Any]()
    store: Any = SimpleNamespace(load=lambda number: calibration(16), use=lambda *chosen: selected.append(chosen))

    def broken(self: Calibration) -> None:
        raise ValueError("no model")

    monkeypatch.setattr(Calibration, "model", broken)
    with pytest.raises(ValueError, match="no model"):
        Activation(store, CoefficientLimits(cell_range_n=100.0)).use(2)
    assert selected == []


def test_a_damaged_calibration_hides_none_that_was_made_of_the_same_data(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    first, second = store.add(calibration(8)), store.add(calibration(16))
    wanted = store.load(second).data_sha256
    path = tmp_path / "calibrations" / f"{first:04d}.yaml"
    path.write_bytes(path.read_bytes()[:-5])
    assert store.find_data("none") is None
    assert store.find_data(wanted) == second
