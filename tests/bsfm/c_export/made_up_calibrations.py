"""Calibrations to export: ordinary ones, hard ones, and ones with slip stops."""

from typing import Any

import numpy as np

from gateway.bsfm import Calibration, SlipStops
from gateway.bsfm.slip.slip_stops import STIFFEST, half_width_bound_v
from gateway.profiles import load_calibration


def calibration(order: int, seed: int, spread: float = 1.2, **changes: object) -> Calibration:
    """A made-up loop with tied ends, 0.5 .. 40 N: random increasing handles, weights within exp(+-spread)."""
    rng = np.random.default_rng(seed)
    facts: dict[str, Any] = {}
    for branch in ("rising", "falling"):
        shares = np.cumsum(rng.uniform(0.4, 1.0, order))
        facts[f"{branch}_handles_n"] = (0.5, *(0.5 + 39.5 * shares / shares[-1]).tolist())
        facts[f"{branch}_weights"] = tuple(np.exp(rng.uniform(-spread, spread, order + 1)).tolist())
    texts = {"date_utc": "2026-01-01", "source": "made up", "rig": "none", "data_sha256": "00"}
    facts |= {"number": seed, "order": order, "x0_v": 0.0, "x1_v": 5.0, "blend_span_n": 3.0, "rms_n": 0.1, "max_n": 0.4}
    return Calibration(**{"name": f"order_{order}", **facts, **texts, **changes})


def stops(count: int, first_v: float) -> dict[str, Any]:
    shares = np.random.default_rng(count).uniform(0.0, 1.0, count)
    radii_v = first_v * np.geomspace(1.0, 4.0, count)
    return {"slip_radii_v": tuple(radii_v.tolist()), "slip_shares": tuple((shares / shares.sum()).tolist())}


def stiffest(given: Calibration, radii: tuple[float, ...], shares: tuple[float, ...]) -> dict[str, Any]:
    """Stops with nearly the least radii that these branches bear."""
    widest_v = half_width_bound_v(given.model().branches)
    scale = 1.0001 * widest_v * SlipStops(radii, shares).stiffness_per_v / STIFFEST
    return {"slip_radii_v": tuple(scale * radius for radius in radii), "slip_shares": shares}


ORDINARY = {"demo": load_calibration("demo"), **{f"order_{n}": calibration(n, seed=n) for n in (1, 2, 3, 5, 15)}}
HARD = {
    "free_ends": calibration(3, 31, x0_v=-2.0, x1_v=7.7, blend_span_n=0.0, falling_handles_n=(-3.0, 8.0, 9.5, 33.0)),
    "pole_near_the_end": calibration(5, 32, rising_weights=(1.0, 1.0, 1.0, 1.0, 1.0, 2e-3)),
    "spread_weights": calibration(15, 33, spread=4.0),
    "flat_end": calibration(4, 34, falling_handles_n=(0.5, 0.5, 0.5, 20.0, 40.0)),
    "straight": calibration(2, 35, rising_handles_n=(0.0, 18.0, 36.0), rising_weights=(1.0, 1.0, 1.0)),
}
SLIP = {
    "one_stop": calibration(1, 41, slip_radii_v=(1.5,), slip_shares=(1.0,)),
    "sixteen_stops": calibration(3, 42, 0.3, **stops(16, 1.2)),
    "stops_of_order_15": calibration(15, 43, 0.3, **stops(10, 1.0)),
    "stiffest_stops": calibration(2, 44, 0.3, **stiffest(calibration(2, 44, 0.3), (0.3, 0.5, 2.0), (0.6, 0.3, 0.1))),
    "stops_with_free_ends": calibration(3, 45, 0.3, falling_handles_n=(-3.0, 8.0, 25.0, 44.0), **stops(5, 2.0)),
}
ORDINARY |= SLIP
CASES = {**ORDINARY, **HARD}
