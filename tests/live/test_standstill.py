"""Standing still: known by whoever wakes first, over soon, and nothing that runs slowly is one."""

import asyncio
import time

import pytest

from gateway.live.standstill import AFTERMATH_S, STANDSTILL_S, Standstill, suspended_s


def kept(*times_s: float) -> list[bool]:
    """Whether what comes at these times, from a start at 0, comes behind a standstill."""

    async def run() -> list[bool]:
        now_s = 0.0
        standstill = Standstill(lambda: now_s)
        keeping = asyncio.create_task(standstill.keep_time())
        await asyncio.sleep(0.0)
        found = list[bool]()
        for time_s in times_s:
            now_s = time_s
            found += [standstill.is_aftermath()]
        keeping.cancel()
        return found

    return asyncio.run(run())


def test_what_comes_behind_a_standstill_is_known_although_nobody_has_noted_it_yet() -> None:
    assert kept(0.1, 4.0, 4.0 + 0.9 * AFTERMATH_S, 4.0 + 1.1 * AFTERMATH_S) == [False, True, True, False]


def test_a_standstill_is_one_from_a_second_on() -> None:
    assert kept(0.1, 0.1 + 1.1 * STANDSTILL_S) == [False, True]


def test_a_slow_process_does_not_stand_still() -> None:
    assert not any(kept(*(0.9 * STANDSTILL_S * step for step in range(20))))


def test_nobody_who_keeps_no_time_stands_still() -> None:
    now_s = 0.0
    standstill = Standstill(lambda: now_s)
    now_s = 100.0
    assert not standstill.is_aftermath()


def test_a_machine_that_slept_stood_still_although_its_monotonic_clock_did(monkeypatch: pytest.MonkeyPatch) -> None:
    async def run() -> tuple[bool, float, bool]:
        standstill, read, before_s = Standstill(), time.clock_gettime, suspended_s()
        keeping = asyncio.create_task(standstill.keep_time())
        await asyncio.sleep(0.0)
        is_before = standstill.is_aftermath()
        ahead_s = 3600.0
        monkeypatch.setattr(time, "clock_gettime", lambda clock: read(clock) + ahead_s * (clock == time.CLOCK_BOOTTIME))
        slept_s, is_behind = suspended_s() - before_s, standstill.is_aftermath()
        keeping.cancel()
        return is_before, slept_s, is_behind

    is_before, slept_s, is_behind = asyncio.run(run())
    assert (is_before, is_behind) == (False, True)
    assert slept_s == pytest.approx(3600.0, abs=1.0)
