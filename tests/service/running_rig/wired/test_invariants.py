"""Whatever happens to a gateway and its wires, in any order, an observer of the wire sees no law broken."""

from math import inf
from random import Random

import pytest

from gateway.control.inputs import Output
from gateway.registers import Refusal
from gateway.registers.words import State
from tests.service.rigs import strict
from tests.service.running_rig.wired.test_faults import LAST_WORD_S, assert_heals_after_reset
from tests.service.wired import ENABLE, RESET, STEP_S, Observer, Wired

FAULTS = ("no-air", "no-contact", "sign-inverted", "cell-cut", "output-cut")


def misfortunes(wired: Wired, chance: Random) -> None:
    """One thing that may happen to a gateway: a write, good or bad, a fault of the world, its end, a stall, a plug."""
    draw = chance.random()
    try:
        if draw < 0.45:
            wired.write(0, chance.choice((0, ENABLE, ENABLE, ENABLE, RESET)), chance.randrange(0, 6500, 50))
        elif draw < 0.55:
            wired.write(0, RESET, 0)
        elif draw < 0.6:
            wired.write(0, ENABLE, 0, 0, 1, 0, chance.randrange(0, 10000))
        elif draw < 0.75:
            wired.fault(chance.choice(FAULTS), on=True)
        elif draw < 0.93:
            wired.fault(chance.choice(FAULTS), on=False)
        elif draw < 0.96:
            wired.stall(chance.uniform(0.02, 0.3))
        elif wired.is_plugged:
            wired.unplug()
        else:
            wired.replug()
    except Refusal:
        pass


def non_safe_without_leave(wired: Wired, decision: Output) -> bool:
    return decision.voltage_v > 0.0 and decision.state in (State.OFF, State.FAULT)


@pytest.mark.sampled
@pytest.mark.parametrize("seed", range(30))
def test_whatever_happens_the_wire_keeps_the_invariants(seed: int, budget: int) -> None:
    for schedule in range(seed * budget, (seed + 1) * budget):
        print(f"schedule {schedule}")
        chance = Random(schedule)
        wired = Wired(strict(), seed=schedule)
        disabled_s = 0.0
        for _ in range(25):
            misfortunes(wired, chance)
            for _ in wired.samples(round(chance.uniform(0.02, 0.4) / STEP_S) * STEP_S):
                decision = wired.loop.decision
                assert decision is None or not non_safe_without_leave(wired, decision), "I4"
                may_press = not wired.is_plugged or wired.state not in (State.OFF, State.FAULT)
                disabled_s = 0.0 if may_press else disabled_s + STEP_S
                if disabled_s > LAST_WORD_S:
                    assert wired.observer.settings[-1].voltage_v == 0.0, "I3"
        for name in FAULTS:
            wired.fault(name, on=False)
        if not wired.is_plugged:
            wired.replug()
        wired.run(0.5)
        wired.write(0, 0)
        assert_heals_after_reset(wired)


@pytest.mark.parametrize(
    ("planted", "invariant"),
    [
        (b"SET 0\r\nSET 850\r\n", "I2"),
        (b"SET 0\r\nSET 8000\r\n", "I1"),
        (b"SET 0\r\nSET 30SET 4\r\n", "I7"),
        (b"SET 0\r\nSET -1\r\n", "I7"),
        (b"SET 4\r\n", "I6"),
    ],
)
def test_the_observer_sees_planted_violations(planted: bytes, invariant: str) -> None:
    observer = Observer()
    observer.hear(planted, 0.1)
    with pytest.raises(AssertionError, match=invariant):
        observer.check(strict())


def test_a_tick_asks_the_device_nothing_before_its_safe_voltage_is_out() -> None:
    """An idle question that is due in the very tick would take 8 ms of the bound, at 9600 baud."""
    wired = Wired(strict()).ready()
    wired.write(0, ENABLE, 0, 0, 1, 0, 4000)
    wired.run(2.0)
    wired.exchange._next_poll_s = inf
    wired.run(0.02)
    assert wired.observer.settings[-1].voltage_v > 3.9
    written: list[bytes] = []
    write = wired.exchange._write
    wired.exchange._write = lambda data: (written.append(data), write(data))  # type: ignore[assignment]
    wired.is_cell_plugged = False
    last_s = wired.loop.sample.time_s if wired.loop.sample else 0.0
    while wired.state is not State.FAULT:
        assert written == []
        is_overdue = wired.now_s + 0.001 - last_s > wired.rig.control.supervision.sample_timeout_s
        wired.exchange._next_poll_s = 0.0 if is_overdue else inf
        wired.run(0.001)
    assert written[0] == b"SET 0\r\n"
