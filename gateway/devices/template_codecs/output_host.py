"""Our end of the line to an output device whose sentences are templates.

Answers are matched to requests in order, because `512` alone does not say whether it echoes a setting or is a pressure.
A device that says nothing to a setting is asked for it in the same breath: that answer is the setting's.
A line that answers nothing we asked is garbage. A garbled line while several answers are awaited makes their order unsure:
then none of them is believed, and the caller's timeout asks again. What is never done: guess.
"""

from collections import deque
from math import isclose
from typing import Final

from gateway.devices.binary.rtu_framing import RtuSplitter, exception_text, quiet_s
from gateway.devices.device_checks.spelling import CheckSpelling
from gateway.devices.exchange import Exchange, VoltageExchange
from gateway.devices.framing import Line
from gateway.devices.grammar import Grammar
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceStep,
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
from gateway.devices.template_codecs.reply_form import reply_form
from gateway.devices.template_codecs.voltage_sentence import VoltageSentence

_PRESSURE_BEYOND: Final = 1 / 3
"""Of its range: a sensor without pressure reads a little less than 0, and more than its end while the pressure overshoots.
Taken for garbage, the first would be a silent device for as long as nothing presses."""
_ROUNDING: Final = 0.6  # of a step: half of it is the device's rounding, the rest its arithmetic


class TemplateOutputHost:
    """See roles.OutputHost."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._grammar = grammar = Grammar(profile)
        self._lines = grammar.answers()
        self._checks = CheckSpelling(grammar)
        self._expected: deque[OutputRequest] = deque()
        self._asked = b""
        watchdog = profile.own_watchdog
        self._tripped = grammar.encode(watchdog.refusal) if watchdog and watchdog.refusal else None
        self.sign_of_life = grammar.question_line(grammar.encode(watchdog.feed)) if watchdog and watchdog.feed else b""
        self.feed_period_s = watchdog.feed_period_s if watchdog else 0.0
        self.checks = self._checks.steps()
        self.gap_s = quiet_s(profile.serial.character_s) if profile.is_modbus else 0.0
        self._safe_v = profile.voltage_range_v[0]
        self._confirmation = profile.confirmation
        self._setting = VoltageSentence(grammar)
        self._is_read_back = self._confirmation is not grammar.set_voltage
        self._questions: dict[str, bytes] = {}  # by template: they carry no number
        self.idle_questions = _idle_questions(profile)
        self.resolution_v = self._step_v(self._grammar.set_voltage, self._grammar.set_voltage.ask)
        self._tolerance_v: dict[type, float] = {SetVoltage: _ROUNDING * self._steps_between(self._confirmation)}
        if profile.read_voltage:
            self._tolerance_v[ReadVoltage] = _ROUNDING * self._steps_between(profile.read_voltage)

    @property
    def hears_itself(self) -> bool:
        """Decide whether the adapter has brought our own words back, as far as answers could be told from them."""
        return isinstance(self._lines, RtuSplitter) and self._lines.hears_itself

    @property
    def safe_reply(self) -> bytes:
        """Return the line that confirms the safe voltage."""
        return self._grammar.answer_line(self._confirmation, self._safe_v)

    @property
    def safe_reply_form(self) -> bytes:
        """Return an expression of that line without its end, where it may be spelt in other bytes; else nothing."""
        return reply_form(self._grammar, self._confirmation, self._safe_v).encode("ascii")

    def confirms(self, voltage_v: float, reply: Accepted, question: OutputRequest) -> bool:
        """Decide whether a reply repeats this voltage, within the device's rounding."""
        return abs(reply.voltage_v - voltage_v) <= self._tolerance_v[type(question)]

    def safe_frame(self, voltage_v: float) -> bytes:
        """Return the request that sets the safe voltage, and remember the voltage for `safe_reply`."""
        frame = self._encode_request(SetVoltage(voltage_v))
        self._safe_v = voltage_v
        return frame

    @property
    def last_frame(self) -> bytes:
        """Return what follows the last safe frame: the watchdog is switched off, for nobody will feed it."""
        return self._encode_request(AskDevice(DeviceStep.DISARM)) if DeviceStep.DISARM in self.checks else b""

    def request(self, message: OutputRequest) -> bytes:
        """Return the bytes of a request, and expect its answer. ValueRefused for a voltage that the device cannot be sent."""
        data = self._encode_request(message)
        if not self._expected:
            self._lines.forget()  # bytes that came before the question are no part of its answer
        self._expected.append(message)
        self._asked = data
        self._grammar.expect_own_words(self._lines, data)
        return data

    def expect(self, message: OutputRequest) -> None:
        """Expect the answer of a request that is out already."""
        self._expected.append(message)

    def forget(self) -> None:
        """Drop half a line and every answer still expected."""
        self._lines.forget()
        self._expected.clear()

    def receive(self, chunk: bytes, now_s: float) -> list[OutputReply]:
        """Return the replies that these bytes complete, without our own words. now_s: time of their arrival."""
        replies = (self._reply(line) for line in self._lines.feed(chunk))
        return [reply for reply in replies if reply is not None]

    def _encode_request(self, message: OutputRequest) -> bytes:
        if isinstance(message, AskDevice):
            return self._grammar.question_line(self._checks.ask(message.step))
        if not isinstance(message, SetVoltage):
            return self._question(self._grammar.exchange(message).ask)
        setting = self._setting.spell(message.voltage_v)
        return setting + self._question(self._confirmation.ask) if self._is_read_back else setting

    def _question(self, template: str) -> bytes:
        if template not in self._questions:
            self._questions[template] = self._grammar.question_line(self._grammar.number_body(template, 0.0))
        return self._questions[template]

    def _step_v(self, exchange: VoltageExchange, template: str) -> float:
        """What one count of the number in this template means at most, V; 0 where it carries none."""
        return exchange.range.scale.physical_per_number * self._grammar.step(exchange, template)

    def _steps_between(self, answered: VoltageExchange) -> float:
        """V: a setting is rounded once on its way, and once more where the answer counts in other numbers."""
        step_v = self._step_v(answered, answered.answer)
        same = isclose(step_v, self.resolution_v) and answered.range == self._grammar.set_voltage.range
        return self.resolution_v + (0.0 if same else step_v)

    def _reply(self, line: Line) -> OutputReply | None:
        reply = self._decode_reply(self._grammar.body(line, self._asked)) if self._expected else None
        if reply is not None:
            self._expected.popleft()
            return reply
        if line.data in self._grammar.own_lines(self._asked) or self._grammar.is_read_over(line):
            return None  # an adapter has heard us, or the device says something besides: it is no noise
        if len(self._expected) > 1:
            self._expected.clear()
        return Garbage(line.data)

    def _decode_reply(self, body: bytes | None) -> OutputReply | None:
        request = self._expected[0]
        if isinstance(request, AskDevice):
            answer = self._checks.answer(request.step, body)
            return answer if answer or body is None else self._refusal(body)
        if body is not None and body == self._tripped and isinstance(request, SetVoltage):
            return WatchdogTripped()
        if body is not None and (refused := self._refusal(body)):
            return refused
        exchange = self._confirmation if isinstance(request, SetVoltage) else self._grammar.exchange(request)
        values = self._grammar.read(exchange.answer, body)
        if values is None:
            return None
        number = self._grammar.number(exchange.answer, values)
        if number is None:  # the device says only that it obeyed
            return Accepted(request.voltage_v) if isinstance(request, SetVoltage) else None
        if not exchange.range.scale.carries(number, self._slack(request, exchange)):
            return None
        value = exchange.range.scale.to_physical(number)
        return Pressure(value) if isinstance(request, ReadPressure) else Accepted(value)

    def _slack(self, request: OutputRequest, exchange: Exchange) -> float:
        """How far beyond its range the device's number may be: a setting by its rounding, a measured pressure by much more."""
        low, high = exchange.range.device
        beyond = _PRESSURE_BEYOND * (high - low) if isinstance(request, ReadPressure) else 0.0
        return beyond + 0.5 * self._grammar.step(exchange, exchange.answer)

    def _refusal(self, body: bytes) -> Refused | None:
        text = self._grammar.refusal(body) or (exception_text(body) if self._grammar.profile.is_modbus else "")
        return Refused(text) if text else None


def _idle_questions(profile: DeviceProfile) -> tuple[OutputRequest, ...]:
    """The pressure, else the setting; both where nothing is answered to a setting, or that it was obeyed, but not with which
    number."""
    answer = profile.set_voltage.answer if profile.set_voltage else ""
    is_unread = not answer or profile.number_in(answer) is None
    questions: list[OutputRequest] = [ReadPressure()] if profile.read_pressure else []
    return (*questions, ReadVoltage()) if profile.read_voltage and (is_unread or not questions) else tuple(questions)
