"""What control answers between two of its steps, and when it says that it has stopped: by the time of the question."""

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.registers.words import ControlBit, State
from gateway.registers.writes.proposed_write import ProposedWrite
from tests.control.bench import Bench
from tests.control.valve.valve_bench import PULL, PUSH, ValveBench


@pytest.mark.parametrize("bit", [ControlBit.TARE, ControlBit.ENABLE])
def test_a_reading_of_before_a_standstill_takes_no_zero_and_no_enable_behind_it(bit: ControlBit) -> None:
    """The process stood still, and a master's write is the first that comes: nobody knows what presses now."""
    bench = Bench()
    bench.run(0.5)
    asked = ProposedWrite(bench.command._replace(control_word=bit, number=bench.command.number + 1), tuple)
    assert bench.controller.refusal_of(bench.now_s, asked, bench.line) is None
    bench.loop_blocked = True
    bench.run(0.4)
    refused = bench.controller.refusal_of(bench.now_s, asked, bench.line)
    assert refused and refused.bit is bit
    if bit is ControlBit.TARE:
        assert (refused.reason, refused.text) == (
            RefusalReason.TARE_REFUSED,
            "tare refused: no fresh load-cell sample",
        )
    assert bench.controller.state is State.OFF


def test_a_rig_with_a_valve_has_stopped_when_it_stands_where_it_rests() -> None:
    """Ended before that, the valve would be left pulling, and the next start would find a tool that hangs."""
    bench = ValveBench()
    bench.pulling(12.0)
    assert bench.stands is PULL
    bench.controller.stop()
    steps = []
    for _ in range(8000):
        bench.run(0.001)
        steps.append((bench.controller.state, bench.stands, bench.controller.has_stopped))
        if bench.controller.has_stopped:
            break
    assert steps[-1] == (State.OFF, PUSH, True)
    assert (State.OFF, PULL, False) in steps, "the output goes off first"


def test_from_the_moment_on_at_which_the_gateway_stops_no_force_is_taken() -> None:
    """A write that comes before the next step would be lost, and its master told that it was taken."""
    bench = Bench()
    bench.run(0.5)
    bench.enable(10.0)
    asked = ProposedWrite(
        bench.command._replace(force_setpoint_n=20.0, number=bench.command.number + 1), lambda: ("force_setpoint",)
    )
    assert bench.controller.refusal_of(bench.now_s, asked, bench.line) is None
    bench.controller.stop()
    refused = bench.controller.refusal_of(bench.now_s, asked, bench.line)
    assert refused and refused.reason is RefusalReason.STOPPING


@pytest.mark.parametrize("state", [State.OFF, State.FAULT])
def test_a_stop_that_comes_when_nothing_is_enabled_any_more_is_no_event(state: State) -> None:
    """The bank lets it through while something presses; what has ended that before the next step is no mistake of anybody."""
    bench = Bench()
    bench.run(0.5)
    if state is State.FAULT:
        bench.enable(10.0)
        bench.cell_silent = True
        bench.run(0.5)
    said = len(bench.events)
    stopped = bench.write(control_word=ControlBit(0), stops=True)
    assert (stopped.state, stopped.voltage_v, bench.events[said:]) == (state, 0.0, [])
