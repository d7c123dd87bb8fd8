"""How long the stages of a self-test last: by the response that the calibration has measured, and within bounds."""

from dataclasses import dataclass
from typing import Final

from gateway.control.tare import LEAVING_LAGS

REST_S: Final = 3.0  # the first of which lets a force from before leave, or as many response lags as it needs
_LEAVES_S: Final = 1.0
READ_REST_S: Final = REST_S - _LEAVES_S
"""The newest part of the rest, whose readings are judged."""
_LONGEST_LEAVING_S: Final = 4.0  # with both settlings the whole takes less than 20 s, whatever the lag is
RISE_S: Final = 1.0  # to the first level: less than half of the stated force: a second is slow
HOLD_S: Final = 4.0  # in which a leak of 1 % per second is 4 % of the force
_LONGEST_SETTLING_S: Final = 3.0  # or as many response lags as leave 3000 times less
_SETTLING_LAGS: Final = 8.0
_MOST_SETTLING_S: Final = 4.4
_SHORTEST_SETTLING_S: Final = 0.8
_SETTLED: Final = 4.0  # times the response: 2 % are left of one lag


@dataclass(frozen=True, slots=True)
class StageTimes:
    """response_s: dead time and lags of the plant; moves: whether the test presses at all."""

    response_s: float
    moves: bool

    @property
    def standing_s(self) -> float:
        """Time for which nothing moves at the beginning, s."""
        return REST_S + max(0.0, min(_LONGEST_LEAVING_S, LEAVING_LAGS * self.response_s) - _LEAVES_S)

    @property
    def settling_s(self) -> float:
        """Least time for which a level is waited for, s."""
        return min(self.longest_settling_s, max(_SHORTEST_SETTLING_S, _SETTLED * self.response_s))

    @property
    def longest_settling_s(self) -> float:
        """Longest time for which it is waited for, s."""
        return max(_LONGEST_SETTLING_S, min(_MOST_SETTLING_S, _SETTLING_LAGS * self.response_s))

    @property
    def planned_s(self) -> float:
        """Time of the whole test where each level settles within its least time, s."""
        return self.standing_s + (RISE_S + 2.0 * self.settling_s + HOLD_S if self.moves else 0.0)
