"""A value as it was a transport delay ago: what the force can have heard of it by now."""

from collections import deque


class TransportDelay:
    """delay_s 0: the value itself. Time passes in `advance`, in steps of any size."""

    def __init__(self, delay_s: float) -> None:
        self.delay_s = delay_s
        self.restart(0.0)

    def restart(self, value: float) -> None:
        """Fill the delay line with this value, as if it had stood for long."""
        self._past: deque[tuple[float, float]] = deque()
        self._now_s, self._value = 0.0, value

    def advance(self, value: float, dt_s: float) -> float:
        """Advance by dt_s, take the value that holds from now on, and return the value of delay_s ago."""
        if self.delay_s <= 0.0:
            return value
        self._now_s += dt_s
        past, entered_s = self._past, self._now_s - self.delay_s
        past.append((self._now_s, value))
        while past and past[0][0] <= entered_s:
            self._value = past.popleft()[1]
        return self._value
