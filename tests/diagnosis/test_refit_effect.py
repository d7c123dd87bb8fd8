"""What the refit of the base model has changed in the rig's plant: by how much it was off as it stood, and by which number."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.diagnosis import Diagnosis, Options, diagnose
from gateway.diagnosis.model_fit.refit_effect import _errors_n
from gateway.diagnosis.result import Refit
from gateway.reports.diagnosis.document import diagnosis_document
from gateway.twin.plant import Plant
from tests.diagnosis.machine import MACHINE, NOISE_N, recorded, times_s

OWN = Options(is_own=True)


def refit_of(changes: Mapping[str, float], given: Plant = MACHINE) -> Refit:
    found: Diagnosis = diagnose([recorded(changes, time_s=times_s(30.0))], given, OWN)
    assert found.refit is not None
    return found.refit


@pytest.mark.parametrize(
    ("path", "value"), [("friction.coulomb_n", 3.1), ("cylinder.area_m2", 97.0e-6), ("regulator.lag_s", 0.12)]
)
def test_the_number_that_has_changed_makes_the_error(path: str, value: float) -> None:
    """A stiff seal was `No effect is missing`: 1.5 N were hidden by the refit."""
    refit = refit_of({path: value})
    before = {f"{each.section}.{each.name}": each for each in refit.numbers}
    changed = before.pop(path)
    assert changed.value == pytest.approx(value, rel=0.05)
    assert changed.before == getattr(getattr(MACHINE, changed.section), changed.name)
    assert refit.gain_n == pytest.approx(changed.costs_n, rel=0.3)
    assert refit.gain_n > 2.0 * NOISE_N > 4.0 * max(each.costs_n for each in before.values())
    assert refit.as_given_rms_n**2 == pytest.approx(refit.gain_n**2 + NOISE_N**2, rel=0.1)


def test_a_machine_that_is_as_its_plant_says_is_not_off() -> None:
    refit = refit_of({})
    assert refit.gain_n < 0.3 * NOISE_N
    assert refit.as_given_rms_n == pytest.approx(NOISE_N, rel=0.1)


def test_another_zero_of_the_cell_is_no_error_of_the_plant() -> None:
    """A tare is taken at each start: it stands in no plant."""
    assert refit_of({"cell.zero_n": 5.0}).gain_n < 0.3 * NOISE_N


def test_of_a_plant_that_was_changed_before_nothing_is_told() -> None:
    measurement = recorded({"friction.coulomb_n": 3.1}, time_s=times_s(30.0))
    assert diagnose([measurement], MACHINE, Options(is_own=True, without="coulomb-friction")).refit is None
    answer = diagnose([measurement], MACHINE)
    assert answer.refit is not None and not answer.refit.is_own
    assert "refit" not in diagnosis_document(answer, 1.0)


def test_an_offset_of_a_recording_is_no_error_of_the_plant() -> None:
    """Each has one of its own, which a tare would take away."""
    parts = (slice(0, 40), slice(40, 100))
    wave_n = 0.3 * np.sin(np.arange(100.0))
    measured_n = wave_n + np.where(np.arange(100) < 40, 5.0, -2.0)
    judged = np.arange(100) % 7 != 0
    bench: Any = SimpleNamespace(
        measured_n=measured_n, judged=judged, channels=[SimpleNamespace(rows=rows) for rows in parts],
        simulate=lambda models: np.zeros((len(models), 100)),
        rms_n=lambda residual_n: float(np.sqrt(np.mean(residual_n[judged] ** 2))),
    )  # fmt: skip
    assert _errors_n(bench, [None]) == pytest.approx([0.3 / np.sqrt(2.0)], rel=0.1)  # type: ignore[list-item]
