"""What is measured of float32 at export, and what of it makes an export refused: without a compiler."""

from dataclasses import replace
from itertools import pairwise
from math import floor, log10
from types import SimpleNamespace

import pytest

from gateway.bsfm.c_export import accuracy
from gateway.bsfm.c_export.float32_model import Code, Float32, Float32Model
from gateway.bsfm.c_export.tables import tables_of
from tests.bsfm.c_export.test_c_export import CASES, calibration


def off_by(rising: float = 0.0, falling: float = 0.0) -> SimpleNamespace:
    """A model whose branches are at 10 and 20, off by so much, and whose commands are off by as much in turn."""
    answers = iter((5.0 + rising, 5.0 + falling))
    return SimpleNamespace(
        rising_force=lambda _: (Float32(10.0 + rising), Code.OK),
        falling_force=lambda _: (Float32(20.0 + falling), Code.OK),
        rising_voltage=lambda _: (Float32(3.0 + rising), Code.OK),
        falling_voltage=lambda _: (Float32(3.0 + falling), Code.OK),
        reset=lambda: None,
        command=lambda state, force_n: (Float32(next(answers)), Code.OK),
    )


@pytest.mark.parametrize("error", [0.25, -0.25])
@pytest.mark.parametrize("branch", ["rising", "falling"])
def test_either_branch_s_error_of_either_sign_counts(branch: str, error: float) -> None:
    single = off_by(**{branch: error})
    assert accuracy._force_error_n(single, (3.0, 10.0, 20.0)) == 0.25
    assert accuracy._voltage_error_v(single, (3.0, 10.0, 20.0)) == 0.25
    assert accuracy._reversal_error_v(single, ((1.0, 5.0), (2.0, 5.0))) == 0.25


@pytest.mark.parametrize("error", [0.0, 1e-7, 1.1e-5, 2.5e-5, 3e-3, 0.2])
@pytest.mark.parametrize("size", [0.5, 8.0, 60.0, 1000.0])
def test_a_tolerance_has_one_digit_and_leaves_a_margin(error: float, size: float) -> None:
    tolerance, least = accuracy._tolerance(error, size), max(4.0 * error, size * 2.0**-22)
    digit = tolerance / 10.0 ** floor(log10(tolerance) + 1e-9)
    assert digit == pytest.approx(round(digit)) and least < tolerance <= 2.0 * least * (1.0 + 1e-9)


@pytest.mark.parametrize("name", CASES)
def test_the_record_has_every_part_of_the_curves_and_no_less_than_what_is_off_in_it(name: str) -> None:
    tables = tables_of(CASES[name])
    single, test = Float32Model(tables), accuracy.self_test_of(CASES[name], tables)
    volts = [volt for volt, _, _ in test.points]
    assert (len(volts), volts[0], volts[-1]) == (17, tables.x0_v, tables.x1_v)
    steps_v = [after - before for before, after in pairwise(volts)]
    assert max(steps_v) == pytest.approx(min(steps_v), rel=1e-5)
    assert 0.0 < max(accuracy._force_error_n(single, point) for point in test.points) <= test.error_n
    assert max(accuracy._voltage_error_v(single, point) for point in test.points) <= test.error_v
    assert accuracy._reversal_error_v(single, test.reversals) <= test.error_v


@pytest.mark.parametrize("part", ["_force_error_n", "_voltage_error_v", "_reversal_error_v"])
@pytest.mark.parametrize(("share", "is_refused"), [(0.9e-3, False), (1.1e-3, True)])
def test_a_thousandth_of_what_the_branches_span_may_be_off(
    part: str, share: float, is_refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of their span, not of the largest force: 30 to 70 N is 40 N."""
    handles = (30.0, 45.0, 70.0)
    one = calibration(2, 2, rising_handles_n=handles, falling_handles_n=handles)
    monkeypatch.setattr(accuracy, part, lambda *_: share * (40.0 if part == "_force_error_n" else 5.0))
    if is_refused:
        with pytest.raises(ValueError, match="float32 cannot follow"):
            accuracy.self_test_of(one, tables_of(one))
    else:
        test = accuracy.self_test_of(one, tables_of(one))
        assert max(test.error_n / 40.0, test.error_v / 5.0) == pytest.approx(share)


@pytest.mark.parametrize(("radii_v", "blend_n", "step_n"), [((), 4.0, 1.0), ((), 400.0, 8.0), ((0.1,), 4.0, 2.0)])
def test_reversals_are_tried_where_both_branches_reach_and_smaller_than_what_turns_a_branch(
    radii_v: tuple[float, ...], blend_n: float, step_n: float
) -> None:
    tables = SimpleNamespace(shared_n=(10.0, 50.0), reached_n=(0.0, 60.0), radii_v=radii_v, blend_span_n=blend_n)
    forces_n = accuracy._commands_n(tables)  # type: ignore[arg-type]
    assert 10.0 <= min(forces_n) <= max(forces_n) <= 50.0
    assert forces_n[1] - forces_n[2] == pytest.approx(step_n)


@pytest.mark.parametrize(
    "limits_n", [(5.0,), (5.0, 10.0, 20.0), (10.0, 10.0), (10.0, 5.0), (float("nan"), 5.0), (5.0, float("inf"))]
)
def test_force_limits_that_are_none_are_refused(limits_n: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="force limits"):
        replace(CASES["demo"], force_limits_n=limits_n).model()
    assert replace(CASES["demo"], force_limits_n=(5.0, 10.0)).model().limits_n == (5.0, 10.0)


@pytest.mark.parametrize("branch", ["rising", "falling"])
def test_a_model_needs_both_branches_to_increase(branch: str) -> None:
    with pytest.raises(ValueError, match="both branches must increase"):
        calibration(2, 2, **{f"{branch}_handles_n": (0.5, 90.0, 40.0)}).model()
