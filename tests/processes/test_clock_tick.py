"""The loop's clock tick: on the kernel's timer, counting what was missed, telling how late it comes."""

import asyncio
import os
import time

import pytest

from gateway.processes.clock_tick import ClockTick
from gateway.processes.phase_lock import ARRIVALS, BEHIND_S
from gateway.service.running_rig.published_status import LoopHealth

PERIOD_S = 0.004


def ticks(count: int, *, fallback: bool = False, busy_s: float = 0.0) -> list[tuple[int, float, float]]:
    """(expirations, lateness, time) of so many ticks; the loop is busy once, after the first."""
    seen: list[tuple[int, float, float]] = []

    async def scene() -> None:
        enough = asyncio.Event()

        def on_tick(expirations: int, late_s: float) -> None:
            seen.append((expirations, late_s, time.monotonic()))
            if len(seen) == 1 and busy_s:
                until_s = time.monotonic() + busy_s
                while time.monotonic() < until_s:
                    pass
            if len(seen) >= count:
                enough.set()

        tick = ClockTick(PERIOD_S, on_tick, is_fallback=fallback)
        tick.start()
        async with asyncio.timeout(5):
            await enough.wait()
        tick.close()
        heard = len(seen)
        await asyncio.sleep(3 * PERIOD_S)
        assert len(seen) == heard, "closed is closed"

    asyncio.run(scene())
    return seen


@pytest.mark.parametrize("fallback", [False, True])
def test_ticks_come_at_their_period_and_never_early(fallback: bool) -> None:
    began_s = time.monotonic()
    seen = ticks(20, fallback=fallback)
    periods = sum(expirations for expirations, _, _ in seen)
    assert seen[-1][2] - began_s >= periods * PERIOD_S - 0.0005
    assert all(expirations >= 1 for expirations, _, _ in seen)
    assert all(late_s >= -0.0005 for _, late_s, _ in seen)


@pytest.mark.parametrize("fallback", [False, True])
def test_a_busy_loop_is_told_how_many_ticks_it_missed(fallback: bool) -> None:
    seen = ticks(3, fallback=fallback, busy_s=10.5 * PERIOD_S)
    assert seen[1][0] >= 10
    assert seen[2][2] - seen[1][2] < 3 * PERIOD_S + 0.05, "missed ticks are not made up for"


def test_lateness_is_the_age_of_the_newest_expiration() -> None:
    """After a busy stretch the newest expiration is less than one period old, however many were missed."""
    late_s = ticks(3, busy_s=10.5 * PERIOD_S)[1][1]
    assert 0.0 <= late_s <= PERIOD_S + 0.02


@pytest.mark.parametrize("fallback", [False, True])
def test_closing_twice_or_before_the_start_is_no_trouble(fallback: bool) -> None:
    """The second close must not close what has the descriptor's number by then."""
    seen: list[int] = []

    async def scene() -> bytes:
        tick = ClockTick(PERIOD_S, lambda expirations, late_s: seen.append(expirations), is_fallback=fallback)
        tick.close()
        tick.start()
        tick.close()
        reader, writer = os.pipe()
        tick.close()
        await asyncio.sleep(3 * PERIOD_S)
        os.write(writer, b"open")
        heard = os.read(reader, 8)
        os.close(reader)
        os.close(writer)
        return heard

    assert asyncio.run(scene()) == b"open"
    assert seen == [], "closed is closed"


def test_a_tick_that_follows_moves_behind_the_arrivals_and_loses_none() -> None:
    """The arrivals are a grid in time, of which each tick tells the newest point."""
    due_s: list[float] = []
    periods: list[int] = []
    began_s = time.monotonic()

    async def scene() -> None:
        enough = asyncio.Event()

        def on_tick(expirations: int, late_s: float) -> None:
            now_s = time.monotonic()
            due_s.append(now_s - late_s)
            periods.append(expirations)
            tick.follow(now_s - (now_s - began_s) % PERIOD_S)
            if len(due_s) >= 8 * ARRIVALS:
                enough.set()

        tick = ClockTick(PERIOD_S, on_tick)
        await asyncio.sleep(0.4 * PERIOD_S)
        tick.start()
        async with asyncio.timeout(10):
            await enough.wait()
        tick.close()

    asyncio.run(scene())
    assert (due_s[-1] - began_s) % PERIOD_S == pytest.approx(BEHIND_S, abs=3e-4)
    assert (due_s[-1] - due_s[0]) / PERIOD_S == pytest.approx(sum(periods[1:]), abs=0.6), (
        "moved by half a period at most"
    )


@pytest.mark.parametrize("fallback", [False, True])
def test_a_tick_that_has_not_begun_or_has_no_timer_follows_nothing(fallback: bool) -> None:
    tick = ClockTick(PERIOD_S, lambda expirations, late_s: None, is_fallback=fallback)
    for k in range(3 * ARRIVALS):
        tick.follow(k * PERIOD_S)
    assert tick._due_s == 0.0


def test_missed_ticks_and_lateness_are_counted() -> None:
    health = LoopHealth()
    for _ in range(98):
        health.count(1, 0.00009)
    health.count(3, 0.0041)
    health.count(1, -0.001)  # a clock that rounds is not late
    assert (health.ticks, health.missed_ticks) == (102, 2)
    assert health.lateness_us(0.5) == 128
    assert health.lateness_us(0.98) == 128
    assert health.lateness_us(1.0) == 8192


def test_without_a_tick_there_is_no_lateness() -> None:
    assert LoopHealth().lateness_us(0.99) == 0
