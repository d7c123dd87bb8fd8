"""A machine that was suspended: its monotonic clock stood still, so that all that waited meanwhile seemed to come in time."""

from math import inf

import pytest

from gateway.codes.faults import FaultCode
from gateway.defaults import STALL_S
from gateway.registers.refusal import Refusal
from gateway.registers.words import State
from gateway.service.running_rig.last_tick import LastTick
from tests.service.wired import ENABLE, Wired

HOUR_S = 3600.0
TARE = 4


def test_a_force_goes_when_the_machine_wakes_whatever_comes_first() -> None:
    for moment_ms in range(20):  # before a tick, a sample, behind one
        wired = Wired(seed=moment_ms).pressing(20.0)
        wired.run(moment_ms / 1e3)
        wired.suspended_s = HOUR_S
        assert wired.voltage_reaches_safe(0.1) < 0.06
        assert wired.fault_code is FaultCode.LOOP_STALLED
        (sentence,) = wired.said("A319")
        assert "suspended for 3600.0 s" in sentence and "sleep.target" in sentence


def test_a_setpoint_that_the_network_kept_meanwhile_is_not_obeyed() -> None:
    wired = Wired().pressing(20.0)
    wired.suspended_s = HOUR_S
    wired.write(1, 4000)
    wired.run(1.0)
    assert wired.state is State.FAULT and max(one.voltage_v for one in wired.settings_since(wired.now_s - 0.9)) == 0.0


@pytest.mark.parametrize("later_s", [0.0, 0.05], ids=["at once", "behind ticks and samples"])
def test_an_enable_that_the_network_kept_meanwhile_is_refused(later_s: float) -> None:
    wired = Wired().ready()
    wired.suspended_s = HOUR_S
    wired.run(later_s)
    with pytest.raises(Refusal, match=r"W213 .*stood still"):
        wired.write(0, ENABLE, 1500)
    wired.run(0.3)
    wired.write(0, ENABLE, 1500)
    wired.until(lambda: wired.state is State.HOLDING, 3.0)


@pytest.mark.parametrize("later_s", [0.0, 0.05], ids=["at once", "behind ticks and samples"])
def test_a_tare_that_the_network_kept_meanwhile_takes_no_zero(later_s: float) -> None:
    """By readings of before the sleep, or of a tool that somebody has set down since: each force after it would be wrong."""
    wired = Wired().ready()
    wired.run(1.5)
    wired.suspended_s = HOUR_S
    wired.run(later_s)
    with pytest.raises(Refusal, match=r"W303 .*stood still"):
        wired.write(0, TARE)
    wired.run(0.3)
    wired.write(0, TARE)
    assert wired.said("tare: zero")


def test_a_machine_that_woke_long_ago_presses_as_ever() -> None:
    wired = Wired().ready()
    wired.suspended_s = HOUR_S
    wired.run(1.0)
    wired.pressing(20.0)
    for k in range(400):
        wired.suspended_s = HOUR_S - 1e-6 * (k % 3)  # two clocks are never read at one moment
        wired.run(0.005)
    assert wired.state is State.HOLDING


def test_a_loop_is_awake_since_its_last_standstill_and_knows_that_later_too() -> None:
    """What a master has kept since before it has not been seen for so long."""
    last = LastTick(lambda: 0.0)
    for now_s in (1.0, 1.01, 1.01 + 2.0 * STALL_S):
        assert last.awake_since_s(now_s) == (now_s if now_s > 1.01 else -inf)
        last.note(now_s, None)
    for later_s in (0.01, 0.02):
        assert last.awake_since_s(now_s + later_s) == now_s
        last.note(now_s + later_s, None)


def test_what_passes_between_the_reading_of_two_clocks_is_no_suspension() -> None:
    """Of a machine that never sleeps each tick would be a little late, and the oldest enable thrown away."""
    apart_s = iter((0.0, 0.001, 0.002, 0.019, 5.0))
    last = LastTick(lambda: next(apart_s))
    assert last.suspended_s() == 0.0
    last.note(1.0, None)
    assert (last.slept_s, last.suspended_s()) == (0.0, 0.0)
    assert last.suspended_s() == pytest.approx(5.0, abs=0.02), "and one that sleeps is"
