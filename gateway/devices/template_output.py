"""Both ends of the line to an output device whose sentences are templates.

Answers are matched to requests in order, because `512` alone does not say whether it echoes a setting or is a pressure.
A device that says nothing to a setting is asked for it in the same breath: that answer is the setting's.
A line that answers nothing we asked is garbage. A garbled line while several answers are awaited makes their order unsure:
then none of them is believed, and the caller's timeout asks again. What is never done: guess.
"""

from collections import deque
from math import isclose
from typing import Final

from gateway.devices.exchange import VoltageExchange
from gateway.devices.framing import Line, LineSplitter
from gateway.devices.grammar import Grammar
from gateway.devices.messages import (
    Accepted,
    Garbage,
    OutputReply,
    OutputRequest,
    Pressure,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
)
from gateway.devices.profile import DeviceProfile

_ROUNDING: Final = 0.6  # of a step: half of it is the device's rounding, the rest its arithmetic


class TemplateOutputHost:
    """See roles.OutputHost."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._grammar = Grammar(profile)
        self._lines = LineSplitter(profile.terminator_bytes)
        self._expected: deque[OutputRequest] = deque()
        self._refusals = {text.encode("ascii"): text for text in profile.refusals.texts()}
        self._safe_v = profile.voltage_range_v[0]
        self._confirmation = profile.confirmation
        self._is_read_back = self._confirmation is not self._grammar.set_voltage
        self.idle_question = _idle_question(profile)
        self.resolution_v = self._step_v(self._grammar.set_voltage, self._grammar.set_voltage.ask)
        self._tolerance_v: dict[type, float] = {SetVoltage: _ROUNDING * self._steps_between(self._confirmation)}
        if profile.read_voltage:
            self._tolerance_v[ReadVoltage] = _ROUNDING * self._steps_between(profile.read_voltage)

    @property
    def safe_reply(self) -> bytes:
        """Return the line that confirms the safe voltage."""
        return self._grammar.answer_line(self._confirmation, self._safe_v)

    def confirms(self, voltage_v: float, reply: Accepted, question: OutputRequest) -> bool:
        """Decide whether a reply repeats this voltage, within the device's rounding."""
        return abs(reply.voltage_v - voltage_v) <= self._tolerance_v[type(question)]

    def safe_frame(self, voltage_v: float) -> bytes:
        """Return the request that sets the safe voltage, and remember the voltage for `safe_reply`."""
        frame = self._encode_request(SetVoltage(voltage_v))
        self._safe_v = voltage_v
        return frame

    def request(self, message: OutputRequest) -> bytes:
        """Return the bytes of a request, and expect its answer. ValueRefused for a voltage that the device cannot be sent."""
        data = self._encode_request(message)
        if not self._expected:
            self._lines.forget()  # bytes that came before the question are no part of its answer
        self._expected.append(message)
        return data

    def forget(self) -> None:
        """Drop half a line and every answer still expected."""
        self._lines.forget()
        self._expected.clear()

    def receive(self, chunk: bytes, now_s: float) -> list[OutputReply]:
        """Return the replies that these bytes complete. now_s: time of their arrival."""
        return [self._reply(line) for line in self._lines.feed(chunk)]

    def _encode_request(self, message: OutputRequest) -> bytes:
        if not isinstance(message, SetVoltage):
            return self._grammar.number_line(self._grammar.exchange(message).ask, 0.0)
        setting = self._grammar.number_line(self._grammar.set_voltage.ask, self._grammar.setting(message.voltage_v))
        return setting + (self._grammar.number_line(self._confirmation.ask, 0.0) if self._is_read_back else b"")

    def _step_v(self, exchange: VoltageExchange, template: str) -> float:
        """What one count of the number in this template means, V; 0 where it carries none."""
        if self._grammar.profile.number_in(template) is None:
            return 0.0
        return exchange.range.scale.physical_per_number * float(10.0 ** -self._grammar.profile.decimals_in(template))

    def _steps_between(self, answered: VoltageExchange) -> float:
        """V: a setting is rounded once on its way, and once more where the answer counts in other numbers."""
        step_v = self._step_v(answered, answered.answer)
        same = isclose(step_v, self.resolution_v) and answered.range == self._grammar.set_voltage.range
        return self.resolution_v + (0.0 if same else step_v)

    def _reply(self, line: Line) -> OutputReply:
        reply = self._decode_reply(self._grammar.body(line)) if self._expected else None
        if reply is not None:
            self._expected.popleft()
            return reply
        if len(self._expected) > 1:
            self._expected.clear()
        return Garbage(line.data)

    def _decode_reply(self, body: bytes | None) -> OutputReply | None:
        if body is not None and body in self._refusals:
            return Refused(self._refusals[body])
        request = self._expected[0]
        exchange = self._confirmation if isinstance(request, SetVoltage) else self._grammar.exchange(request)
        values = self._grammar.read(exchange.answer, body)
        if values is None:
            return None
        number = self._grammar.number(exchange.answer, values)
        if number is None:  # the device says only that it obeyed
            return Accepted(request.voltage_v) if isinstance(request, SetVoltage) else None
        if not exchange.range.scale.carries(number, self._grammar.half_step(exchange.answer)):
            return None
        value = exchange.range.scale.to_physical(number)
        return Pressure(value) if isinstance(request, ReadPressure) else Accepted(value)


def _idle_question(profile: DeviceProfile) -> OutputRequest | None:
    if profile.read_pressure:
        return ReadPressure()
    return ReadVoltage() if profile.read_voltage else None


class TemplateOutputDevice:
    """See roles.OutputDevice. It knows its own setting, in the device's numbers, because steps move it."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._grammar = Grammar(profile)
        self._profile = profile
        self._lines = LineSplitter(profile.terminator_bytes)
        self._scale = self._grammar.set_voltage.range.scale
        self._setting = self._scale.device[0]

    def receive(self, chunk: bytes, now_s: float) -> list[OutputRequest | Garbage]:
        """Return the requests and the garbage that these bytes complete."""
        return [self._request(line) for line in self._lines.feed(chunk)]

    def reply(self, reply: OutputReply, to: OutputRequest | None = None) -> bytes:
        """Return the bytes of a reply; to: the request that it answers."""
        match reply:
            case Accepted(voltage_v):
                return self._number(to or SetVoltage(voltage_v), voltage_v)
            case Pressure(pressure_pa):
                return self._number(ReadPressure(), pressure_pa)
            case Refused(text):
                return self._grammar.line(text.encode("ascii")) if text else b""
            case Garbage(data):
                return data

    def refusal(self, garbage: Garbage) -> Refused:
        """Return the refusal that the device gives for this garbage."""
        refusals = self._profile.refusals
        number = self._number_in(garbage)
        beyond = refusals.out_of_range
        if beyond and number is not None and beyond.numbers[0] <= number <= beyond.numbers[1]:
            return Refused(beyond.text)
        return Refused(refusals.unknown)

    def _number(self, question: OutputRequest, value: float) -> bytes:
        """The answer with this value in it; nothing where the device says nothing."""
        exchange = self._grammar.exchange(question)
        return self._grammar.answer_line(exchange, value) if exchange.answer else b""

    def _number_in(self, garbage: Garbage) -> float | None:
        lines = LineSplitter(self._profile.terminator_bytes).feed(garbage.data)
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
        if number is not None and self._scale.carries(number, self._grammar.half_step(self._grammar.set_voltage.ask)):
            self._setting = number
            return SetVoltage(self._scale.to_physical(number))
        return self._question(body) or Garbage(line.data)

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
