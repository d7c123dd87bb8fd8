"""The output device's line: at most one question on the wire, and of waiting setpoints only the last.

A serial device at 9600 baud takes 15 ms for a setting and its echo, the loop decides every 4-10 ms: a queue would make the
wire an ever older past. Setpoints go before polls; polls fill the idle wire and keep a silent device from going unnoticed:
the pressure where the device measures it, else the setting that stands (both in turn where a setting is answered without its
number), else, of a device that cannot be asked anything, the same setting once more. Time comes in as an argument.

What is done about an answer that comes late, garbled or twice, given_up_questions tells. Behind one the setting is read or
sent anew: the device may have lost its power, and stand where it then begins. What a line that stands still has not sent of
a given-up question is dropped: no older voltage goes out before the safe one.

Between the first setting, which is the safe one, and any other stand the questions of device_checks. A watchdog is fed by a
sentence that nobody answers. A device whose watchdog has tripped obeys no setting until it is cleared; it is told the safe
voltage all the same, for one that only seems to have tripped, by a spoiled answer, still stands where it was.
"""

from collections.abc import Callable, Sequence
from math import inf, nan
from typing import NamedTuple

from gateway.codes.faults import FaultCode
from gateway.control.inputs import WireCounts
from gateway.devices import OutputHost
from gateway.devices.messages import (
    Accepted,
    AskDevice,
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
from gateway.devices.template_codecs.unread_line import explain_answer
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from gateway.service.running_rig.lines.given_up_questions import GivenUpQuestions
from gateway.service.running_rig.lines.repeated_failures import RepeatedFailures

_POLL_PERIOD_S = 0.1
_REPEATED_S = 0.5  # of a setting at rest
_AWAY_S = 0.5  # of silence: what answers then may be another device, or one that was switched on again
_FALLS_FIRST_S = 0.2  # between two questions about the device, of a voltage that falls, but not to where it rests
_AFTER_SIGN_OF_LIFE_S = 0.005  # nothing tells when the device is through with a sentence that it does not answer


class LineState(NamedTuple):
    """What a recording keeps of the line. pressure_pa: last measured; sent_v: the last voltage that was written to the wire,
    and when, sent_s; nan before the first on a port that is open."""

    pressure_pa: float = nan
    sent_v: float = nan
    sent_s: float = nan


class OutputExchange:
    """Asks the device through `write`, keeps what it answered.

    acknowledged_v: confirmed by the device, None before the first; standing_v: surely stands there, None while another one is
    on its way, and where nobody knows; unanswered_since_s: send time of the oldest question without an answer;
    answer_late_s: what the last answer took, where it came after its time, else 0; fault: three failures in a row, or what the
    device's checks have found; pressure_pa: last measured, nan before the first; counts: since the start, whatever reset in
    between. checks: the questions about the device itself, made from the host where none are given.
    """

    def __init__(
        self,
        host: OutputHost,
        write: Callable[[bytes], None],
        reply_timeout_s: float,
        checks: DeviceChecks | None = None,
        rest_v: float = 0.0,
    ) -> None:
        """rest_v: voltage that stands while nothing is wanted."""
        self._host, self._rest_v = host, rest_v
        self.drop_unsent: Callable[[], None] | None = None  # of the port, once a question is given up
        self.checks = checks or DeviceChecks(host, is_waived=False)
        self._write, self._reply_timeout_s = write, reply_timeout_s
        self._given_up = GivenUpQuestions(reply_timeout_s)
        self.counts = WireCounts()
        self.reset()

    def reset(self) -> None:
        """Forget all that was received before: the port has been opened (again)."""
        self._host.forget()
        self.checks.begin()
        self._free_s = self._next_feed_s = self.answer_late_s = 0.0
        self._wanted_v: float | None = None
        self._in_flight: OutputRequest | None = None
        self._asked_v = self._before_v = inf
        self._sent_v = self._setting_s = self.pressure_pa = nan
        self.standing_v: float | None = None
        self._given_up.forget()
        self._is_behind = False  # the answer to one that was given up came, that to the last is out
        self._patience_s = self._reply_timeout_s  # shorter where garbage came: behind a round trip that was the answer
        self._refused_v = nan  # a moment ago: perhaps the watchdog has tripped, which is asked before the next try
        self._is_altered = False  # the last echo was another voltage
        self._quiet_until_s = self._sent_s = self._next_poll_s = self._said_s = self._checked_s = 0.0
        self._polls, self._frame, self._unread, self._failures = 0, b"", "", RepeatedFailures()
        self.acknowledged_v: float | None = None
        self.unanswered_since_s: float | None = None

    @property
    def fault(self) -> FaultCode:
        """Fault of the device or its line."""
        return self.checks.fault or self._failures.fault

    @property
    def said(self) -> str:
        """Words of the device about itself, where that is the fault, or in place of an answer; else empty."""
        return self.checks.said or ("" if self.fault else self._unread)

    @property
    def confirmed_v(self) -> float | None:
        """The voltage that the device has confirmed, once its checks are through; None before."""
        return self.acknowledged_v if self.checks.is_done else None

    def clear_faults(self) -> None:
        """Clear what only a person may clear: somebody has reset."""
        self.checks.clear()

    @property
    def sent_v(self) -> float | None:
        """The setting that went out last, None before the first."""
        return self._asked_v if self._asked_v < inf else None

    @property
    def round_trip_s(self) -> float:
        """Return what the last answer took that is surely its question's own, s; nan before the first."""
        return self._given_up.round_trip_s

    @property
    def line(self) -> LineState:
        """State of the line, for a recorded row."""
        return LineState(self.pressure_pa, self._sent_v, self._setting_s)

    def set_voltage(self, voltage_v: float, now_s: float) -> None:
        """Have this voltage stand on the device, V; sent at once if the wire is free, else as soon as it is."""
        self._wanted_v = voltage_v
        self._send_next(now_s)

    def on_bytes(self, chunk: bytes, now_s: float) -> Sequence[OutputReply]:
        """Return what these bytes complete, once it is acted on; what waits goes out."""
        replies = self._host.receive(chunk, now_s)
        for reply in replies:
            self._on_reply(reply, now_s)
        self._send_next(now_s)
        return replies

    def tick(self, now_s: float) -> None:
        """Give up an answer that is overdue or was garbled, and ask again; unanswered_since_s keeps the age of the silence."""
        if self._in_flight is not None and now_s - self._sent_s > self._patience_s:
            self._give_up(self._in_flight)
            if self.drop_unsent and self._patience_s >= self._reply_timeout_s:  # else the line goes on
                self.drop_unsent()
            self._next_poll_s = now_s  # ask again at once: three tries fit into the bound on silence
        self._send_next(now_s)

    def _give_up(self, question: OutputRequest) -> None:
        self._host.forget()
        if not isinstance(question, ReadVoltage):  # which tells anew what stands
            self.standing_v = None
        if isinstance(question, AskDevice):
            self.checks.miss(question.step)
        self._given_up.give_up(question, self._sent_s)
        self._in_flight = None

    def _send_next(self, now_s: float) -> None:
        wanted_v = self._wanted_v
        if wanted_v is None or now_s < self._free_s:
            return
        is_fall = wanted_v < self._asked_v
        if now_s < self._quiet_until_s and not is_fall:
            return
        if self._in_flight is not None:
            if not (self._is_behind and is_fall):
                return
            self._give_up(self._in_flight)
        is_safe_next = wanted_v == self._rest_v != self._asked_v  # behind a sign of life it waited for the next tick
        if self._host.sign_of_life and now_s >= self._next_feed_s and not is_safe_next:
            self._next_feed_s, self._free_s = now_s + self._host.feed_period_s, now_s + _AFTER_SIGN_OF_LIFE_S
            self._write(self._host.sign_of_life)
        elif wanted_v == self._refused_v and (step := self.checks.next_step(now_s)):
            self._refused_v = nan
            self._send(AskDevice(step), now_s)
        elif not (self._is_confirmed(wanted_v) or self._gives_way(wanted_v, now_s)) and self._may_obey(wanted_v, now_s):
            if wanted_v != self._asked_v:
                self._before_v = self._asked_v
            self._asked_v, self.standing_v = wanted_v, None
            if not self._host.idle_questions or self.checks.is_tripped:  # this is what a poll would say
                self._next_poll_s = now_s + _POLL_PERIOD_S
            self._sent_v, self._setting_s = wanted_v, now_s
            self._send(SetVoltage(wanted_v), now_s)
        elif step := self.checks.next_step(now_s):
            self._send(AskDevice(step), now_s)
        elif now_s >= self._next_poll_s and not self.checks.is_tripped:
            self._next_poll_s = now_s + _POLL_PERIOD_S
            self._send(self._poll(now_s), now_s)

    def _poll(self, now_s: float) -> OutputRequest:
        """Of a device that is asked about its pressure alone nobody would notice that it stands elsewhere: set at its panel, by
        a second talker, or by a dip of its supply. At rest it is told where to stand again and again, which moves nothing."""
        questions = self._host.idle_questions or (SetVoltage(self._asked_v),)
        self._polls += 1
        question = questions[self._polls % len(questions)]
        is_due = now_s - self._said_s >= _REPEATED_S and self._asked_v == self._rest_v
        return SetVoltage(self._rest_v) if is_due and isinstance(question, ReadPressure) else question

    def _is_confirmed(self, voltage_v: float) -> bool:
        """Within half a step of what surely stands there is nothing to send. After a question without an answer nothing
        surely stands: a device whose answer was lost may have obeyed, and must hear the safe voltage."""
        standing_v = self.standing_v
        return standing_v is not None and abs(voltage_v - standing_v) <= 0.5 * self._host.resolution_v

    def _gives_way(self, wanted_v: float, now_s: float) -> bool:
        """To a late check, where something presses; not twice running, or no answer looks like silence. One that falls,
        but not to where it rests, does so seldom: a whole long fall on a slow wire a device would press unwatched."""
        if wanted_v == self._rest_v or not self._is_check_next(now_s):
            return False
        is_seldom = now_s - self._checked_s > _FALLS_FIRST_S and now_s >= self._quiet_until_s
        return wanted_v >= self._asked_v or is_seldom

    def _is_check_next(self, now_s: float) -> bool:
        return self._said_s == self._sent_s and self.checks.is_late(now_s)

    def _may_obey(self, voltage_v: float, now_s: float) -> bool:
        """Where the watchdog is said to have tripped, the same setting is tried no more often than a poll would be, and in turn
        with what clears it: on a slow wire it was never cleared."""
        is_again = self.checks.is_tripped and voltage_v == self._asked_v
        return not is_again or (now_s >= self._next_poll_s and not self._is_check_next(now_s))

    def _send(self, request: OutputRequest, now_s: float) -> None:
        self._in_flight, self._sent_s, self._is_behind, self._patience_s = request, now_s, False, self._reply_timeout_s
        self._said_s = now_s if isinstance(request, SetVoltage) else self._said_s
        self._checked_s = now_s if isinstance(request, AskDevice) else self._checked_s
        self.counts.asked += 1
        if self.unanswered_since_s is None:
            self.unanswered_since_s = now_s
        self._frame = self._host.request(request)
        self._write(self._frame)

    def _on_reply(self, reply: OutputReply, now_s: float) -> None:
        if isinstance(reply, Garbage):
            self.counts.garbled += 1
            self._patience_s = self._given_up.patience_s
            self._unread = explain_answer(reply.data, self._frame)
            if self._in_flight is None:  # unasked: that was it
                self._given_up.is_overdue = False
                del self._given_up.questions[:1]
            return
        request, self._in_flight = self._in_flight, None
        self._free_s = max(self._free_s, now_s + self._host.gap_s)
        self.counts.heard += request is not None
        if self._is_late(request, reply, now_s):
            return
        if self.unanswered_since_s is not None and now_s - self.unanswered_since_s > _AWAY_S:
            self.checks.begin()
            self.standing_v = None  # a watchdog has put out its own, say: what is read back was commanded before
        self.unanswered_since_s, self._unread = None, ""
        is_doubtful = self._given_up.is_overdue or now_s < self._quiet_until_s
        if is_doubtful and not self._is_echo(request, reply):
            self._given_up.note_strange(now_s)
            if request is not None:
                self._given_up.note(request, self._sent_s)  # if what came was of an older one
            # one reply time: else what is not its echo, a refusal of each fall, is doubted for as long as it falls
            self._quiet_until_s = self._quiet_until_s if now_s < self._quiet_until_s else now_s + self._reply_timeout_s
            return
        self._given_up.note_answer(now_s - self._sent_s)
        self.answer_late_s = 0.0
        if isinstance(request, AskDevice):
            self._take_check(request, reply)
        elif isinstance(reply, WatchdogTripped):
            self.checks.trip()
        elif isinstance(reply, Pressure):
            self.pressure_pa = reply.pressure_pa
            self._failures.note_success(type(request))
        elif isinstance(reply, Refused):
            self._refused_v = request.voltage_v if isinstance(request, SetVoltage) else nan
            self._failures.count(type(request), FaultCode.OUTPUT_REFUSED)
        elif request is not None and isinstance(reply, Accepted):
            self._check_setting(request, reply, now_s)

    def _is_late(self, request: OutputRequest | None, reply: OutputReply, now_s: float) -> bool:
        """Where a setting's answer repeats one that was given up before it, that one has been answered, and those before it
        never will be: what is out stays so, and the silence is as old as the oldest of it."""
        if not (isinstance(request, SetVoltage) and isinstance(reply, Accepted)) or self._is_echo(request, reply):
            return False
        sent_s = self._given_up.take_answer(
            lambda question: not isinstance(question, SetVoltage) or self._is_echo(question, reply), now_s
        )
        if sent_s is None:
            return False
        since_s = self._given_up.silent_since_s
        self.answer_late_s, self.unanswered_since_s = now_s - sent_s, self._sent_s if since_s is None else since_s
        self._in_flight, self._is_behind = request, True
        self._host.expect(request)
        return True

    def _take_check(self, request: AskDevice, reply: OutputReply) -> None:
        if isinstance(reply, DeviceAnswer):
            self.checks.take(reply)
        elif isinstance(reply, Refused):
            self.checks.refuse(request.step, reply.text)

    def _is_echo(self, request: OutputRequest | None, reply: OutputReply) -> bool:
        return (
            isinstance(request, SetVoltage)
            and isinstance(reply, Accepted)
            and self._host.confirms(request.voltage_v, reply, request)
        )

    def _check_setting(self, request: OutputRequest, reply: Accepted, now_s: float) -> None:
        """The echo of a setting, or the setting as it was read: another one than was sent is set anew, and counted. What then
        stands is not known, not even by the next one that agrees: an echo that lost its first digits says 0, and the safe
        voltage must go out all the same."""
        self.acknowledged_v, self.standing_v = reply.voltage_v, None
        if not self._host.confirms(self._asked_v, reply, request):
            self._is_altered = True
            self._failures.count(type(request), FaultCode.OUTPUT_ALTERED)
            if self._host.confirms(self._before_v, reply, request):  # perhaps it came twice, and all behind it are late
                self._quiet_until_s = now_s + self._reply_timeout_s
            return
        was_altered, self._is_altered = self._is_altered, False
        if not was_altered:
            is_coarse = abs(reply.voltage_v - self._asked_v) > self._host.resolution_v  # it counts in coarser steps
            self.standing_v = self._asked_v if is_coarse else reply.voltage_v
        self._failures.note_success(type(request))
