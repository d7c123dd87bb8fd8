"""Invert the regulator's two lags: a step of the wanted voltage becomes a short push beyond it, so that the
pressure arrives sooner.

The lead carries a model of the lags, driven by the voltage that really stood on the output, and asks for the voltage
that makes the model follow two shorter lags. Whatever the range, the slew limit or another mode made of the command is
in the model, too, so nothing winds up. Feedback of the model rather than derivatives of the wish: calls may come
microseconds apart. Feedforward and trim are led together, because together they are what the regulator hears.
Tell it rather too short a lag than too long a one: with 30 % too long the demo rig overshoots and settles no sooner than
without lead, with 30 % too short it takes 0.26 s (0.20 s with the right lags, 0.37 s without).
"""

from math import exp
from typing import Final

from gateway.control.force_loop.lag_inverse import EQUAL_V
from gateway.control.limits import TICK_S
from gateway.control.settings import LeadSettings, Limits

_SHARE: Final = 0.35  # of a lag that is left: 25 of 72 ms, as tried on 20 copies of the rig (tools/paper)
_SHORTEST_S: Final = 2.0 * TICK_S  # a faster model would chatter between two ticks


class LeadCompensator:
    """first_v and second_v: where the model's lags are. With both lags 0 the wish passes unchanged."""

    def __init__(self, settings: LeadSettings, limits: Limits) -> None:
        longer_s, shorter_s = sorted((settings.lag_s, settings.second_lag_s), reverse=True)
        self.first_v = self.second_v = limits.safe_voltage_v
        self._limits = limits
        self._lag_s, self._second_lag_s = longer_s, shorter_s
        mean_s = 0.5 * (longer_s + shorter_s) if shorter_s > 0.0 else longer_s
        self._left_s = max(_SHARE * mean_s, min(mean_s, _SHORTEST_S))

    @property
    def gained_s(self) -> float:
        """Time by which the response comes earlier than without, s."""
        left_s = 2.0 * self._left_s if self._second_lag_s > 0.0 else self._left_s
        return max(0.0, self._lag_s + self._second_lag_s - left_s)

    def go_on_from(self, first_v: float, second_v: float) -> None:
        """Take over from another model of the lags."""
        self.first_v, self.second_v = first_v, second_v

    def advance(self, voltage_v: float, dt_s: float) -> None:
        """Advance the model of the lags: voltage_v stood on the output for the last dt_s. Exact for a held voltage."""
        if self._lag_s <= 0.0:
            self.first_v = self.second_v = voltage_v
            return
        first_v, second_v = self.first_v - voltage_v, self.second_v - voltage_v
        decay = exp(-dt_s / self._lag_s)
        self.first_v = voltage_v + decay * first_v
        self.second_v = voltage_v + self._second(first_v, second_v, dt_s, decay)

    def _second(self, first_v: float, second_v: float, dt_s: float, decay: float) -> float:
        """Return the second lag behind the first, both as differences to the held voltage. decay: of the first."""
        lag_s, second_lag_s = self._lag_s, self._second_lag_s
        if second_lag_s <= 0.0:
            return decay * first_v
        second_decay = exp(-dt_s / second_lag_s)
        spread_s = lag_s - second_lag_s
        # the limit of the general form for equal lags, where that is 0/0
        passed = decay * dt_s / lag_s if spread_s < 1.0e-6 * lag_s else lag_s * (decay - second_decay) / spread_s
        return second_decay * second_v + passed * first_v

    def compensated_v(self, wanted_v: float) -> float:
        """Return the voltage to ask for now, V. Only the push is kept within the range: a wish outside it passes, and the
        limiter says so."""
        if self._lag_s <= 0.0:
            return wanted_v
        asked_v = self._asked_v(wanted_v)
        if abs(asked_v - wanted_v) < EQUAL_V:
            return wanted_v
        lowest_v, highest_v = self._limits.voltage_min_v, self._limits.voltage_max_v
        return max(min(lowest_v, wanted_v), min(max(highest_v, wanted_v), asked_v))

    def _asked_v(self, wanted_v: float) -> float:
        """Solved for the input: left^2 x" + 2 left x' + x = wanted, or left x' + x = wanted behind one lag."""
        left_s, lag_s, second_lag_s = self._left_s, self._lag_s, self._second_lag_s
        if second_lag_s <= 0.0:
            return self.first_v + lag_s / left_s * (wanted_v - self.first_v)
        speed = (self.first_v - self.second_v) / second_lag_s
        bend = ((wanted_v - self.second_v) / left_s - 2.0 * speed) / left_s
        return self.first_v + lag_s * (speed + second_lag_s * bend)
