"""Sizes that an answer tells: how far the force is from what the piston gives, and intervals within what there can be."""

import numpy as np
import pytest

from gateway.catalogue.sensing import OUTLIER, OUTLIER_SHARE
from gateway.diagnosis.model_fit.normal_equations import HeldOutErrors
from gateway.diagnosis.notes import implausible_area
from gateway.diagnosis.search.direct_evidence import DirectEvidence
from gateway.diagnosis.verdict import _direct_estimates


@pytest.mark.parametrize(("times", "told"), [(100.0, "100 times"), (0.01, "0.01 times"), (29.0, ""), (0.034, "")])
def test_the_force_is_so_many_times_what_the_piston_gives(times: float, told: str) -> None:
    said = implausible_area(times * 1.0e-4, 1.0e-4)
    assert said.startswith(f"the force is {told} what the start plant's piston of 1 cm2 gives") if told else not said


def test_a_share_of_the_readings_is_not_below_none() -> None:
    rows = np.zeros(3, dtype=bool)
    evidence = DirectEvidence("outliers", ((OUTLIER_SHARE, 0.01, 0.02), (OUTLIER, 5.0, 1.0)), rows, 1.0, 0.5)
    found = _direct_estimates(evidence)
    assert found["outlier_share"].ci95 == (0.0, pytest.approx(0.01 + 2.1 * 0.02))
    assert found["outlier_n"].ci95 == pytest.approx((2.9, 7.1))


def test_a_size_is_as_sure_as_its_estimates_without_one_block_lie_close_together() -> None:
    """The jackknife of a mean is its standard error: that of the blocks over the root of their number."""
    blocks = np.random.default_rng(4).normal(2.0, 0.3, 20)
    steps = (blocks.sum() - blocks) / 19.0 - blocks.mean()
    errors = HeldOutErrors(np.ones(20), np.ones(20), steps[:, None], np.ones(20))
    assert errors.jackknife == pytest.approx([blocks.std(ddof=1) / np.sqrt(20.0)])
