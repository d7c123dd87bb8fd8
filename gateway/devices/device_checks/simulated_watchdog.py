"""The watchdog in a simulated device: armed, fed, tripped and cleared as the profile says, in the time that it is given."""

from math import inf
from typing import Final

from gateway.devices.device_checks.watchdog import Watchdog, WatchdogState
from gateway.devices.messages import DeviceStep

_SWITCHED_OFF: Final = ((DeviceStep.DISARM, WatchdogState.ARMED), (DeviceStep.CLEAR, WatchdogState.TRIPPED))


class SimulatedWatchdog:
    """state: as the device would tell it; ticks: the time that it was armed with."""

    def __init__(self, profile: Watchdog) -> None:
        self._profile = profile
        self.state = WatchdogState.OFF
        self.ticks = 0
        self._due_s = inf

    def elapse(self, now_s: float) -> bool:
        """Let time pass; return whether it trips now."""
        if self.state is not WatchdogState.ARMED or now_s < self._due_s:
            return False
        self.state = WatchdogState.TRIPPED
        return True

    def feed(self, now_s: float) -> None:
        """Note that the host is alive. A trip that the device has no words to clear is over by that: it obeys, and watches,
        again."""
        if self._profile.clear is None and self.state is WatchdogState.TRIPPED:
            self.state = WatchdogState.ARMED
        self._due_s = now_s + self.ticks * self._profile.tick_s

    def do(self, step: DeviceStep, ticks: int | None, now_s: float) -> None:
        """Follow a sentence of the host; ticks: the time that it carries."""
        if ticks is not None and step in (DeviceStep.SET_TIME, DeviceStep.ARM):
            self.ticks = ticks
        if step is DeviceStep.ARM and self.state is not WatchdogState.TRIPPED:
            self.state = WatchdogState.ARMED
            self.feed(now_s)
        elif (step, self.state) in _SWITCHED_OFF:
            self.state = WatchdogState.OFF
