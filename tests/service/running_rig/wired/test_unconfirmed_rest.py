"""Off is what everybody takes for "nothing presses": it is not said of an output that has not obeyed the safe voltage."""

from collections.abc import Callable

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.registers import Refusal
from gateway.registers.words import State
from tests.service.rigs import strict
from tests.service.wired import ENABLE, RESET, Wired

T_DAC_S, TICK_S, ANSWER_S = 0.1, 0.01, 0.06
DISOBEDIENCE = {
    FaultCode.OUTPUT_SILENT: {"output.silent": True},
    FaultCode.OUTPUT_REFUSED: {"output.refuse": True},
    FaultCode.OUTPUT_ALTERED: {"output.alter": 1.0},
}


def disable(wired: Wired) -> None:
    wired.write(0, 0)


def ramp_to_zero(wired: Wired) -> None:
    wired.controller.stop()
    wired.until(lambda: wired.state is not State.HOLDING, 0.1)


def disobeying(fault: FaultCode) -> Wired:
    """A force is held by an output that from now on does not obey."""
    wired = Wired(strict()).pressing(12.0)
    wired.run(0.5)
    wired.world.simulate({"do": "sim", "set": DISOBEDIENCE[fault]})
    return wired


@pytest.mark.sampled
@pytest.mark.parametrize("let_go", [disable, ramp_to_zero])
@pytest.mark.parametrize("fault", DISOBEDIENCE, ids=lambda fault: fault.name.lower())
def test_a_force_that_is_let_go_into_an_output_that_does_not_obey_is_a_fault_and_not_off(
    fault: FaultCode, let_go: Callable[[Wired], None]
) -> None:
    wired = disobeying(fault)
    let_go(wired)
    wired.until(lambda: wired.state is State.FAULT, T_DAC_S + ANSWER_S + 3 * TICK_S + 0.1)
    assert wired.fault_code is fault
    wired.run(1.0)
    assert wired.state is State.FAULT and len(wired.said("A31")) == 1, wired.log


@pytest.mark.parametrize("fault", DISOBEDIENCE, ids=lambda fault: fault.name.lower())
def test_no_reset_makes_it_off_for_longer_than_the_bound_until_it_obeys(fault: FaultCode) -> None:
    wired = disobeying(fault)
    disable(wired)
    wired.run(0.5)
    try:
        wired.write(0, RESET, 0, 0, 0, 1)
    except Refusal:
        assert wired.state is State.FAULT
    wired.run(T_DAC_S + ANSWER_S + 2 * TICK_S)
    assert wired.state is State.FAULT and wired.fault_code is fault
    wired.world.simulate({"do": "sim", "clear_all": True})
    wired.run(0.5)
    wired.write(0, RESET, 0, 0, 0, 2)
    wired.run(1.0)
    assert wired.state is State.OFF and wired.force_n < 3.0
    wired.pressing(12.0)
    wired.observer.check(wired.rig)


def test_what_is_not_heard_is_not_reset() -> None:
    """Nobody knows what it puts out."""
    wired = disobeying(FaultCode.OUTPUT_SILENT)
    wired.run(0.5)
    with pytest.raises(Refusal) as refused:
        wired.write(0, RESET, 0)
    assert refused.value.reason is RefusalReason.OUTPUT_FAULT
    assert "whether air still presses is not known" in str(refused.value)
    assert wired.state is State.FAULT and wired.fault_code is FaultCode.OUTPUT_SILENT


def test_an_unplugged_output_is_not_reset_before_it_is_back() -> None:
    wired = Wired(strict()).pressing(12.0)
    wired.unplug()
    wired.run(0.1)
    with pytest.raises(Refusal):
        wired.write(0, RESET, 0)
    wired.replug()
    wired.run(0.3)
    wired.write(0, RESET, 0)
    wired.run(0.1)
    assert wired.state is State.OFF


@pytest.mark.parametrize("fault", DISOBEDIENCE, ids=lambda fault: fault.name.lower())
def test_once_the_safe_voltage_stands_such_an_output_only_keeps_an_enable_back(fault: FaultCode) -> None:
    wired = Wired(strict()).pressing(12.0)
    disable(wired)
    wired.run(0.5)
    wired.world.simulate({"do": "sim", "set": DISOBEDIENCE[fault]})
    wired.run(2.0)
    assert wired.state is State.OFF and wired.fault_code is FaultCode.NONE
    if fault is FaultCode.OUTPUT_SILENT:  # what is never asked is never refused
        with pytest.raises(Refusal):
            wired.write(0, ENABLE, 1200)


def test_a_voltage_that_was_on_its_way_at_the_disable_is_not_taken_for_the_one_before_it() -> None:
    """0 V were confirmed, and then the first volt of a force has gone out: its answer is not here when the force is let go."""
    wired = Wired(strict()).ready()
    wired.run(0.5)
    wired.write(0, ENABLE, 1200)
    wired.until(lambda: wired.observer.settings[-1].voltage_v > 0.0, 0.2)
    wired.world.simulate({"do": "sim", "set": {"output.refuse": True}})
    disable(wired)
    wired.run(1.0)
    assert wired.twin.pressure_pa > 0.0
    assert wired.state is State.FAULT and wired.fault_code is FaultCode.OUTPUT_REFUSED


def test_an_output_that_obeys_is_off_and_no_fault() -> None:
    wired = Wired(strict())
    for force_n in (3.0, 12.0, 20.0):
        wired.pressing(force_n)
        disable(wired)
        wired.run(0.03)
        wired.write(0, ENABLE, 500)
        wired.run(0.03)
        disable(wired)
        wired.run(1.0)
        assert wired.state is State.OFF
    assert not wired.said("A3")
