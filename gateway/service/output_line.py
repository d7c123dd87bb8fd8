"""The output device's line: at most one question on the wire, and of waiting setpoints only the last.

A serial device at 9600 baud takes 15 ms for a setting and its echo, the loop decides every 4-10 ms: a queue would make
the wire an ever older past. Setpoints go before pressure polls; polls fill the idle wire and keep a silent device from
going unnoticed. Time comes in as an argument, so that tests run it in virtual time.
"""

from collections.abc import Callable
from math import nan

from gateway.devices import OutputHost
from gateway.devices.messages import (
    Accepted,
    Garbage,
    OutputReply,
    OutputRequest,
    Pressure,
    ReadPressure,
    Refused,
    SetVoltage,
)
from gateway.registers.words import FaultCode

_FAILURES_BEFORE_FAULT = 3  # SAFETY: T_dac is three writes or 100 ms; one bad echo is noise
_PRESSURE_PERIOD_S = 0.1


class OutputLine:
    """Asks the device through `write`, keeps what it answered.

    acknowledged_v: confirmed by the device, None before the first; unanswered_since_s: send time of the oldest question
    without an answer; fault: three failures in a row; pressure_pa: last measured, nan before the first.
    """

    def __init__(self, host: OutputHost, write: Callable[[bytes], None], reply_timeout_s: float) -> None:
        self._host = host
        self._write = write
        self._reply_timeout_s = reply_timeout_s
        self.garbage_bytes = 0
        self.round_trip_s = nan
        self.on_pressure: Callable[[float], None] = lambda pressure_pa: None
        self.opened()

    def opened(self) -> None:
        """The port is (again) open: nothing said before counts any more."""
        self._host.forget()
        self._wanted_v: float | None = None
        self._in_flight: OutputRequest | None = None
        self._sent_s = 0.0
        self._next_pressure_s = 0.0
        self._failures = 0
        self.acknowledged_v: float | None = None
        self.unanswered_since_s: float | None = None
        self.fault = FaultCode.NONE
        self.pressure_pa = nan

    def want(self, voltage_v: float, now_s: float) -> None:
        """This voltage shall stand on the device, V; sent at once if the wire is free, else as soon as it is."""
        self._wanted_v = voltage_v
        self._pump(now_s)

    def on_bytes(self, chunk: bytes, now_s: float) -> None:
        for reply in self._host.receive(chunk, now_s):
            self._on_reply(reply, now_s)
        self._pump(now_s)

    def tick(self, now_s: float) -> None:
        """Give up waiting for an overdue answer and ask again; unanswered_since_s keeps the age of the silence."""
        if self._in_flight is not None and now_s - self._sent_s > self._reply_timeout_s:
            self._host.forget()
            self._in_flight = None
            self._next_pressure_s = now_s  # ask again at once: three tries fit into the bound on silence
        self._pump(now_s)

    def _pump(self, now_s: float) -> None:
        if self._in_flight is not None:
            return
        if self._wanted_v is not None and not self._stands(self._wanted_v):
            self._send(SetVoltage(self._wanted_v), now_s)
        elif now_s >= self._next_pressure_s and self._wanted_v is not None:
            self._next_pressure_s = now_s + _PRESSURE_PERIOD_S
            self._send(ReadPressure(), now_s)

    def _stands(self, voltage_v: float) -> bool:
        """Within half a step of the device there is nothing to send."""
        return self.acknowledged_v is not None and abs(voltage_v - self.acknowledged_v) <= 0.5 * self._host.resolution_v

    def _send(self, request: OutputRequest, now_s: float) -> None:
        self._in_flight, self._sent_s = request, now_s
        if self.unanswered_since_s is None:
            self.unanswered_since_s = now_s
        self._write(self._host.request(request))

    def _on_reply(self, reply: OutputReply, now_s: float) -> None:
        if isinstance(reply, Garbage):
            self.garbage_bytes += len(reply.data)
            return
        asked, self._in_flight = self._in_flight, None
        self.unanswered_since_s = None
        self.round_trip_s = now_s - self._sent_s
        if isinstance(reply, Pressure):
            self.pressure_pa = reply.pressure_pa
            self.on_pressure(reply.pressure_pa)
        elif isinstance(reply, Refused):
            self._failed(FaultCode.OUTPUT_REFUSED)
        elif isinstance(reply, Accepted) and isinstance(asked, SetVoltage):
            self._check_echo(asked.voltage_v, reply.voltage_v)

    def _check_echo(self, asked_v: float, accepted_v: float) -> None:
        self.acknowledged_v = accepted_v
        if abs(accepted_v - asked_v) <= 0.6 * self._host.resolution_v:
            self._failures, self.fault = 0, FaultCode.NONE
        else:
            self._failed(FaultCode.OUTPUT_ALTERED)

    def _failed(self, fault: FaultCode) -> None:
        self._failures += 1
        if self._failures >= _FAILURES_BEFORE_FAULT:
            self.fault = fault
