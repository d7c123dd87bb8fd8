"""A regulator that answers later than its profile says: its voltage is obeyed all the same."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import PacedWire
from gateway.registers.words import State
from tests.service.rigs import strict
from tests.service.wired import ENABLE, Wired


class LateWire:
    """A wire whose sender thinks about each sentence for a while first."""

    def __init__(self, wire: PacedWire, late_s: float) -> None:
        self._wire, self._late_s = wire, late_s
        self._thought: list[tuple[float, bytes]] = []

    def send(self, data: bytes, now_s: float) -> None:
        self._thought.append((now_s + self._late_s, data))

    def bytes_through(self, now_s: float) -> bytes:
        while self._thought and self._thought[0][0] <= now_s:
            self._wire.send(*reversed(self._thought.pop(0)))
        return self._wire.bytes_through(now_s)


def pressing_with(late_s: float) -> Wired:
    wired = Wired(strict()).pressing(20.0)
    wired._down = LateWire(wired._down, late_s)  # type: ignore[assignment]
    return wired


@pytest.mark.parametrize("late_s", [0.01, 0.02, 0.04])
def test_within_its_time_it_holds_every_force(late_s: float) -> None:
    wired = pressing_with(late_s)
    for force_n in (35.0, 8.0, 28.0, 14.0):
        wired.write(0, ENABLE, round(100 * force_n))
        wired.run(1.5)
        assert abs(wired.force_n - force_n) <= 1.0, wired.show()


@pytest.mark.parametrize("late_s", [0.1, 0.12, 0.2])
def test_beyond_the_bound_its_silence_is_the_fault_and_never_another_voltage(late_s: float) -> None:
    wired = pressing_with(late_s)
    for force_n in (35.0, 8.0, 28.0):
        wired.write(0, ENABLE, round(100 * force_n)) if wired.state is not State.FAULT else None
        wired.run(0.6)
    assert wired.state is State.FAULT and wired.fault_code is FaultCode.OUTPUT_SILENT


def test_one_that_is_too_slow_is_told_as_such_and_never_as_one_that_alters() -> None:
    wired = pressing_with(0.08)
    force_n = 0
    while wired.state is not State.FAULT and wired.now_s < 30.0:
        wired.write(0, ENABLE, 500 + 600 * (force_n := (force_n + 4) % 7))
        wired.run(0.4)
    (told,) = wired.said("A314")
    assert "the answer before took" in told and not wired.said("A316")
