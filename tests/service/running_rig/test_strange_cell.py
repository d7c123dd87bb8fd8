"""Another load cell than the rig names is a fault of its line, and a loop that samples have moved leaves its ticks alone."""

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.registers.words import State
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
