"""Whatever happens to a gateway and its wires, in any order, an observer of the wire sees no law broken."""

from random import Random

import pytest

from gateway.control.inputs import Output
from gateway.registers import Refusal
from gateway.registers.words import State
from tests.service.rigs import strict
from tests.service.running_rig.test_wired_faults import LAST_WORD_S, assert_heals_after_reset
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
