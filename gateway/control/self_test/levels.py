"""The two voltages of a self-test, by the calibration in use and below the stated force.

Both lie on the rising branch above what friction has kept pressed at rest, for a force that has not moved yet says nothing of
the scale. The first is two fifths of the way; the second is set by what the first one has shown. Where friction leaves no room
below the stated force, there are none.
"""

from typing import Final

from gateway.bsfm.ladder.plan import FALLING, RISING
from gateway.control.self_test.judgement import Known

FORCE_SHARE: Final = 0.8  # of the stated force: what is meant to be reached
NEAR_SHARE: Final = 0.05  # of the stated force, before which the test ends
_FIRST_SHARE: Final = (
    0.4  # of the way there: a machine more than twice as strong as calibrated stays below the stated force
)
_LEAST_SPAN_N: Final = 1.5  # between rest and the second level: less is friction's
_LEAST_STEP_N: Final = 0.6  # from the first to the second level, from which on a slope means something
_HALVINGS: Final = 12  # of a range of volts: to millivolts


class Levels:
    """first_v, second_v: where the test goes. force_n: the stated force, as the load cell feels it; base_n: force at rest, or
    what the rising branch has there."""

    def __init__(self, known: Known, force_n: float, rest_n: float) -> None:
        self._known, self._force_n = known, force_n
        self.base_n = max(rest_n, self.expected_n(known.rest_v))
        self._top_n = min(FORCE_SHARE * force_n, self.expected_n(self._loosened_v()))
        self.first_v = self._voltage_v(self.base_n + _FIRST_SHARE * (self._top_n - self.base_n))
        self.second_v = known.rest_v

    @property
    def why_no_room(self) -> str:
        """Sentence of why there are no such voltages; empty where there are."""
        friction_n = self.friction_n(self.first_v)
        first_n = self.expected_n(self.first_v) + friction_n
        if self._top_n - self.base_n >= _LEAST_SPAN_N and first_n <= FORCE_SHARE * self._force_n:
            return ""
        kept = f"{self.base_n:.1f} N at rest and a friction of {friction_n:.1f} N leave no room"
        return f"{kept} below self_test.force_n = {self._force_n:g} N: raise it"

    @property
    def span_n(self) -> float:
        """Expected change of force from the first level to the second, N."""
        return self.expected_n(self.second_v) - self.expected_n(self.first_v)

    def set_second(self, first_n: float) -> bool:
        """Set the second voltage by the force that the first has made; False where no room is left."""
        expected_n = self.expected_n(self.first_v)
        stronger = max(1.0, (first_n - self.base_n) / (expected_n - self.base_n))
        left_n = (self._top_n - first_n) / stronger
        if left_n < _LEAST_STEP_N:
            return False
        most_n = self._top_n - expected_n  # a machine that gives less is not asked for more
        self.second_v = self._voltage_v(expected_n + min(left_n, most_n))
        return True

    def expected_n(self, voltage_v: float) -> float:
        """Return what the calibration expects on the rising branch, N."""
        return self._known.model.force_n(voltage_v, float(RISING))

    def friction_n(self, voltage_v: float) -> float:
        """Return the width of the loop there, N."""
        rising_n, falling_n = self._known.model.branch_forces_n(voltage_v)
        return max(0.0, falling_n - rising_n)

    def _loosened_v(self) -> float:
        """Voltage that stays below the stated force even if something (a spindle) shakes the friction loose: then the slide
        presses with what lies between the branches."""
        model, most_n = self._known.model, (1.0 - NEAR_SHARE) * self._force_n
        low_v, high_v = model.voltage_v(most_n, float(FALLING))[0], model.voltage_v(most_n, float(RISING))[0]
        for _ in range(_HALVINGS):
            mid_v = 0.5 * (low_v + high_v)
            if model.force_n(mid_v, 0.0) > most_n:
                high_v = mid_v
            else:
                low_v = mid_v
        return low_v

    def _voltage_v(self, force_n: float) -> float:
        limits = self._known.settings.limits
        return min(limits.voltage_max_v, self._known.model.voltage_v(force_n, float(RISING))[0])
