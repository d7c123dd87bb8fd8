"""What the control loop makes of its lines: another load cell, a lost valve, a restart, rows of a pull, idle ticks."""

from types import SimpleNamespace

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.devices import ValveHost
from gateway.profiles import load_device
from gateway.registers.words import State, StatusBit
from gateway.service.running_rig.lines.valve_line import ValveExchange
from tests.service.wired import ENABLE, Wired

RESET = 2


def test_another_cell_behind_the_port_stops_a_force_and_is_asked_again_by_a_reset() -> None:
    wired = Wired().pressing(12.0)
    identity = wired.loop._cell.identity
    identity.fault, identity.said = FaultCode.WRONG_DEVICE, "KERN 1.2"
    assert wired.voltage_reaches_safe(0.1) <= 0.1
    assert wired.fault_code is FaultCode.WRONG_DEVICE
    assert any("KERN 1.2" in sentence for sentence in wired.said("A"))
    wired.run(0.5)
    wired.write(0, RESET)
    assert identity.fault is FaultCode.NONE and wired.state is State.OFF
    wired.run(0.3)
    wired.write(0, ENABLE, 1200)
    assert wired.loop.decision and wired.loop.decision.enable_block is RefusalReason.NONE


def test_where_each_sample_decides_no_tick_decides_beside_it() -> None:
    wired = Wired().pressing(12.0)
    decide, decided = wired.controller.decide, [0]

    def count(*arguments: object) -> float:
        decided[0] += 1
        return decide(*arguments)  # type: ignore[arg-type]

    wired.controller.decide = count  # type: ignore[method-assign,assignment]
    samples = wired.loop.samples
    wired.run(1.0)
    assert decided[0] <= 1.1 * (wired.loop.samples - samples)


def test_the_cause_of_a_restart_is_shown_until_there_is_a_fault_of_now() -> None:
    wired = Wired()
    wired.start(unclean=True)
    wired.loop.restart_cause = FaultCode.LOOP_STALLED
    wired.run(0.3)
    assert wired.fault_code is FaultCode.LOOP_STALLED
    wired.controller.fail_internally(wired.now_s)
    wired.run(0.05)
    assert wired.fault_code is FaultCode.INTERNAL


def test_a_valve_whose_port_goes_is_lost_at_once_and_found_again_with_it() -> None:
    wired = Wired().ready()
    wired.loop.valve = valve = ValveExchange(ValveHost(load_device("mcu-valve")), lambda data: None, 0.1)
    before = wired.loop.decision
    wired.loop.on_valve_closed()
    assert valve.status.lost and wired.loop.decision is not before
    wired.loop.on_valve_opened()
    assert not valve.status.lost


def test_rows_of_a_pull_are_none_of_the_ring_whose_plant_pushes() -> None:
    wired, rows = Wired().ready(), list[object]()
    wired.loop.ring = SimpleNamespace(append=rows.append)  # type: ignore[assignment]
    decision = wired.loop.decision
    assert decision
    for status, count in ((StatusBit.PULLING, 0), (StatusBit.ENABLED, 1)):
        wired.loop.decision = decision._replace(status=status)
        wired.loop._record()
        assert len(rows) == count
