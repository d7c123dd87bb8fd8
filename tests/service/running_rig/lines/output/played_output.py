"""An output line with its device played by the test."""

import pytest

from gateway.devices import output_host
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.service.rigs import demo

REPLY_TIMEOUT_S = 0.06


ROUND_TRIP_S = 0.02


class Wire:
    """What was written, and the answers that a test gives to it; every call takes the time that the test says."""

    def __init__(self) -> None:
        self.written: list[bytes] = []
        self.pressures_pa: list[float] = []
        self.exchange = OutputExchange(output_host(demo().output.device), self.written.append, REPLY_TIMEOUT_S)
        self.now_s = 100.0

    @property
    def last(self) -> str:
        return self.written[-1].decode().strip()

    def set_voltage(self, counts: float, after_s: float = 0.0) -> None:
        self.now_s += after_s
        self.exchange.set_voltage(counts * 10 / 1023, self.now_s)

    def answer(self, text: str, after_s: float = ROUND_TRIP_S) -> None:
        self.now_s += after_s
        self.exchange.on_bytes(text.encode() + b"\r\n", self.now_s)
        if self.exchange.pressure_pa == self.exchange.pressure_pa:
            self.pressures_pa.append(self.exchange.pressure_pa)

    def tick(self, after_s: float = 0.01) -> None:
        self.now_s += after_s
        self.exchange.tick(self.now_s)

    def settle(self, counts: float) -> None:
        """This setting acknowledged, by where the device then stands, the wire idle."""
        self.set_voltage(counts)
        self.answer(str(round(counts)))
        if self.last == "MON":
            self.answer("0")


@pytest.fixture
def wire() -> Wire:
    return Wire()
