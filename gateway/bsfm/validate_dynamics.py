"""Are these slip stops and this response fit to be used? Numbers first, then the stops against the branches.

Index and reasons: gateway.bsfm.coefficients. The stops are a broken model if their radii do not ascend, their shares do not
add up to 1, or they are so stiff that the voltage after a reversal is not unique (gateway.bsfm.slip.slip_stops).
"""

from collections.abc import Iterator
from typing import Final

from gateway.bsfm.branches import Branches
from gateway.bsfm.coefficients import (
    RADII_FROM,
    RESPONSE_FROM,
    SHARES_FROM,
    WHOLE,
    Allowed,
    CoefficientFault,
    CoefficientLimits,
    CoefficientReason,
    Coefficients,
)
from gateway.bsfm.model import Response
from gateway.bsfm.slip.slip_stops import STOPS_MAX, SUM_TOLERANCE, SlipStops

RINGS_LEAST: Final = 0.1  # damping: no regulator that anybody would buy rings more


def stop_faults(stored: Coefficients, limits: CoefficientLimits) -> Iterator[CoefficientFault]:
    """Return the faults of the numbers of slip stops, one by one and together."""
    radii, shares = stored.slip_radii_v, stored.slip_shares
    if len(radii) != len(shares) or len(radii) > STOPS_MAX:
        text = f"slip stops: {len(radii)} radii and {len(shares)} shares: as many of each, at most {STOPS_MAX}"
        yield CoefficientFault(WHOLE, CoefficientReason.SLIP_STOPS, text)
        return
    single = [*_radius_faults(radii, limits), *_share_faults(shares)]
    yield from single
    if shares and not single and not abs(sum(shares) - 1.0) <= SUM_TOLERANCE:
        text = f"slip shares add up to {sum(shares):.7g}: 1 is needed"
        yield CoefficientFault(SHARES_FROM, CoefficientReason.SLIP_SHARE, text)


def _radius_faults(radii_v: tuple[float, ...], limits: CoefficientLimits) -> Iterator[CoefficientFault]:
    low_v, high_v = limits.slip_radius_min_v, limits.slip_radius_max_v
    for i, radius_v in enumerate(radii_v):
        allowed = Allowed(f"slip radius {i}", low_v, high_v, "V", CoefficientReason.SLIP_RADIUS)
        faults = list(allowed.faults(RADII_FROM + i, radius_v))
        yield from faults
        if not faults and i and not radius_v > radii_v[i - 1]:
            text = f"slip radius {i} = {radius_v:g} V, the one before it {radii_v[i - 1]:g} V: ascending is needed"
            yield CoefficientFault(RADII_FROM + i, CoefficientReason.SLIP_RADIUS, text)


def _share_faults(shares: tuple[float, ...]) -> Iterator[CoefficientFault]:
    for i, share in enumerate(shares):
        allowed = Allowed(f"slip share {i}", 0.0, 1.0, "", CoefficientReason.SLIP_SHARE)
        yield from allowed.faults(SHARES_FROM + i, share)


def stiffness_faults(stored: Coefficients, branches: Branches) -> Iterator[CoefficientFault]:
    """Return the faults of stops whose numbers have passed, on branches that have passed."""
    if not stored.slip_radii_v:
        return
    try:
        SlipStops(stored.slip_radii_v, stored.slip_shares).check(branches)
    except ValueError as error:
        yield CoefficientFault(RADII_FROM, CoefficientReason.SLIP_STIFFNESS, str(error))


def response_faults(response: Response | None, limits: CoefficientLimits) -> Iterator[CoefficientFault]:
    """Return the faults of a measured response. All 0 is how words say that it was not measured, so no measurement may say
    it."""
    if response is None:
        return
    bounds = (
        ("dead time", response.dead_time_s, limits.dead_time_max_s, "s"),
        ("lag", response.lag_s, limits.lag_max_s, "s"),
        ("second lag", response.second_lag_s, limits.lag_max_s, "s"),
        ("damping", response.damping, limits.damping_max, ""),
    )
    for i, (name, number, high, unit) in enumerate(bounds):
        allowed = Allowed(name, 0.0, high, unit, CoefficientReason.RESPONSE)
        yield from allowed.faults(RESPONSE_FROM + i, number)
    if 0.0 < response.damping < RINGS_LEAST or (0.0 < response.damping <= 1.0 and not response.second_lag_s > 0.0):
        text = f"damping {response.damping:g}: 0 for real lags, or {RINGS_LEAST:g} and more with two lags"
        yield CoefficientFault(RESPONSE_FROM + 3, CoefficientReason.RESPONSE, text)
    if not any(number for _, number, _, _ in bounds):
        text = "dead time and both lags are 0: no plant is that fast; leave the response out where it was not measured"
        yield CoefficientFault(RESPONSE_FROM, CoefficientReason.RESPONSE, text)
