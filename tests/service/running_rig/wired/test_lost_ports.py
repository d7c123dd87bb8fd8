"""Ports that are unplugged and come back, and a loop that stalls, in the wired gateway in virtual time."""

from math import isnan

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers import Refusal
from gateway.registers.words import State
from tests.service.rigs import demo, strict
from tests.service.running_rig.wired.test_faults import TICK_S, assert_fails_with, assert_heals_after_reset, at_twenty
from tests.service.wired import ENABLE, RESET, Wired

TARE = 4


def test_an_unplugged_output_is_a_fault_at_once_and_comes_back_safe() -> None:
    wired = at_twenty()
    wired.unplug()
    assert_fails_with(wired, FaultCode.OUTPUT_LOST, TICK_S)
    wired.run(0.4)
    assert wired.value("force_applied") == 0.0
    assert isnan(wired.exchange.pressure_pa), "nobody measures it now"
    wired.replug()
    reopened_s = wired.now_s
    wired.run(0.3)
    first = wired.settings_since(reopened_s)[0]
    assert first.voltage_v == 0.0, "I6: the first command after a reopening is safe"
    assert wired.state is State.FAULT, "I5: a fault stays until it is reset"
    assert_heals_after_reset(wired)


def test_unplugged_and_replugged_between_two_ticks_is_a_fault_all_the_same() -> None:
    """I6: another device may be behind the name now; the voltage of before must not be its first command."""
    wired = at_twenty()
    wired.unplug()
    wired.replug()
    replugged_s = wired.now_s
    with pytest.raises(Refusal):
        wired.write(0, ENABLE, 2500)
    wired.run(0.3)
    assert wired.state is State.FAULT
    assert wired.fault_code is FaultCode.OUTPUT_LOST
    assert [one.voltage_v for one in wired.settings_since(replugged_s)] == [0.0]


def test_while_the_output_is_unplugged_no_enable_is_accepted() -> None:
    wired = Wired().ready()
    wired.unplug()
    wired.run(0.1)
    with pytest.raises(Refusal) as refused:
        wired.write(0, ENABLE, 1200)
    assert refused.value.code == 4
    assert wired.state is State.OFF


def test_an_unplugged_cell_is_named_as_such() -> None:
    wired = at_twenty()
    wired.is_cell_plugged = False
    wired.loop.cell_lost = True
    assert_fails_with(wired, FaultCode.CELL_LOST, 2 * TICK_S)
    wired.is_cell_plugged = True
    wired.loop.on_cell_opened()
    assert_heals_after_reset(wired)


def test_a_cell_that_comes_back_within_half_a_frame_gives_no_wrong_force() -> None:
    wired = Wired().ready()
    wired.loop.on_cell_bytes(b"ST,GS,+0009.", wired.now_s)
    wired.loop.on_cell_opened()
    before, garbled = wired.loop.samples, wired.loop.cell_counts.garbled
    wired.loop.on_cell_bytes(b"99kg\r\n", wired.now_s)
    assert wired.loop.samples == before
    assert wired.loop.cell_counts.garbled - garbled == 1


def test_what_arrived_during_a_stall_is_dropped() -> None:
    """A request executed late: The setpoint that waited is not pressed with, the force goes away."""
    wired = at_twenty()
    stalled_s = wired.now_s
    wired.stall(0.3, then=lambda: wired.write(1, 4000))
    assert wired.fault_code is FaultCode.LOOP_STALLED
    assert wired.word("force_setpoint") == 0
    wired.run(0.3)
    high_v = max(one.voltage_v for one in wired.observer.settings if one.time_s <= stalled_s)
    assert all(one.voltage_v <= high_v for one in wired.settings_since(stalled_s))
    assert_heals_after_reset(wired)


def test_a_short_stall_is_no_fault() -> None:
    wired = at_twenty(demo())
    wired.stall(0.08)
    wired.run(0.3)
    assert wired.state is State.HOLDING


@pytest.mark.parametrize("force_n", [5.0, 12.0])
def test_what_an_output_has_kept_pressed_while_it_was_away_is_no_zero(force_n: float) -> None:
    """A regulator that hears nothing keeps its pressure. Back, it is told the safe voltage, and for its dead time the force
    stands: `reset, tare, enable` took it for the zero, and each force was so much more from then on."""
    wired = Wired(strict()).pressing(force_n)
    wired.run(0.5)
    wired.unplug()
    wired.run(1.0)
    assert float(wired.twin.measured_n) > force_n - 1.0
    wired.replug()
    wired.until(lambda: is_taken(wired, RESET, heartbeat=7), 2.0)
    assert float(wired.twin.measured_n) > force_n - 1.0, "it still presses"
    wired.until(lambda: is_taken(wired, TARE), 2.0)
    assert abs(wired.controller.zero_n) < 1.5, "what friction keeps"


@pytest.mark.parametrize("has_died", [True, False])
@pytest.mark.parametrize("force_n", [5.0, 40.0])
def test_nor_is_it_where_the_gateway_was_started_anew_meanwhile(has_died: bool, force_n: float) -> None:
    """However long ago: it is told the safe voltage when it comes back, and 40 N were the zero of all that followed."""
    wired = Wired(strict()).pressing(force_n)
    wired.unplug()
    wired.start(unclean=has_died)
    wired.loop.on_output_closed()
    wired.run(3.0)
    wired.replug()
    assert float(wired.twin.measured_n) > force_n - 1.0
    wired.until(lambda: is_taken(wired, TARE), 2.0)
    assert abs(wired.controller.zero_n) < 1.5, "what friction keeps"


def is_taken(wired: Wired, word: int, heartbeat: int = 0) -> bool:
    """Written as soon as it is taken."""
    try:
        wired.write(0, word, 0, 0, 0, heartbeat)
    except Refusal:
        return False
    return True
