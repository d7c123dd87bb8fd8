"""What entries of several families share: groups that are easily confused, reasons, one recipe, and where limits may lie."""

from typing import Final

from gateway.catalogue.effect import PRESSURE, PartName, Recipe

SLOW_LAGS: Final = ("transport-delay", "clock-offset", "extra-lag", "viscous-friction", "pressure-lag")
"""All make the force late."""
LIMITS: Final = (
    "sensor-quadratic",
    "sensor-cubic",
    "supply-saturation",
    "contact-nonlinearity",
    "command-nonlinearity",
    "end-stop",
)
"""All bend the force at large commands."""
MONOTONE: Final = ("linear-drift", "pad-wear", "warm-up", "creep", "thermal-zero-drift")
"""All let the force go one way in time."""

TRIM: Final = "the trim takes it back as the load cell sees it"
TOO_FAST: Final = "it is faster than the regulator's delay and lags let the force follow"

DEAD_WEIGHTS: Final = Recipe(
    parts=(PartName.STAIRCASE,),
    columns=PRESSURE,
    apart="put dead weights on the load cell, seven levels up and down: a bent cell shows with them, a bent contact does not",
)

NEAR: Final = (0.93, 0.96, 0.985)  # of the largest that was reached: a limit cuts off little of what shows it


def limits(reached: tuple[float, ...]) -> tuple[float, ...]:
    """Return where what was reached may have met a limit: below each quantile, and closely below the largest."""
    return tuple(0.97 * quantile for quantile in reached[1:-1]) + tuple(share * reached[-1] for share in NEAR)
