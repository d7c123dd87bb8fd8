"""Delay a value by a transport delay: what the force can have heard of it by now."""

from collections import deque


class TransportDelay:
    """delay_s 0: the value itself. Time passes in `advance`, in steps of any size."""

    def __init__(self, delay_s: float) -> None:
        self._delay_s = delay_s
        self.restart(0.0)

    def restart(self, value: float) -> None:
        """It has been this value for long."""
        self._past: deque[tuple[float, float]] = deque()
        self._now_s, self._value = 0.0, value

    def advance(self, value: float, dt_s: float) -> float:
        """dt_s has passed and the value is this from now on; returns what it was delay_s ago."""
        if self._delay_s <= 0.0:
            return value
        self._now_s += dt_s
        past, heard_s = self._past, self._now_s - self._delay_s
        past.append((self._now_s, value))
        while past and past[0][0] <= heard_s:
            self._value = past.popleft()[1]
        return self._value
