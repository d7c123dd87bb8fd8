"""Both ends of the line to an output device whose sentences are templates.

Answers are matched to requests in order, because `512` alone does not say whether it echoes a setting or is a pressure.
A line that answers nothing we asked is garbage. A garbled line while several answers are awaited makes their order unsure:
then none of them is believed, and the caller's timeout asks again. What is never done: guess.
"""

from collections import deque

from gateway.devices.exchange import Scale
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


class TemplateOutputHost:
    """See roles.OutputHost."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._grammar = Grammar(profile)
        self._lines = LineSplitter(profile.terminator_bytes)
        self._expected: deque[OutputRequest] = deque()
        self._refusals = {text.encode("ascii"): text for text in profile.refusals.texts()}
        self._safe_v = 0.0
        exchange = self._grammar.set_voltage
        self.resolution_v = exchange.range.scale.physical_per_number * 10.0 ** -profile.decimals_in(exchange.ask)

    @property
    def expecting(self) -> int:
        return len(self._expected)

    @property
    def safe_reply(self) -> bytes:
        return self._grammar.number_line(self._grammar.set_voltage.answer, self._grammar.setting(self._safe_v))

    def safe_frame(self, voltage_v: float) -> bytes:
        frame = self._encoded(SetVoltage(voltage_v))
        self._safe_v = voltage_v
        return frame

    def request(self, message: OutputRequest) -> bytes:
        data = self._encoded(message)
        if not self._expected:
            self._lines.forget()  # bytes that came before the question are no part of its answer
        self._expected.append(message)
        return data

    def forget(self) -> None:
        self._lines.forget()
        self._expected.clear()

    def receive(self, chunk: bytes, now_s: float) -> list[OutputReply]:
        return [self._reply(line) for line in self._lines.feed(chunk)]

    def _encoded(self, message: OutputRequest) -> bytes:
        exchange = self._grammar.exchange(message)
        number = self._grammar.setting(message.voltage_v) if isinstance(message, SetVoltage) else 0.0
        return self._grammar.number_line(exchange.ask, number)

    def _reply(self, line: Line) -> OutputReply:
        reply = self._understood(self._grammar.body(line)) if self._expected else None
        if reply is not None:
            self._expected.popleft()
            return reply
        if len(self._expected) > 1:
            self._expected.clear()
        return Garbage(line.data)

    def _understood(self, body: bytes | None) -> OutputReply | None:
        if body is not None and body in self._refusals:
            return Refused(self._refusals[body])
        asked = self._expected[0]
        exchange = self._grammar.exchange(asked)
        values = self._grammar.read(exchange.answer, body)
        if values is None:
            return None
        number = self._grammar.number(exchange.answer, values)
        if number is None:  # the device says only that it obeyed
            return Accepted(asked.voltage_v) if isinstance(asked, SetVoltage) else None
        return _answer(asked, exchange.range.scale, number)


def _answer(asked: OutputRequest, scale: Scale, number: float) -> OutputReply | None:
    if not scale.carries(number):
        return None
    value = scale.to_physical(number)
    return Pressure(value) if isinstance(asked, ReadPressure) else Accepted(value)


class TemplateOutputDevice:
    """See roles.OutputDevice. It knows its own setting, in the device's numbers, because steps move it."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._grammar = Grammar(profile)
        self._profile = profile
        self._lines = LineSplitter(profile.terminator_bytes)
        self._scale = self._grammar.set_voltage.range.scale
        self._setting = self._scale.device[0]

    def receive(self, chunk: bytes, now_s: float) -> list[OutputRequest | Garbage]:
        return [self._request(line) for line in self._lines.feed(chunk)]

    def reply(self, reply: OutputReply, to: OutputRequest | None = None) -> bytes:
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
        refusals = self._profile.refusals
        number = self._asked_number(garbage)
        beyond = refusals.out_of_range
        if beyond and number is not None and beyond.numbers[0] <= number <= beyond.numbers[1]:
            return Refused(beyond.text)
        return Refused(refusals.unknown)

    def _number(self, question: OutputRequest, value: float) -> bytes:
        """The answer with this value in it; a sensor or a setting stops at the ends of its range."""
        exchange = self._grammar.exchange(question)
        low, high = exchange.range.scale.device
        number = exchange.range.scale.to_number(value)
        return self._grammar.number_line(exchange.answer, min(high, max(low, number)))

    def _asked_number(self, garbage: Garbage) -> float | None:
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
            number = self._stepped(body)
        if number is not None and self._scale.carries(number):
            self._setting = number
            return SetVoltage(self._scale.to_physical(number))
        return self._question(body) or Garbage(line.data)

    def _question(self, body: bytes | None) -> OutputRequest | None:
        profile = self._profile
        for message, exchange in ((ReadVoltage(), profile.read_voltage), (ReadPressure(), profile.read_pressure)):
            if exchange and self._grammar.read(exchange.ask, body) is not None:
                return message
        return None

    def _stepped(self, body: bytes | None) -> float | None:
        """The setting after INC or DEC; it stays within the range (what the real device does there is not documented)."""
        for step in self._profile.steps:
            if self._grammar.read(step.ask, body) is not None:
                return min(self._scale.device[1], max(self._scale.device[0], self._setting + step.by))
        return None
