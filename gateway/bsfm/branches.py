"""The two curves of one hysteresis loop, over the same voltages, and the exact proof that they do not cross.

At equal voltage friction holds the falling force above the rising one. The difference falling - rising has the
numerator N_f W_r - N_r W_f, whose sign inside (0, 1) is decided in whole numbers (exact_polynomials.py). Zero is allowed at
the ends, where the continuous form ties the branches, and all over: two equal curves are a loop of no width (PFM and
BFM, a plant without friction).
"""

from dataclasses import dataclass

from gateway.bsfm import exact_polynomials as exact
from gateway.bsfm.curve import RationalBezier


@dataclass(frozen=True, slots=True)
class Crossing:
    """A place where the falling branch is not above the rising one. gap_n is falling minus rising there."""

    voltage_v: float
    gap_n: float

    def __str__(self) -> str:
        return f"the falling branch is {-self.gap_n:.3g} N below the rising one at {self.voltage_v:.3f} V"


@dataclass(frozen=True, slots=True)
class Branches:
    """Both curves of a loop, force over voltage. rising: force while the voltage grows; falling: while it shrinks. Both
    over [x0, x1]; orders may differ.
    """

    rising: RationalBezier
    falling: RationalBezier

    def __post_init__(self) -> None:
        if (self.rising.x0, self.rising.x1) != (self.falling.x0, self.falling.x1):
            raise ValueError("rising and falling branch must span the same voltages")

    @property
    def tied(self) -> bool:
        """The continuous form: both end handles shared, so that the loop closes without a jump."""
        rising, falling = self.rising.handles, self.falling.handles
        return (rising[0], rising[-1]) == (falling[0], falling[-1])

    def crossing_fault(self) -> Crossing | None:
        """Return where the branches cross or touch between their ends, or None: exact."""
        gap = self._gap_numerator()
        if not any(gap):
            return None
        place = exact.place_not_positive(gap)
        return None if place is None else self._crossing_near(place)

    def _gap_numerator(self) -> list[int]:
        # the two scales of weights multiply the whole numerator, the scale of handles must be common
        handles, _ = exact.whole_numbers((*self.rising.handles, *self.falling.handles))
        split = self.rising.order + 1
        sides = []
        for curve, own in ((self.rising, handles[:split]), (self.falling, handles[split:])):
            total = exact.scale_bernstein(exact.whole_numbers(curve.weights)[0])
            sides.append((total, [w * b for w, b in zip(total, own, strict=True)]))
        (rising_w, rising_n), (falling_w, falling_n) = sides
        return exact.difference(exact.product(falling_n, rising_w), exact.product(rising_n, falling_w))

    def _crossing_near(self, place: float) -> Crossing:
        """The widest of 65 sampled gaps below zero, or else the place that the proof found: for the sentence only."""
        low, span = self.rising.x0, self.rising.x1 - self.rising.x0
        voltages = [low + span * share for share in (place, *(i / 64 for i in range(65)))]
        gaps = [(self.falling.value(voltage) - self.rising.value(voltage), voltage) for voltage in voltages]
        widest, where = min(gaps)
        return Crossing(where, widest) if widest < 0.0 else Crossing(voltages[0], gaps[0][0])
