"""Pairs that a recording of its kind cannot separate come out as a group, with what to record next."""

from collections.abc import Mapping

import numpy as np
import pytest

from gateway.catalogue.all_effects import BY_NAME
from gateway.diagnosis import diagnose
from tests.diagnosis.machine import NOISE_N, Floats, measurement, plant, readings_n, times_s

TIME_S = times_s(60.0, 100.0)
STAIRS = np.round(2.0 * np.interp(TIME_S, [0.0, 0.5, 30.0, 59.5], [0.0, 0.0, 5.5, 0.0])) / 2.0
HELD = np.where(TIME_S < 0.5, 0.0, 4.0)
ALIKE = [
    ("end-stop", "supply-saturation", {"cylinder.stroke_m": 1.0e-3}, STAIRS),
    ("supply-saturation", "end-stop", {"regulator.supply_pa": 4.7e5}, STAIRS),
    ("leak", "warm-up", {"regulator.leak_per_s": 2.0e-3}, HELD),
]


def noisy(changes: Mapping[str, float], volts: Floats) -> Floats:
    force_n = readings_n(plant(changes), TIME_S, volts, {})
    return np.asarray(force_n + np.random.default_rng(1).normal(0.0, NOISE_N, TIME_S.size))


@pytest.mark.long
@pytest.mark.parametrize(("true", "other", "changes", "volts"), ALIKE, ids=[each[0] for each in ALIKE])
def test_a_recording_that_cannot_separate_a_pair_names_both(
    true: str, other: str, changes: Mapping[str, float], volts: Floats
) -> None:
    found = diagnose([measurement(TIME_S, volts, noisy(changes, volts), {})])
    assert found.causes, found.leftover
    assert {true, other} <= {found.causes[0].name, *found.causes[0].group}
    assert {BY_NAME[true].experiment, BY_NAME[other].experiment} <= set(found.experiments)
