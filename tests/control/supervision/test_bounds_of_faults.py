"""Each bound of the fault detection by itself: at it nothing is wrong yet, or everything is, and a cause is named once."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control import LineStatus
from gateway.control.blame_for_silence import Held
from gateway.control.inputs import ValveStatus
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.fault_detection import FaultDetector
from gateway.control.supervision.plausibility import ExpectedForce
from gateway.devices.valve_profile import ValveDirection
from tests.control.bench import bsfm, settings

NOW_S = 4.0
WELL, READY = Reading(10.0, 10.0, 0.0, 0.0625, True, True, True), LineStatus(acknowledged_v=0.0)
PUSH = ValveDirection.PUSH


def detector() -> FaultDetector:
    return FaultDetector(settings(output_timeout_s=0.125, stall_s=0.25))


def fault(one: FaultDetector, line: LineStatus = READY, reading: Reading = WELL, now_s: float = NOW_S) -> FaultCode:
    cause = one.first_cause(now_s, reading, line, lambda: 10.0)
    return cause.fault if cause else FaultCode.NONE


def observe(one: FaultDetector, contact_n: float, times: int) -> None:
    response = ExpectedForce(bsfm(), 0.1, 0.0)
    for _ in range(times):
        one.observe(WELL._replace(contact_n=contact_n), response, 1.0, True)


def test_the_largest_force_itself_is_over_it_and_stays_so_over_a_start() -> None:
    one, most_n = detector(), settings().limits.over_force_n
    observe(one, most_n, 2)
    assert fault(one) is FaultCode.NONE
    one.start()
    assert one.enable_block(NOW_S, WELL, READY) is RefusalReason.NOT_READY, "a valve's turn is no new beginning for it"
    observe(one, most_n, 1)
    assert fault(one) is FaultCode.OVER_FORCE
    observe(one, most_n - 0.01, 1)
    assert fault(one) is FaultCode.NONE


def test_over_force_is_a_row_of_samples_and_one_below_it_begins_a_new_one() -> None:
    one, most_n = detector(), settings().limits.over_force_n
    for _ in range(3):
        observe(one, most_n, 2)
        assert fault(one) is FaultCode.NONE
        observe(one, 0.0, 1)


def test_a_cell_that_has_repeated_itself_at_rest_is_looked_at_anew_from_an_enable_on() -> None:
    """Told to allow two equal samples, and resting at 0 without noise, it would be dead at each enable."""
    one, response = FaultDetector(settings(frozen_equal_samples=2)), ExpectedForce(bsfm(), 0.1, 0.0)
    still = WELL._replace(raw_n=0.0, cell_n=0.0, contact_n=0.0)
    for _ in range(3):
        one.observe(still, response, 1.0, False)
    assert fault(one) is FaultCode.SAMPLE_FROZEN
    one.start()
    assert fault(one) is FaultCode.NONE


@pytest.mark.parametrize(
    ("contact_n", "cell_n", "direction", "words"),
    [
        (100.0, 8.0, 1.0, "92.0 N of it are the payload's weight"),
        (100.0, 8.0, -1.0, ": -92.0 N of it are the payload's weight"),
        (100.0, 100.0, 1.0, "kgf and N mixed up"),
        (100.0, -92.0, 1.0, "kgf and N mixed up"),
        (-100.0, -100.0, 1.0, "kgf and N mixed up"),
    ],
)
def test_a_force_that_is_too_large_by_a_payload_alone_is_told_so(
    contact_n: float, cell_n: float, direction: float, words: str
) -> None:
    """A master has written 9 kg for 0.9: neither a jam, nor the cell's unit; in a pull the weight acts the other way."""
    one, reading = detector(), WELL._replace(contact_n=contact_n, cell_n=cell_n)
    one.direction = direction
    response = ExpectedForce(bsfm(), 0.1, 0.0)
    for _ in range(3):
        one.observe(reading, response, 1.0, True)
    cause = one.first_cause(NOW_S, reading, READY, lambda: 10.0)
    assert cause and cause.fault is FaultCode.OVER_FORCE and words in cause.sentence


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_nothing_begins_on_one_reading_of_the_largest_force(sign: float) -> None:
    """Three in a row are a fault under force; one is enough not to begin to press."""
    one, most_n = detector(), settings().limits.over_force_n
    for contact_n, reason in (
        (most_n - 0.01, RefusalReason.NONE),
        (most_n, RefusalReason.NOT_READY),
        (most_n - 0.01, RefusalReason.NONE),
    ):
        observe(one, sign * contact_n, 1)
        assert one.enable_block(NOW_S, WELL, READY) is reason


def test_a_force_at_rest_that_keeps_an_enable_back_is_told() -> None:
    """To a master that was not there when it began."""
    one, most_n = detector(), settings().limits.over_force_n
    reading = WELL._replace(contact_n=most_n + 1.0)
    assert one.excuse(RefusalReason.NOT_READY, NOW_S, reading, READY) == ""
    observe(one, most_n + 1.0, 1)
    told = one.excuse(RefusalReason.NOT_READY, NOW_S, reading, READY)
    assert f"{most_n + 1.0:.1f} N measured, over-force is {most_n:.1f} N" in told
    saturated = one.excuse(RefusalReason.NOT_READY, NOW_S, reading._replace(overload=True), READY)
    assert "over-force, open or shorted wires" in saturated
    observe(one, 20.0, 1)
    for _ in range(200):
        one.observe_rest(WELL._replace(contact_n=20.0, interval_s=0.01))
    told = one.excuse(RefusalReason.NOT_READY, NOW_S, WELL._replace(contact_n=20.0), READY)
    assert one.is_stuck and told.startswith("W304 20.0 N measured with the output disabled")
    assert one.excuse(RefusalReason.CELL_SILENT, NOW_S, WELL, READY) != told


def test_a_force_is_stuck_behind_one_second_without_a_break() -> None:
    one = detector()
    for contact_n, readings, is_stuck in ((16.0, 15, False), (15.0, 1, False), (16.0, 15, False), (-16.0, 1, True)):
        for _ in range(readings):
            one.observe_rest(WELL._replace(contact_n=contact_n))
        assert one.is_stuck is is_stuck


def test_what_was_left_at_rest_before_an_enable_does_not_count_behind_it() -> None:
    """Else a force that only decays behind the next disable would be a stuck one, and keep the enable back."""
    one = detector()
    for _ in range(2):
        for _ in range(15):
            one.observe_rest(WELL._replace(contact_n=16.0))
        assert not one.is_stuck
        one.start()


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (READY._replace(unanswered_since_s=NOW_S - 0.125), FaultCode.NONE),
        (READY._replace(unanswered_since_s=NOW_S - 0.1875), FaultCode.OUTPUT_SILENT),
        (READY._replace(late_s=0.25), FaultCode.NONE),
        (READY._replace(late_s=0.5), FaultCode.LOOP_STALLED),
        (READY._replace(late_s=0.5, waited_s=0.1875), FaultCode.LOOP_STALLED),
        (READY._replace(late_s=0.5, waited_s=0.25), FaultCode.MACHINE_BUSY),
        (READY._replace(late_s=0.5, waited_s=0.0, withheld=(0.1875, "host")), FaultCode.LOOP_STALLED),
        (READY._replace(late_s=0.5, waited_s=0.0, withheld=(0.25, "host")), FaultCode.MACHINE_BUSY),
        (READY._replace(late_s=0.5, fault=FaultCode.OUTPUT_LOST), FaultCode.LOOP_STALLED),
        (READY._replace(fault=FaultCode.OUTPUT_LOST, cell_lost=True), FaultCode.OUTPUT_LOST),
        (READY._replace(cell_lost=True), FaultCode.CELL_LOST),
    ],
)
def test_a_line_is_at_fault_behind_its_bound_and_what_makes_others_follow_goes_first(
    line: LineStatus, code: FaultCode
) -> None:
    assert fault(detector(), line) is code


def test_a_saturated_cell_is_a_force_and_one_without_a_number_is_none() -> None:
    unusable = WELL._replace(is_usable=False)
    assert fault(detector(), reading=unusable) is FaultCode.NOT_FINITE
    assert fault(detector(), reading=unusable._replace(overload=True)) is FaultCode.NONE
    assert fault(detector(), reading=WELL._replace(is_fresh=False)) is FaultCode.SAMPLE_STALE


def test_a_silence_is_told_with_its_length_and_what_the_answer_before_took() -> None:
    late = READY._replace(unanswered_since_s=NOW_S - 0.25, answer_late_s=0.2)
    told = detector().first_cause(NOW_S, WELL, late, lambda: 0.0)
    assert told and "for 250 ms, allowed 125 ms" in told.sentence and "200 ms" in told.sentence
    plain = detector().first_cause(NOW_S, WELL, late._replace(answer_late_s=0.0), lambda: 0.0)
    assert plain and "took" not in plain.sentence
    from_the_start = detector().first_cause(0.25, WELL, READY._replace(unanswered_since_s=0.0), lambda: 0.0)
    assert from_the_start and "for 250 ms" in from_the_start.sentence


def test_a_refused_voltage_may_be_a_channel_that_is_not_there() -> None:
    """An I-7022 answers each setting of `channel: 2` so: it has two, and shares its profile with the I-7024, which has four."""
    told = detector().first_cause(NOW_S, WELL, READY._replace(fault=FaultCode.OUTPUT_REFUSED), lambda: 0.0)
    assert told and "its channel" in told.sentence


@pytest.mark.parametrize(
    ("line", "reading", "reason"),
    [
        (READY, WELL, RefusalReason.NONE),
        (READY._replace(fault=FaultCode.OUTPUT_REFUSED), WELL, RefusalReason.OUTPUT_FAULT),
        (READY._replace(unanswered_since_s=3.0), WELL, RefusalReason.OUTPUT_FAULT),
        (READY._replace(cell_lost=True), WELL, RefusalReason.CELL_SILENT),
        (READY, WELL._replace(is_fresh=False), RefusalReason.CELL_SILENT),
        (READY, WELL._replace(is_usable=False), RefusalReason.NOT_READY),
        (READY._replace(acknowledged_v=None), WELL, RefusalReason.NOT_READY),
        (READY._replace(valve=ValveStatus(PUSH)), WELL, RefusalReason.NONE),
        (READY._replace(valve=ValveStatus(None)), WELL, RefusalReason.VALVE_UNKNOWN),
        (READY._replace(valve=ValveStatus(PUSH, lost=True)), WELL, RefusalReason.VALVE_UNKNOWN),
        (READY._replace(late_s=0.25), WELL, RefusalReason.NONE),
        (READY._replace(late_s=0.5), WELL, RefusalReason.NOT_READY),
    ],
)
def test_each_thing_that_is_not_well_keeps_an_enable_back_by_itself(
    line: LineStatus, reading: Reading, reason: RefusalReason
) -> None:
    assert detector().enable_block(NOW_S, reading, line) is reason


def test_an_enable_waits_behind_a_stall_for_as_long_as_one_may_last_and_is_told_how_long_it_was() -> None:
    one = detector()
    one.observe_lateness(NOW_S, READY._replace(late_s=0.25))
    assert one.enable_block(NOW_S, WELL, READY) is RefusalReason.NONE
    one.observe_lateness(NOW_S, READY._replace(late_s=0.5))
    assert one.enable_block(NOW_S + 0.1875, WELL, READY) is RefusalReason.NOT_READY
    assert "500 ms" in one.excuse(RefusalReason.NOT_READY, NOW_S + 0.1875, WELL, READY)
    assert one.enable_block(NOW_S + 0.25, WELL, READY) is RefusalReason.NONE


def test_a_fault_that_the_line_reports_is_no_silence_that_something_else_is_blamed_for() -> None:
    held = READY._replace(unanswered_since_s=3.0, output_held=Held(loop_late_s=0.9))
    one = detector()
    assert "our own loop came" in one.excuse(RefusalReason.OUTPUT_FAULT, NOW_S, WELL, held)
    assert one.excuse(RefusalReason.OUTPUT_FAULT, NOW_S, WELL, held._replace(fault=FaultCode.OUTPUT_LOST)) == ""
    assert one.excuse(RefusalReason.NONE, NOW_S, WELL, held) == ""
