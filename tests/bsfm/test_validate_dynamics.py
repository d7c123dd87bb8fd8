"""Each fault of a set has its number, its reason and a sentence that a person can act on."""

from dataclasses import replace

import pytest

from gateway.bsfm import CoefficientReason, validate_coefficients
from gateway.bsfm.exact_polynomials import place_negative, place_not_positive
from gateway.bsfm.model import Response
from gateway.bsfm.slip.slip_stops import STOPS_MAX
from tests.bsfm.test_validate_coefficients import GOOD, LIMITS

STOPS, RADIUS, SHARE, STIFF = (CoefficientReason(number) for number in (11, 12, 13, 14))
RESPONSE = CoefficientReason.RESPONSE
WORKING = {"slip_radii_v": (0.5, 1.0), "slip_shares": (0.6, 0.4)}


def stops(radii_v: tuple[float, ...], shares: tuple[float, ...]) -> dict[str, object]:
    return {"slip_radii_v": radii_v, "slip_shares": shares}


def response(**numbers: float) -> dict[str, object]:
    return {"response": Response(**{"dead_time_s": 0.02, "lag_s": 0.1, **numbers})}


FAULTS = [
    (stops((0.5, 1.0), (0.6, 0.5)), 80, SHARE, "slip shares add up to 1.1: 1 is needed"),
    (stops((0.5, 1.0), (0.6, 0.4001)), 80, SHARE, "slip shares add up to 1.0001: 1 is needed"),
    (stops((0.5, 1.0), (0.6, 0.3999)), 80, SHARE, "slip shares add up to 0.9999: 1 is needed"),
    (stops((0.5,), (0.6, 0.4)), -1, STOPS, "slip stops: 1 radii and 2 shares: as many of each, at most 16"),
    (stops((0.5,) * 17, (0.1,) * 17), -1, STOPS, "slip stops: 17 radii and 17 shares: as many of each, at most 16"),
    (stops((1.0, 0.5), (0.6, 0.4)), 65, RADIUS,
     "slip radius 1 = 0.5 V, the one before it 1 V: ascending is needed"),
    (stops((0.5, 0.5), (0.6, 0.4)), 65, RADIUS,
     "slip radius 1 = 0.5 V, the one before it 0.5 V: ascending is needed"),
    (stops((1e-5, 1.0), (0.6, 0.4)), 64, RADIUS, "slip radius 0 = 1e-05: 0.0001 .. 100 V is allowed"),
    (stops((0.5, 101.0), (0.6, 0.4)), 65, RADIUS, "slip radius 1 = 101: 0.0001 .. 100 V is allowed"),
    (stops((0.5, 1.0), (0.6, -0.4)), 81, SHARE, "slip share 1 = -0.4: 0 .. 1 is allowed"),
    (stops((0.5, 1.0), (1.4, 0.4)), 80, SHARE, "slip share 0 = 1.4: 0 .. 1 is allowed"),
    (stops((0.1, 0.3), (0.6, 0.4)), 64, STIFF,
     "slip stops give way over 0.136 V at first, on a loop of up to +-0.26 V: more than 0.274 V is needed"),
    (response(damping=0.5), 99, RESPONSE, "damping 0.5: 0 for real lags, or 0.1 and more with two lags"),
    (response(damping=1.0), 99, RESPONSE, "damping 1: 0 for real lags, or 0.1 and more with two lags"),
    (response(second_lag_s=0.02, damping=0.05), 99, RESPONSE,
     "damping 0.05: 0 for real lags, or 0.1 and more with two lags"),
    (response(dead_time_s=0.0, lag_s=0.0), 96, RESPONSE,
     "dead time and both lags are 0: no plant is that fast; leave the response out where it was not measured"),
    (response(dead_time_s=99.0), 96, RESPONSE, "dead time = 99: 0 .. 1 s is allowed"),
    (response(lag_s=-1.0), 97, RESPONSE, "lag = -1: 0 .. 2 s is allowed"),
    (response(second_lag_s=2.5), 98, RESPONSE, "second lag = 2.5: 0 .. 2 s is allowed"),
    (response(second_lag_s=0.1, damping=1.5), 99, RESPONSE, "damping = 1.5: 0 .. 1 is allowed"),
    ({"rising_weights": (100.0, 0.01, 100.0)}, 17, CoefficientReason.WEIGHT_RANGE,
     "rising weight 1 = 0.01 is 0.0001 times weight 0: 0.001 .. 1000 is allowed"),
    ({"falling_weights": (1.0, 1.1, -1.0)}, 50, CoefficientReason.WEIGHT_RANGE,
     "falling weight 2 = -1: 0.001 .. 1000 is allowed"),
    ({"x1_v": 10.5}, -1, CoefficientReason.VOLTAGE_RANGE, "range 0 .. 10.5 V: 0 <= x0 < x1 <= 10 V is allowed"),
    ({"x1_v": 0.0}, -1, CoefficientReason.VOLTAGE_RANGE, "range 0 .. 0 V: 0 <= x0 < x1 <= 10 V is allowed"),
    ({"blend_span_n": 100.5}, -1, CoefficientReason.BLEND_SPAN, "blend span 100.5 N: 0 .. 100 N is allowed"),
    ({"blend_span_n": -0.5}, -1, CoefficientReason.BLEND_SPAN, "blend span -0.5 N: 0 .. 100 N is allowed"),
    ({"rising_handles_n": (0.5, 14.0, 98.5)}, 2, CoefficientReason.HANDLE_RANGE,
     "rising handle 2 = 98.5: -98 .. 98 is allowed"),
    ({"rising_handles_n": (0.5, 0.6, 38.0)}, 0, CoefficientReason.SLOPE_FLOOR,
     "the rising branch falls to 0.0372 N/V: at least 0.5 N/V is needed, or noise is amplified"),
    ({"falling_handles_n": (0.5, 39.0, 38.0)}, 32, CoefficientReason.NOT_INCREASING,
     "the falling branch is not increasing: force could not be inverted to voltage"),
    ({"falling_handles_n": (0.5, 13.0, 38.0)}, -1, CoefficientReason.CROSSING,
     "the falling branch is 1.16 N below the rising one at 3.516 V"),
    ({"rising_weights": (1.0, 1.0)}, -1, CoefficientReason.ORDER,
     "2 to 16 handles and as many weights per branch are needed"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "index", "reason", "sentence"), FAULTS)
def test_a_fault_has_its_number_its_reason_and_its_sentence(change, index, reason, sentence):
    faults = validate_coefficients(replace(GOOD, **change), LIMITS)
    assert [(fault.index, fault.reason, fault.text) for fault in faults] == [(index, reason, sentence)]


@pytest.mark.parametrize(
    "change",
    [
        WORKING,
        stops((0.5, 1.0), (0.6, 0.4 + 1e-7)),
        stops((0.5,), (1.0,)),
        response(),
        response(second_lag_s=0.02),
        response(second_lag_s=0.02, damping=0.1),
        response(second_lag_s=0.02, damping=1.0),
        response(dead_time_s=1.0, lag_s=2.0, second_lag_s=2.0),
        response(dead_time_s=0.0),
        stops(tuple(0.5 + 0.1 * k for k in range(STOPS_MAX)), (1.0 / STOPS_MAX,) * STOPS_MAX),
        {"x1_v": 10.0, "blend_span_n": 0.0},
        {"blend_span_n": 100.0},
    ],
)
def test_at_its_bounds_a_set_is_taken(change):
    assert validate_coefficients(replace(GOOD, **change), LIMITS) == []


def test_where_a_polynomial_fails_is_told_exactly():
    """Power-like coefficients of small whole numbers: touching zero is no fault of one, and is of the other."""
    assert place_negative([0, 1, 0]) is None and place_not_positive([0, 1, 0]) is None
    assert place_negative([-1, 1, 1]) == 0.0 and place_negative([1, 1, -1]) == 1.0
    assert place_not_positive([-1, 1, 1]) == 0.0 and place_not_positive([1, 1, -1]) == 1.0
    assert place_negative([1, -2, 1]) is None and place_not_positive([1, -2, 1]) == 0.5
    assert place_negative([1, -3, 1]) == 0.5 and place_not_positive([1, -3, 1]) == 0.5
    assert place_not_positive([0, 0, 0]) == 0.5 and place_negative([0, 0, 0]) is None
    assert place_not_positive([1, 0, 1]) is None and place_not_positive([0, 0, 1]) is None
