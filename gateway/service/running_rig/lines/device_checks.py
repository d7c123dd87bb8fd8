"""What is asked of an output device before it may do more than the safe voltage: what it is, and whether its watchdog watches.

The order: identity, the watchdog's state, its arming, and the reading that proves it. A wrong device and a tripped watchdog
end it: both are faults that need a person. A watchdog that does not arm is a fault too, unless the rig accepts to have none.
Pure: answers in, the next question out.
"""

from collections import deque

from gateway.codes.faults import FaultCode
from gateway.devices import OutputHost
from gateway.devices.device_checks.watchdog import WatchdogState
from gateway.devices.messages import DeviceAnswer, DeviceStep

_LOOK_PERIOD_S = 1.0  # between two looks at the watchdog: a device that was off for a moment has forgotten its arming
_AGAIN_S, _LOOKS_AGAIN = 0.1, 2  # a look whose answer was lost is repeated soon, so often at most
_WAITS_S = 0.5  # of a look for an idle wire: on a slow one a setpoint that never rests leaves none
_STATES_PER_TIME = 9  # looks at the state for one at the time: an armed one may watch with another than ours
_TRIES = 3  # of arming; then it does not arm
_READS_OTHERWISE = "it reads back otherwise"
_MISSES = 5  # of one question in a row, while settings are answered: the device has no words for it


class DeviceChecks:
    """next_step: the question that is due; fault: what keeps the output from being enabled; said: the device's own words for
    it; is_done: all is asked and well; times_forgotten: how often a look found an armed watchdog off, or with another time;
    unarmed: the device's words where it does not arm and the rig accepts that. is_waived: the rig accepts an output
    without a watchdog."""

    def __init__(self, host: OutputHost, *, is_waived: bool) -> None:
        self._known = host.checks
        self._is_waived = is_waived
        self.has_watchdog = DeviceStep.ARM in self._known
        is_timed_apart = DeviceStep.SET_TIME in self._known  # then the time alone does not say that it watches
        self._is_proved_by_state = is_timed_apart or DeviceStep.VERIFY not in self._known
        proof = (DeviceStep.VERIFY, DeviceStep.STATUS) if self._is_proved_by_state else (DeviceStep.VERIFY,)
        self._arming = self._known_of(DeviceStep.SET_TIME, DeviceStep.ARM, *proof) if self.has_watchdog else ()
        self.times_forgotten = 0
        self.begin()

    def begin(self) -> None:
        """Begin anew: the port has been opened, or nothing was heard for long, and another device may be behind it."""
        self._waiting = deque(self._known_of(DeviceStep.IDENTITY, DeviceStep.STATUS, *self._arming))
        known = self._known_of(DeviceStep.STATUS, DeviceStep.VERIFY)
        self._looks = deque((*_STATES_PER_TIME * known[:1], *known[1:]))
        self._tries = self._misses = 0
        self._next_look_s = self._looked_s = 0.0
        self._unheard = 0
        self.fault = FaultCode.NONE
        self.said = self.unarmed = ""
        self.is_armed = self.is_tripped = self._is_said = False
        self._settle()

    def _settle(self) -> None:
        self.is_done = not self._waiting and not self.fault

    def _known_of(self, *steps: DeviceStep) -> tuple[DeviceStep, ...]:
        return tuple(step for step in steps if step in self._known)

    def next_step(self, now_s: float) -> DeviceStep | None:
        """Return the question that is due, None where there is none."""
        if self._waiting:
            return self._waiting[0]
        if self._looks and now_s >= self._next_look_s and self.fault in _GOES_ON:
            self._looked_s, self._unheard = now_s, self._unheard + 1
            self._next_look_s = now_s + (_AGAIN_S if self._unheard <= _LOOKS_AGAIN else _LOOK_PERIOD_S)
            if not self._is_said:
                self._looks.rotate(-1)
            return self._looks[0]
        return None

    def is_late(self, now_s: float) -> bool:
        """Decide whether a question is due that has waited for an idle wire for long enough, or that arms the watchdog anew."""
        late_s = self._next_look_s + (0.0 if self._unheard else _WAITS_S)
        is_look_late = bool(self._looks) and self.fault in _GOES_ON and now_s >= late_s
        return bool(self._waiting) or is_look_late

    def trip(self) -> None:
        """Note that the device's watchdog has tripped: it said so in place of an answer. Where its clearing waits already, that
        was a setting of before the reset."""
        if DeviceStep.CLEAR in self._waiting:
            return
        self.is_armed, self.is_tripped = False, True
        self.fault, self.said = FaultCode.WATCHDOG_TRIPPED, ""
        self._waiting.clear()
        self._settle()

    def clear(self) -> None:
        """Clear a tripped watchdog and arm it again: somebody has asked for it, by a reset."""
        if self.fault is FaultCode.WATCHDOG_TRIPPED:
            self.fault = FaultCode.NONE
            self.is_tripped = (
                DeviceStep.CLEAR in self._known
            )  # lasts until that is answered; without it any setting ends it
            self._tries, self._is_said = 0, False
            cleared = (DeviceStep.CLEAR, DeviceStep.STATUS, *self._arming)
            rearmed = (
                *self._arming,
                DeviceStep.STATUS,
            )  # asked ahead, it would say tripped: some obey when they are armed anew
            self._waiting = deque(self._known_of(*(cleared if self.is_tripped else rearmed)))
        elif self.fault in _ASKED_AGAIN:
            self.begin()
        self._settle()

    def take(self, answer: DeviceAnswer) -> None:
        """Follow an answer."""
        is_due = bool(self._waiting) and self._waiting[0] is answer.step
        self._note_heard()
        if is_due:
            self._waiting.popleft()
        if answer.step is DeviceStep.IDENTITY and not answer.is_right:
            self.fault, self.said = FaultCode.WRONG_DEVICE, answer.text
            self._waiting.clear()
        elif answer.step is DeviceStep.CLEAR:
            self.is_tripped = False
        elif answer.step is DeviceStep.STATUS:
            if DeviceStep.CLEAR not in self._waiting:  # else it was asked before the reset
                self._take_state(WatchdogState(answer.text), is_due=is_due)
        elif self.is_tripped:
            pass  # until it is cleared: its time reads back as before
        elif answer.step is DeviceStep.VERIFY and not (answer.is_right and self._is_proved_by_state):
            self._take_proof(is_armed=answer.is_right)
        self._settle()

    def refuse(self, step: DeviceStep, words: str) -> None:
        """Follow a refusal in the device's own words."""
        self._note_heard()
        if self._waiting and self._waiting[0] is step:
            self._waiting.popleft()
        if step is DeviceStep.IDENTITY:
            self.fault, self.said = FaultCode.WRONG_DEVICE, words
            self._waiting.clear()
        elif step is DeviceStep.CLEAR:
            self.trip()
        elif (step in _ARMS or (step is DeviceStep.STATUS and self._is_proof)) and not self.is_tripped:
            self._take_proof(is_armed=False, words=words)
        self._settle()

    def _note_heard(self) -> None:
        if self._unheard:
            self._next_look_s = self._looked_s + _LOOK_PERIOD_S
        self._misses = self._unheard = 0

    def miss(self, step: DeviceStep) -> None:
        """Follow a question that was not answered in its time. A device that has no words for it may not say so: else it would
        be asked for ever, and nobody told what keeps the output."""
        self._misses += bool(self._waiting) and self._waiting[0] is step
        if self._misses >= _MISSES:
            self.refuse(step, f"nothing that the profile knows, asked for its {step}")

    @property
    def _is_proof(self) -> bool:
        """Whether the state that was asked for last is what tells that it watches."""
        return self._is_proved_by_state and not self._waiting

    def _take_state(self, state: WatchdogState, *, is_due: bool) -> None:
        """One spoiled digit makes a trip of an armed one: it is believed when it is said twice."""
        was_said, self._is_said = self._is_said, state is WatchdogState.TRIPPED
        if self._is_said and was_said:
            self.trip()
        elif self._is_said:
            self._waiting.extendleft([DeviceStep.STATUS] if is_due else [])
            self._next_look_s = 0.0
        elif not self._waiting and not self.is_tripped and (self._is_proved_by_state or state is WatchdogState.OFF):
            self._take_proof(is_armed=state is WatchdogState.ARMED)  # after arming, and whenever it is looked at

    def _take_proof(self, *, is_armed: bool, words: str = "") -> None:
        self.times_forgotten += self.is_armed and not (is_armed or words)
        self.is_armed = is_armed
        if is_armed:
            self._tries, self.unarmed = 0, ""
            self.fault = FaultCode.NONE
            return
        self._tries += 1
        if self._tries < _TRIES:
            self._waiting = deque(self._arming)
        elif self._is_waived:
            self.unarmed = words or _READS_OTHERWISE
        else:
            self.fault, self.said = FaultCode.WATCHDOG_NOT_ARMED, words or _READS_OTHERWISE
            self._waiting.clear()


_ASKED_AGAIN = (FaultCode.WATCHDOG_NOT_ARMED, FaultCode.WRONG_DEVICE)  # an answer may have been another question's
_ARMS = (DeviceStep.SET_TIME, DeviceStep.ARM, DeviceStep.VERIFY)
_GOES_ON = (FaultCode.NONE, FaultCode.WATCHDOG_TRIPPED)
