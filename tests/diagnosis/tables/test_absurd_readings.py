"""Readings that no machine gives, which loggers write for no value: they hide no machine, and nothing is named for them."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.diagnosis import Diagnosis, Measurement, Verdict, diagnose
from gateway.diagnosis.model_fit.base_fit import DEFAULT_PLANT
from tests.diagnosis.machine import MACHINE, recorded, times_s

NO_VALUE_N = -9999.0


def spoiled(rows: list[int]) -> Measurement:
    """20 s of a machine without effects, with what stands for no value in some rows."""
    quiet = recorded({}, (), seed=1, time_s=times_s(20.0, 100.0))
    force_n = quiet.force_n.copy()
    force_n[rows] = NO_VALUE_N
    return replace(quiet, force_n=force_n)


def answer(rows: list[int]) -> Diagnosis:
    found = diagnose([spoiled(rows)], DEFAULT_PLANT)
    assert found.base.cylinder.area_m2 == pytest.approx(MACHINE.cylinder.area_m2, rel=0.02)
    assert found.extended.held_out_rms_n < 0.12
    return found


def test_a_single_one_is_set_aside_and_told() -> None:
    found = answer([1400])
    assert (found.verdict, found.causes) == (Verdict.NOTHING_FOUND, ())
    assert not found.traces[0].measurement.usable[1400], "nor in any picture"
    assert any("1 reading stands far apart" in note and "-9999 N at 14.000 s" in note for note in found.notes)


def test_some_are_outliers_and_nothing_else() -> None:
    found = answer([80, 700, 1400, 1900])
    assert [cause.name for cause in found.causes] == ["outliers"]
    share = found.causes[0].parameters["outlier_share"]
    assert share.value == pytest.approx(4 / 2000)
    assert share.ci95[0] >= 0.0
    assert np.isfinite(found.baseline.rms_n)
    assert found.baseline.rms_n < 0.12
