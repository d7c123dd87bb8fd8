"""How fast a device is said to be, and what counts as a stream of its readings: without a port."""

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.devices import cell_device
from gateway.devices.messages import Quality
from gateway.profiles import load_rig
from gateway.service.probing import port_probe
from gateway.service.probing.harmless_questions import count_readings

PROFILE = load_rig("demo").load_cell.device
FRAME = cell_device(PROFILE, load_rig("demo").load_cell.unit).frame(12.0, Quality.OK)


def test_a_stream_is_one_where_more_of_it_makes_sense_than_not() -> None:
    """Noise makes a reading now and then: another device, or another speed."""
    noise = b"#" * (len(FRAME) - len(PROFILE.terminator_bytes)) + PROFILE.terminator_bytes
    assert count_readings(PROFILE, 10 * FRAME) >= 9
    assert count_readings(PROFILE, 10 * (FRAME + noise + noise)) == 0


def test_the_rate_of_a_stream_is_its_readings_in_a_second() -> None:
    found = port_probe._streamed(PROFILE, PROFILE.serial, 11 * FRAME, 0.5)
    assert found is not None and found.rate_hz == pytest.approx(count_readings(PROFILE, 11 * FRAME) / 0.5)


def test_the_time_of_a_question_is_that_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now_s=100.0)
    monkeypatch.setattr(port_probe, "monotonic_s", lambda: clock.now_s)

    class Ear:
        async def ask(self, *_: Any) -> str:
            clock.now_s += 0.04
            return "reads 1"

        async def listen(self, duration_s: float) -> None:
            clock.now_s += duration_s

    took_s = asyncio.run(port_probe._round_s(Ear(), None, 1.0))  # type: ignore[arg-type]
    assert took_s == pytest.approx(0.04)
