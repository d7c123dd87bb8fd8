"""Thrust that is on its way: asked for, and not yet through the lags, or through them and still within the dead time.

A force that is measured now has heard of neither. What comes is known from the model of the lags, which carries the voltage
that really stood on the output, so that whoever knows it need not wait for it (a Smith predictor).
"""

from gateway.control.force_loop.lag_inverse import LinearizedLagInverse
from gateway.control.force_loop.transport_delay import TransportDelay


class ComingThrust:
    """Counts from the thrust of the model of the lags, a dead time ago. Time passes in `elapse`, whoever drives the output:
    what had arrived before a pause says nothing of what arrives behind it."""

    def __init__(self) -> None:
        self._arrived = TransportDelay(0.0)
        self._thrust_n = self._arrived_n = 0.0

    def retime(self, dead_time_s: float) -> None:
        """Replace the dead time, s; the same one goes on with what is in it."""
        if self._arrived.delay_s != dead_time_s:
            self._arrived = TransportDelay(dead_time_s)

    def elapse(self, lead: LinearizedLagInverse, dt_s: float) -> None:
        """Take over where the model of the lags has come to. dt_s has passed."""
        self._thrust_n = -lead.away_n(0.0)
        self._arrived_n = self._arrived.advance(self._thrust_n, dt_s)

    def coming_n(self, lead: LinearizedLagInverse, wanted_v: float) -> float:
        """Return what still comes of the thrust that wanted_v makes at rest, N."""
        return lead.away_n(wanted_v) + self._thrust_n - self._arrived_n
