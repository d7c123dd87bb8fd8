"""A device that was not heard in time: what the machine did to us is told apart from what a wire does."""

from math import nan

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control.blame_for_silence import Held, cause_of_silence
from gateway.control.inputs import LineStatus
from gateway.registers.words import ControlBit, State
from tests.control.bench import Bench, has_fault

STALE, SILENT, BUSY = FaultCode.SAMPLE_STALE, FaultCode.OUTPUT_SILENT, FaultCode.MACHINE_BUSY
WIRES = "power or wires"
OUTPUT_FAULT = RefusalReason.OUTPUT_FAULT


@pytest.mark.parametrize("fault", [STALE, SILENT])
@pytest.mark.parametrize(
    ("held", "is_busy", "words"),
    [
        (Held(), False, "power or wires"),
        (Held(loop_late_s=0.02), False, "our own loop came 20 ms late in that time: power or wires"),
        (
            Held(loop_late_s=0.24, loop_waited_s=0.2),
            True,
            "240 ms late in that time, 200 ms of them waiting for a processor",
        ),
        (Held(loop_late_s=0.16, loop_waited_s=0.09), True, "160 ms late in that time, 90 ms of them waiting"),
        (Held(loop_late_s=0.24, loop_waited_s=0.01), False, "240 ms late in that time, only 10 ms of them waiting"),
        (Held(loop_late_s=0.24), False, "240 ms late in that time, not counted why: this machine stood still"),
        (
            Held(loop_late_s=0.24, loop_waited_s=0.01, withheld=(0.12, "the host did it")),
            True,
            "240 ms late in that time: the host did it",
        ),
        (
            Held(loop_late_s=0.24, loop_waited_s=0.01, withheld=(0.11, "the host did it")),
            False,
            "this machine stood still",
        ),
        (Held(rig_waited_s=0.2), True, "the simulated rig's process waited 200 ms of them for a processor"),
        (
            Held(rig_waited_s=0.2, withheld=(0.1, "a quota did it")),
            True,
            "process waited 200 ms of them for a processor: a quota did it",
        ),
        (Held(loop_late_s=0.24, loop_waited_s=0.2, withheld=(0.1, "a quota did it")), True, "a quota did it"),
        (Held(loop_late_s=0.24, loop_waited_s=0.2, withheld=(0.09, "a quota did it")), True, "end other programs"),
        (Held(rig_waited_s=0.02), False, "power or wires"),
        (Held(rig_stopped_s=0.25), False, "the simulated rig's process was stopped for 250 ms"),
    ],
)
def test_the_larger_part_of_a_silence_is_its_cause(fault: FaultCode, held: Held, is_busy: bool, words: str) -> None:
    found, said = cause_of_silence(fault, 0.256, held, WIRES)
    assert found is (BUSY if is_busy else fault)
    assert words in said
    ours = max(held.loop_late_s, held.rig_waited_s, held.rig_stopped_s)
    assert (WIRES in said) is (ours < 0.128)
    assert cause_of_silence(fault, nan, held, WIRES)[0] is fault, "never heard: no lateness explains that"


def test_a_loop_that_came_in_time_is_not_said_to_have_come_0_ms_late() -> None:
    assert cause_of_silence(STALE, 0.256, Held(loop_late_s=3e-4), WIRES)[1] == WIRES


@pytest.mark.parametrize("is_cell", [True, False])
@pytest.mark.parametrize("held", [Held(), Held(rig_waited_s=0.09), Held(loop_late_s=0.09, loop_waited_s=0.0)])
def test_no_alarm_and_no_refusal_names_a_wire_for_a_machine_that_stood_still(is_cell: bool, held: Held) -> None:
    bench = Bench()
    bench.run(0.5)
    bench.enable(15.0)
    bench.run(1.0)
    bench.line = bench.line._replace(**{"cell_held" if is_cell else "output_held": held})
    bench.cell_silent, bench.output_silent = is_cell, not is_cell
    fault = BUSY if held.rig_waited_s else STALE if is_cell else SILENT
    assert bench.seconds_until(has_fault(fault), 0.2) < 0.15
    (sentence,) = (event for event in bench.events if event[:4] in ("A311", "A314", "A403"))
    assert "allowed" in sentence and " ms" in sentence
    assert ("power" in sentence) is (held == Held())


def test_no_wire_is_named_for_an_output_that_answers_in_other_words() -> None:
    bench = Bench()
    bench.run(0.5)
    bench.enable(15.0)
    bench.run(1.0)
    bench.line = bench.line._replace(said="it says '!02', no answer that its profile knows")
    bench.output_silent = True
    assert bench.seconds_until(has_fault(SILENT), 0.2) < 0.15
    (sentence,) = (event for event in bench.events if event.startswith("A314"))
    assert "allowed 100 ms: it says '!02', no answer" in sentence and "wires" not in sentence


@pytest.mark.parametrize("held", [Held(), Held(rig_waited_s=0.09)])
def test_a_refused_enable_does_not_either(held: Held) -> None:
    bench = Bench()
    bench.run(0.5)
    bench.cell_silent = True
    bench.line = LineStatus(acknowledged_v=0.0, cell_held=held)
    bench.run(0.1)
    bench.write(control_word=ControlBit.ENABLE, force_setpoint_n=5.0)
    assert bench.refused and bench.refused.reason is RefusalReason.CELL_SILENT and bench.last.state is State.OFF
    assert ("power" in bench.refused.text) is (held == Held())


WAITED = Held(rig_waited_s=0.4)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (LineStatus(acknowledged_v=0.0, unanswered_since_s=0.0, output_held=WAITED), "waited 400 ms of them"),
        (LineStatus(acknowledged_v=0.0, unanswered_since_s=0.0, cell_held=WAITED), OUTPUT_FAULT.explanation.sentence),
        (LineStatus(unanswered_since_s=0.0, output_held=WAITED, fault=FaultCode.OUTPUT_LOST), "port went away"),
        (LineStatus(acknowledged_v=0.0, unanswered_since_s=0.0, said="it says '!02'"), "heard in time; it says '!02'"),
        (LineStatus(acknowledged_v=0.0, cell_says="it answers 'ERR 3'"), "heard in time; it answers 'ERR 3'"),
    ],
)
def test_a_refused_enable_tells_what_is_known_of_the_line_that_it_waits_for(line: LineStatus, words: str) -> None:
    bench = Bench()
    bench.run(0.5)
    bench.cell_silent = bool(line.cell_says)
    bench.line = line
    bench.run(0.1 if line.cell_says else 0.01)
    bench.write(control_word=ControlBit.ENABLE, force_setpoint_n=5.0)
    assert bench.refused and words in bench.refused.text


@pytest.mark.parametrize(
    "line",
    [
        LineStatus(acknowledged_v=0.0, unanswered_since_s=0.0, output_held=WAITED),
        LineStatus(acknowledged_v=0.0, fault=FaultCode.OUTPUT_LOST),
    ],
    ids=["silent", "lost"],
)
def test_behind_a_fault_it_is_the_fault_that_keeps_an_enable_back(line: LineStatus) -> None:
    bench = Bench()
    bench.run(0.5)
    bench.enable(5.0)
    bench.line = line
    assert bench.run(0.1).fault is not FaultCode.NONE
    bench.disable()
    bench.enable(5.0)
    assert bench.refused and bench.refused.reason is RefusalReason.FAULT_LATCHED
    assert bench.refused.text.endswith(RefusalReason.FAULT_LATCHED.explanation.sentence)
