"""How identity and watchdog are asked for and answered in a profile's own sentences, both ends."""

from dataclasses import dataclass
from typing import Final

from gateway.devices.device_checks.watchdog import STATE, TIME, Watchdog, WatchdogExchange, WatchdogState
from gateway.devices.fields import Value, ValueRefused
from gateway.devices.grammar import Grammar
from gateway.devices.messages import AskDevice, DeviceAnswer, DeviceStep

_EXCHANGES: Final = {
    DeviceStep.VERIFY: "verify",
    DeviceStep.SET_TIME: "set_time",
    DeviceStep.ARM: "arm",
    DeviceStep.DISARM: "disarm",
    DeviceStep.CLEAR: "clear",
}


@dataclass(frozen=True, slots=True)
class CheckSpelling:
    """Sentences of identity and watchdog for a device's profile."""

    grammar: Grammar

    @property
    def _watchdog(self) -> Watchdog | None:
        return self.grammar.profile.own_watchdog

    def steps(self) -> tuple[DeviceStep, ...]:
        """Return the questions that this device can be asked."""
        profile, watchdog = self.grammar.profile, self._watchdog
        known = [DeviceStep.IDENTITY] if profile.own_identity else []
        if watchdog:
            known += [DeviceStep.STATUS] if watchdog.status else []
            known += [step for step, name in _EXCHANGES.items() if getattr(watchdog, name)]
        return tuple(known)

    def ask(self, step: DeviceStep) -> bytes:
        """Return the sentence of a question. ValueRefused where the device has no words for it."""
        if step not in self.steps():
            raise ValueRefused(f"{self.grammar.profile.name} has no words for its {step}")
        return self.grammar.encode(self._ask(step), self._time())

    def ask_cell_identity(self) -> bytes:
        """Return what asks a load cell what it is, behind the sentence that opens it on its bus."""
        identity = self.grammar.profile.own_identity
        return self.grammar.cell_question(identity.ask) if identity else b""

    def answer(self, step: DeviceStep, body: bytes | None) -> DeviceAnswer | None:
        """Return what an answer says, None where it is none of this question's."""
        read = self.grammar.read
        identity = self.grammar.profile.own_identity
        if step is DeviceStep.IDENTITY and identity:
            values = read(identity.answer, body)
            return (
                None
                if values is None
                else DeviceAnswer(step, identity.is_right(identity.said(values)), identity.said(values))
            )
        watchdog = self._watchdog
        assert watchdog
        if step is DeviceStep.STATUS and watchdog.status:
            values = read(watchdog.status.answer, body)
            if values is None:
                return None
            state = watchdog.status.words[str(values[STATE])]
            return DeviceAnswer(step, state is WatchdogState.ARMED, state.value)
        return self._done(step, getattr(watchdog, _EXCHANGES[step]), body)

    def _done(self, step: DeviceStep, exchange: WatchdogExchange, body: bytes | None) -> DeviceAnswer | None:
        for template in filter(None, (exchange.answer, exchange.or_answer)):
            values = self.grammar.read(template, body)
            if values is not None:
                ticks = values.get(TIME)
                return DeviceAnswer(
                    step, ticks is None or ticks == self._time()[TIME], "" if ticks is None else str(ticks)
                )
        return None

    def _time(self) -> dict[str, Value]:
        return {TIME: self._watchdog.ticks} if self._watchdog else {}

    def _ask(self, step: DeviceStep) -> str:
        identity, watchdog = self.grammar.profile.own_identity, self._watchdog
        if step is DeviceStep.IDENTITY and identity:
            return identity.ask
        assert watchdog
        if step is DeviceStep.STATUS and watchdog.status:
            return watchdog.status.ask
        exchange: WatchdogExchange = getattr(watchdog, _EXCHANGES[step])
        return exchange.ask

    # -- the device's end

    def asked(self, body: bytes | None) -> AskDevice | None:
        """Return which question a sentence is. Switching off comes first: it may be an arming with the time 0."""
        steps = sorted(self.steps(), key=lambda step: step is not DeviceStep.DISARM)
        return next((AskDevice(step) for step in steps if self.grammar.read(self._ask(step), body) is not None), None)

    def asked_ticks(self, body: bytes | None) -> int | None:
        """Return the time that a sentence to the watchdog carries, in ticks."""
        values = self.grammar.read(self._watchdog.timing.ask, body) if self._watchdog else None
        return None if values is None else int(values[TIME])

    def reply(self, step: DeviceStep, state: WatchdogState, ticks: int) -> bytes:
        """Return the device's answer to a question, by the state of its watchdog."""
        identity, watchdog = self.grammar.profile.own_identity, self._watchdog
        if step is DeviceStep.IDENTITY and identity:
            return self.grammar.encode_filled(identity.answer, identity.example)
        assert watchdog
        if step is DeviceStep.STATUS and watchdog.status:
            word = watchdog.status.word(state) or watchdog.status.word(WatchdogState.OFF)
            return self.grammar.encode(watchdog.status.answer, {STATE: word or next(iter(watchdog.status.words))})
        exchange: WatchdogExchange = getattr(watchdog, _EXCHANGES[step])
        return self.grammar.encode_filled(exchange.answer, {TIME: ticks})
