"""Switch the valve, never under pressure: force to 0, wait, tell the device, wait for its readback, wait, go on.

`direction` is what control calculates with: it follows the readback, never the command. While a switch is under way the force
is held at 0. Where the valve is told to go: while the output is enabled by control_word bit 4; while it is off by bit 4, too,
else where the rig says (`valve.safe`), so that a disable, a fault and a restart lead there.
"""

from dataclasses import replace
from math import inf
from typing import Final

from gateway.codes.faults import FaultCode
from gateway.control.inputs import ValveStatus
from gateway.control.settings import SafeDirection, ValveControl
from gateway.control.supervision.fault_detection import StopCause, stop_cause
from gateway.devices.valve_profile import ValveDirection

PUSH, PULL = ValveDirection
_SAFE: Final = {SafeDirection.PUSH: PUSH, SafeDirection.PULL: PULL}


class ValveSwitch:
    """direction: in effect; commanded: what the device is to be told, None as long as nobody may tell it; is_switching: the
    force has to be 0."""

    def __init__(self, settings: ValveControl) -> None:
        self.settings = settings
        self.direction = PUSH
        self.commanded = _SAFE.get(settings.safe)
        self.is_switching, self._is_well = True, False
        self._vented_s = inf
        self._told_s = self._confirmed_s = -inf  # confirmed: of what was told last
        self._differs_s = inf
        self._has_been_told = False  # of where it is to stand, or has stood there: before, it cannot be blamed
        self._status = ValveStatus()

    @property
    def is_pulling(self) -> bool:
        """Decide whether control pulls."""
        return self.direction is PULL

    @property
    def order(self) -> ValveDirection | None:
        """Direction that the device may be told now; None while there is pressure: then nobody moves it."""
        return self.commanded if self._vented_s < inf else None

    @property
    def is_going_to_rest(self) -> bool:
        """Decide whether a valve of an output that is off may be waited for: it is not where the rig says, and will come."""
        rest = _SAFE.get(self.settings.safe, self.commanded)
        return self._is_well and (self.is_switching or self.commanded is not rest)

    def wanted(self, *, pulls: bool, is_enabled: bool) -> ValveDirection | None:
        """Return where the valve is to stand. pulls: control_word bit 4; None: where it is."""
        if pulls:
            return PULL
        return PUSH if is_enabled else _SAFE.get(self.settings.safe, self.commanded)

    def step(self, now_s: float, wanted: ValveDirection | None, status: ValveStatus, *, is_vented: bool) -> bool:
        """Take one step; return whether `direction` has changed. is_vented: no voltage is out, and none is on its way."""
        self._status = status
        if self.commanded is None:
            self.commanded = status.stands
        self._vented_s = min(self._vented_s, now_s) if is_vented else inf
        if wanted is not None and wanted is not self.commanded and self._may_switch(now_s):
            self.commanded, self._told_s = wanted, now_s
            self._confirmed_s = self._differs_s = inf  # a new order has its own time
        is_confirmed = self.commanded is not None and status.stands is self.commanded
        self._confirmed_s = min(self._confirmed_s, now_s) if is_confirmed else self._confirmed_s
        self._has_been_told = self._has_been_told or is_confirmed or self.order is not None
        is_known = self._has_been_told and status.stands is not None
        self._differs_s = min(self._differs_s, now_s) if is_known and not is_confirmed else inf
        has_dwelt = now_s - self._confirmed_s >= self.settings.dwell_s
        is_wanted = wanted is None or wanted is self.commanded
        self.is_switching = not (is_confirmed and has_dwelt and is_wanted)
        self._is_well = self.first_cause(now_s) is None
        if self.is_switching or self.commanded is None or self.commanded is self.direction:
            return False
        self.direction = self.commanded
        return True

    def _may_switch(self, now_s: float) -> bool:
        return now_s - max(self._vented_s, self._told_s) >= self.settings.dwell_s

    def blame(self, now_s: float, cause: StopCause | None) -> StopCause | None:
        """Return the first cause, where the valve counts as well. cause: what others have found goes before, but for a force
        that went the wrong way while the valve stands elsewhere: who then turns the cell round has two faults."""
        if cause is None or cause.fault is not FaultCode.SIGN_INVERTED:
            return cause or self.first_cause(now_s)
        stands = self._status.stands
        if self._differs_s < inf:
            observation = f"the valve reads back {stands} and was told {self.commanded}"
            return stop_cause(FaultCode.VALVE_ALTERED, f"{observation}: the force has turned with it")
        doubt = f"or the valve stands elsewhere than its relay reads back ({stands}): coil, spool or pilot air"
        return replace(cause, sentence=f"{cause.sentence}; {doubt}")

    def first_cause(self, now_s: float) -> StopCause | None:
        """Return the fault of the valve, None where there is none."""
        status, bound_s = self._status, self.settings.timeout_s
        if status.lost:
            return stop_cause(
                FaultCode.VALVE_SILENT, "the valve's port went away: check the plug; it reopens by itself"
            )
        if status.unanswered_since_s is not None and now_s - status.unanswered_since_s > bound_s:
            silent_s = now_s - status.unanswered_since_s
            observation = f"no answer from the valve for {1e3 * silent_s:.0f} ms, allowed {1e3 * bound_s:.0f} ms"
            return stop_cause(FaultCode.VALVE_SILENT, f"{observation}: {_suspects(status) or 'power or wires'}")
        if now_s - self._differs_s > bound_s:
            observation = f"the valve reads back {status.stands} and was told {self.commanded}"
            said = f": {suspects}" if (suspects := _suspects(status)) else ""
            lasts = f"for {1e3 * (now_s - self._differs_s):.0f} ms, allowed {1e3 * bound_s:.0f} ms"
            return stop_cause(FaultCode.VALVE_ALTERED, f"{observation}, {lasts}{said}")
        return None


def _suspects(status: ValveStatus) -> str:
    return f"it says {status.said}; address, channel or profile of the relay?" if status.said else ""
