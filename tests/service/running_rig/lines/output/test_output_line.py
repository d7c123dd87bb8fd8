"""One question on the wire, and of waiting setpoints only the last: the output line with a device played by the test."""

import pytest

from gateway.codes.faults import FaultCode
from tests.service.running_rig.lines.output.played_output import REPLY_TIMEOUT_S, ROUND_TRIP_S, Wire, wire

__all__ = ["wire"]


def test_a_voltage_is_sent_at_once_when_the_wire_is_free(wire: Wire) -> None:
    wire.set_voltage(512)
    assert wire.written == [b"SET 512\r\n"]
    assert wire.exchange.acknowledged_v is None and wire.exchange.line.sent_s == wire.now_s
    wire.answer("512")
    assert wire.exchange.acknowledged_v == pytest.approx(512 * 10 / 1023)
    assert wire.exchange.round_trip_s == pytest.approx(ROUND_TRIP_S)


def test_of_waiting_setpoints_only_the_last_is_sent(wire: Wire) -> None:
    wire.set_voltage(100)
    for counts in (200, 300, 400, 900, 350):
        wire.set_voltage(counts, after_s=0.001)
    assert wire.written == [b"SET 100\r\n"]
    wire.answer("100")
    assert wire.written == [b"SET 100\r\n", b"SET 350\r\n"]


def test_what_stands_is_not_known_while_another_voltage_is_on_its_way(wire: Wire) -> None:
    wire.settle(100)
    assert wire.exchange.standing_v == pytest.approx(100 * 10 / 1023)
    wire.set_voltage(500)
    assert wire.exchange.standing_v is None
    assert wire.exchange.acknowledged_v == pytest.approx(100 * 10 / 1023)


def test_a_thousand_setpoints_leave_no_queue_behind(wire: Wire) -> None:
    for counts in range(1000):
        wire.set_voltage(counts, after_s=0.0001)
    wire.answer("0")
    wire.answer("999")
    assert [line for line in wire.written if line.startswith(b"SET")] == [b"SET 0\r\n", b"SET 999\r\n"]


def test_there_is_never_a_second_question_on_the_wire(wire: Wire) -> None:
    wire.set_voltage(100)
    for _ in range(5):
        wire.tick(0.01)
        wire.set_voltage(500)
    assert len(wire.written) == 1


def test_within_half_a_step_of_the_device_nothing_is_sent(wire: Wire) -> None:
    wire.settle(512.4)
    before = len(wire.written)
    wire.set_voltage(512.49)
    wire.set_voltage(511.51)
    assert len(wire.written) == before
    wire.set_voltage(512.6)
    assert wire.last == "SET 513"


def test_the_idle_wire_asks_for_the_pressure_ten_times_a_second(wire: Wire) -> None:
    wire.settle(512)
    polls = wire.written.count(b"MON\r\n")
    for _ in range(100):
        wire.tick(0.01)
        if wire.exchange.unanswered_since_s is not None:
            wire.answer("512", after_s=0.0)
    assert 9 <= wire.written.count(b"MON\r\n") - polls <= 11
    assert wire.pressures_pa[-1] == pytest.approx(512 * 0.9e6 / 1023)


def test_a_setpoint_goes_before_a_pressure_poll(wire: Wire) -> None:
    wire.settle(512)
    wire.tick(0.2)
    assert wire.last == "MON"
    wire.set_voltage(600)
    wire.answer("400", after_s=0.2)  # the next poll is due as well
    assert wire.last == "SET 600"


def test_after_a_question_without_an_answer_the_setting_goes_out_anew(wire: Wire) -> None:
    """A device that was without power stands where it begins then, and no pressure tells which setting that is."""
    wire.settle(0)
    wire.tick(0.2)
    assert wire.last == "MON"
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    assert wire.last == "SET 0"
    wire.answer("0")
    assert wire.last == "MON", "and once it is confirmed, it stands"


def test_before_the_first_wish_nothing_is_asked(wire: Wire) -> None:
    """I6: the first thing a device hears after an opening is control's voltage, not a poll."""
    for _ in range(50):
        wire.tick()
    assert wire.written == []
    wire.set_voltage(0)
    assert wire.written == [b"SET 0\r\n"]


def test_after_a_lost_answer_the_newest_voltage_is_asked_again(wire: Wire) -> None:
    wire.set_voltage(512)
    wire.set_voltage(300)
    wire.tick(REPLY_TIMEOUT_S - 0.001)
    assert wire.written == [b"SET 512\r\n"]
    wire.tick(0.002)
    assert wire.written == [b"SET 512\r\n", b"SET 300\r\n"]
    wire.answer("300")
    assert wire.exchange.acknowledged_v == pytest.approx(300 * 10 / 1023)


def test_silence_keeps_its_age_over_retries(wire: Wire) -> None:
    wire.set_voltage(512)
    began_s = wire.now_s
    for _ in range(30):
        wire.tick()
    assert len(wire.written) >= 4
    assert wire.exchange.unanswered_since_s == began_s
    wire.answer("512")
    assert wire.exchange.unanswered_since_s != began_s


def test_silence_while_nothing_is_wanted_is_noticed_by_a_poll(wire: Wire) -> None:
    wire.settle(512)
    began_s = wire.now_s
    for _ in range(30):
        wire.tick()
    assert wire.exchange.unanswered_since_s is not None
    assert wire.exchange.unanswered_since_s - began_s <= 0.11


@pytest.mark.parametrize("failures", [1, 2])
def test_one_or_two_bad_echoes_are_noise(wire: Wire, failures: int) -> None:
    wire.set_voltage(512)
    for _ in range(failures):
        wire.answer("510")
    assert wire.exchange.fault is FaultCode.NONE
    wire.answer("512")
    assert wire.exchange.acknowledged_v == pytest.approx(512 * 10 / 1023)


def test_three_bad_echoes_in_a_row_are_an_altered_output(wire: Wire) -> None:
    wire.set_voltage(512)
    for _ in range(3):
        wire.answer("510")
    assert wire.exchange.fault is FaultCode.OUTPUT_ALTERED
    assert wire.exchange.acknowledged_v == pytest.approx(510 * 10 / 1023)  # what stands, not what was asked


@pytest.mark.parametrize("cut_before", [0, 2])
def test_an_echo_cut_down_to_0_keeps_no_safe_voltage_back(wire: Wire, cut_before: int) -> None:
    """The device stands at 510 counts, and of its echo only the last digit arrived: then the output is disabled."""
    wire.set_voltage(510)
    for _ in range(cut_before):
        wire.answer("0")
        assert wire.last == "SET 510"
    wire.set_voltage(0)
    wire.answer("0")
    assert wire.last == "SET 0"
    wire.answer("0")
    assert wire.exchange.acknowledged_v == 0.0 and not wire.exchange.fault, "a good echo heals what bad ones have found"


def test_behind_a_bad_echo_a_good_one_is_asked_for_once_more(wire: Wire) -> None:
    """A stray 0 on the wire of a device that stands at 50 counts: it was believed, and 0.49 V stood for good."""
    wire.set_voltage(0)
    wire.answer("50")
    wire.answer("0")
    assert wire.last == "SET 0" and wire.exchange.standing_v is None
    wire.answer("50")
    assert wire.exchange.standing_v is None
    for _ in range(2):
        assert wire.last == "SET 0"
        wire.answer("0")
    assert wire.exchange.standing_v == 0.0


def test_a_good_echo_between_bad_ones_starts_the_count_anew(wire: Wire) -> None:
    for counts in (512, 600, 512):
        wire.set_voltage(counts)
        wire.answer("510")
        wire.answer("510")
        wire.answer(str(counts))
    assert wire.exchange.fault is FaultCode.NONE


def test_three_refusals_in_a_row_are_a_refused_output(wire: Wire) -> None:
    wire.set_voltage(512)
    for _ in range(3):
        assert wire.exchange.fault is FaultCode.NONE
        wire.answer("OUT OF RANGE")
    assert wire.exchange.fault is FaultCode.OUTPUT_REFUSED
    assert wire.exchange.acknowledged_v is None


def test_the_fault_is_gone_once_the_device_obeys_again(wire: Wire) -> None:
    wire.set_voltage(512)
    for _ in range(3):
        wire.answer("UNKNOWN COMMAND")
    wire.answer("512")
    assert wire.exchange.fault is FaultCode.NONE


def test_refused_polls_are_no_fault_any_more_once_one_is_answered(wire: Wire) -> None:
    """Where the safe voltage stands nothing is set anew: the polls alone must end what they have begun."""
    wire.settle(0)
    for _ in range(3):
        while wire.exchange.unanswered_since_s is None:
            wire.tick()
        wire.answer("UNKNOWN COMMAND")
    assert wire.exchange.fault is FaultCode.OUTPUT_REFUSED
    while wire.exchange.unanswered_since_s is None:
        wire.tick()
    assert wire.last == "MON"
    wire.answer("7")
    assert wire.exchange.fault is FaultCode.NONE


def test_garbage_is_counted_and_answers_nothing(wire: Wire) -> None:
    wire.set_voltage(512)
    wire.answer("5a2")
    assert (wire.exchange.counts.asked, wire.exchange.counts.heard, wire.exchange.counts.garbled) == (1, 0, 1)
    assert wire.exchange.unanswered_since_s is not None
    wire.answer("512")
    assert wire.exchange.acknowledged_v == pytest.approx(512 * 10 / 1023)


def test_noise_does_not_keep_a_silent_device_from_being_asked_again(wire: Wire) -> None:
    """A motor cable beside the wire: something comes all the time, and nothing of it is an answer."""
    wire.set_voltage(512)
    began_s = wire.now_s
    for _ in range(15):
        wire.answer("5a2", after_s=0.01)
        wire.tick(0.0)
    assert wire.written == [b"SET 512\r\n"] * 3
    assert wire.exchange.unanswered_since_s == began_s


def test_what_nobody_asked_for_tells_nothing(wire: Wire) -> None:
    """A second answer to one question, or somebody's at the device's own keys."""
    wire.settle(512)
    for _ in range(5):
        wire.answer("510", after_s=0.001)
    exchange = wire.exchange
    assert (exchange.fault, exchange.acknowledged_v) == (FaultCode.NONE, pytest.approx(512 * 10 / 1023))
    assert exchange.counts.heard == exchange.counts.asked == 2


def test_an_answer_in_pieces_is_an_answer(wire: Wire) -> None:
    wire.set_voltage(512)
    for piece in (b"5", b"1", b"2\r", b"\n"):
        wire.exchange.on_bytes(piece, wire.now_s)
    assert wire.exchange.acknowledged_v == pytest.approx(512 * 10 / 1023)


def test_opened_again_nothing_said_before_counts(wire: Wire) -> None:
    wire.set_voltage(512)
    wire.answer("510")
    wire.answer("510")
    wire.answer("510")
    wire.set_voltage(900)
    wire.exchange.reset()
    exchange = wire.exchange
    assert (exchange.acknowledged_v, exchange.unanswered_since_s, exchange.fault) == (None, None, FaultCode.NONE)
    before = len(wire.written)
    wire.tick()
    assert len(wire.written) == before, "the old wish is not sent to a device behind a new opening"
    wire.answer("900")  # of a question asked before
    assert exchange.acknowledged_v is None


def test_a_device_that_seems_to_have_tripped_is_told_the_safe_voltage_and_asked_for_no_reading(wire: Wire) -> None:
    wire.settle(512)
    wire.tick(0.1)
    wire.answer("0")
    wire.exchange.checks.trip()
    before = len(wire.written)
    wire.set_voltage(0)
    assert wire.written[before:] == [b"SET 0\r\n"]
    wire.answer("0")
    for _ in range(20):
        wire.set_voltage(0, after_s=0.05)
        wire.tick(0.05)
    assert wire.written[before:] == [b"SET 0\r\n"]


def test_a_tripped_device_hears_the_same_setting_no_more_often_than_a_poll(wire: Wire) -> None:
    wire.settle(512)
    wire.exchange.checks.trip()
    before, began_s = len(wire.written), wire.now_s
    while wire.now_s < began_s + 1.0:
        wire.set_voltage(0)
        wire.answer("UNKNOWN COMMAND", after_s=0.005)
        wire.tick(0.005)
    assert set(wire.written[before:]) == {b"SET 0\r\n"}
    assert wire.exchange.fault is FaultCode.WATCHDOG_TRIPPED, "which is why it refuses"
    assert 8 <= len(wire.written) - before <= 12
