"""The device's end of the line to an output device whose sentences are templates, for the simulated rig and for tests."""

from gateway.devices.binary.rtu_framing import EXCEPTIONS, exception_body
from gateway.devices.device_checks.simulated_watchdog import SimulatedWatchdog
from gateway.devices.device_checks.spelling import CheckSpelling
from gateway.devices.device_checks.watchdog import WatchdogState
from gateway.devices.framing import Line
from gateway.devices.grammar import Grammar
from gateway.devices.messages import (
    Accepted,
    DeviceAnswer,
    Garbage,
    OutputReply,
    OutputRequest,
    Pressure,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
    WatchdogTripped,
)
from gateway.devices.profile import DeviceProfile

_ILLEGAL_FUNCTION, _ILLEGAL_ADDRESS, _ILLEGAL_VALUE, _DEVICE_FAILURE = 1, 2, 3, 4


class TemplateOutputDevice:
    """See roles.OutputDevice. It knows its own setting, in the device's numbers, because steps move it."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._grammar = Grammar(profile)
        self._profile = profile
        self._lines = self._grammar.questions()
        self._checks = CheckSpelling(self._grammar)
        watchdog = profile.own_watchdog
        self.watchdog = SimulatedWatchdog(watchdog) if watchdog else None
        self._feed = self._grammar.encode(watchdog.feed) if watchdog and watchdog.feed else None
        self._function = self._grammar.set_voltage.ask[:2].encode("ascii")  # of the last Modbus request
        self._scale = self._grammar.set_voltage.range.scale
        self._setting = self._scale.device[0]

    def receive(self, chunk: bytes, now_s: float) -> list[OutputRequest | Garbage]:
        """Return the requests and the garbage that these bytes complete. now_s: of their arrival, for the watchdog."""
        self.elapse(now_s)
        heard = [self._hear(line, now_s) for line in self._lines.feed(chunk)]
        return [one for one in heard if one is not None]

    def elapse(self, now_s: float) -> bool:
        """Let time pass; return whether the device's watchdog trips now and the output goes to its safe value."""
        return self.watchdog is not None and self.watchdog.elapse(now_s)

    @property
    def is_tripped(self) -> bool:
        """Decide whether the device obeys no setting, for its watchdog has tripped."""
        return self.watchdog is not None and self.watchdog.state is WatchdogState.TRIPPED

    def _hear(self, line: Line, now_s: float) -> OutputRequest | Garbage | None:
        """One sentence; None for a sign of life, which is not answered."""
        body = self._grammar.body(line)
        self._function = body[:2] if body else self._function
        if self.watchdog and body is not None:
            if self._feed is None or body == self._feed:
                self.watchdog.feed(now_s)
            if body == self._feed:
                return None
            if asked := self._checks.asked(body):
                self.watchdog.do(asked.step, self._checks.asked_ticks(body), now_s)
        return self._request(line)

    def reply(self, reply: OutputReply, to: OutputRequest | None = None) -> bytes:
        """Return the bytes of a reply; to: the request that it answers."""
        match reply:
            case WatchdogTripped():
                return self.reply(Refused(self._tripped_words))
            case DeviceAnswer(step):
                state = self.watchdog.state if self.watchdog else WatchdogState.OFF
                return self._grammar.line(self._checks.reply(step, state, self.watchdog.ticks if self.watchdog else 0))
            case Accepted(voltage_v):
                return self._number(to or SetVoltage(voltage_v), voltage_v)
            case Pressure(pressure_pa):
                return self._number(ReadPressure(), pressure_pa)
            case Refused(text):
                return self._refused(text)
            case Garbage(data):
                return data

    def refusal(self, garbage: Garbage) -> Refused:
        """Return the refusal that the device gives for this garbage."""
        refusals = self._profile.refusals
        if self._profile.is_modbus:
            return Refused(self._exception(garbage))
        number = self._number_in(garbage)
        if self.is_tripped and number is not None:
            return Refused(self._tripped_words)
        beyond = refusals.out_of_range
        if beyond and number is not None and beyond.numbers[0] <= number <= beyond.numbers[1]:
            return Refused(self._grammar.words(beyond.text))
        return Refused(self._grammar.words(refusals.unknown))

    @property
    def _tripped_words(self) -> str:
        watchdog = self._profile.own_watchdog
        return self._grammar.words(watchdog.refusal) if watchdog else ""

    def _exception(self, garbage: Garbage) -> str:
        """The exception that a Modbus device answers with; nothing to noise, or to another unit."""
        lines = self._grammar.questions().feed(garbage.data)
        body = self._grammar.body(lines[0]) if len(lines) == 1 else None
        if body is None:
            return ""
        if self._set_number(body) is not None:
            return EXCEPTIONS[_ILLEGAL_VALUE]
        exchanges = (self._profile.set_voltage, self._profile.read_voltage, self._profile.read_pressure)
        known = {exchange.ask[:2].encode("ascii") for exchange in exchanges if exchange}
        return EXCEPTIONS[_ILLEGAL_ADDRESS if body[:2] in known else _ILLEGAL_FUNCTION]

    def _refused(self, text: str) -> bytes:
        if not text:
            return b""
        if not self._profile.is_modbus:
            return self._grammar.line(text.encode("ascii"))
        code = next((code for code, words in EXCEPTIONS.items() if words in text), _DEVICE_FAILURE)
        return self._grammar.line(exception_body(self._function, code))

    def _number(self, question: OutputRequest, value: float) -> bytes:
        """The answer with this value in it; nothing where the device says nothing."""
        exchange = self._grammar.exchange(question)
        return self._grammar.answer_line(exchange, value) if exchange.answer else b""

    def _number_in(self, garbage: Garbage) -> float | None:
        lines = self._grammar.questions().feed(garbage.data)
        return self._set_number(self._grammar.body(lines[0])) if len(lines) == 1 else None

    def _set_number(self, body: bytes | None) -> float | None:
        ask = self._grammar.set_voltage.ask
        values = self._grammar.read(ask, body)
        return self._grammar.number(ask, values) if values is not None else None

    def _request(self, line: Line) -> OutputRequest | Garbage:
        body = self._grammar.body(line)
        number = self._set_number(body)
        if number is None:
            number = self._setting_after_step(body)
        setting = self._grammar.set_voltage
        if number is not None and self._scale.carries(number, 0.5 * self._grammar.step(setting, setting.ask)):
            if self.is_tripped:
                return Garbage(line.data)
            self._setting = number
            return SetVoltage(self._scale.to_physical(number))
        return self._question(body) or self._checks.asked(body) or Garbage(line.data)

    def _question(self, body: bytes | None) -> OutputRequest | None:
        profile = self._profile
        for message, exchange in ((ReadVoltage(), profile.read_voltage), (ReadPressure(), profile.read_pressure)):
            if exchange and self._grammar.read(exchange.ask, body) is not None:
                return message
        return None

    def _setting_after_step(self, body: bytes | None) -> float | None:
        """The setting after INC or DEC; it stays within the range (what the real device does there is not documented)."""
        for step in self._profile.steps:
            if self._grammar.read(step.ask, body) is not None:
                return min(self._scale.device[1], max(self._scale.device[0], self._setting + step.by))
        return None
