"""Answers that come late, cut or lost: none is taken for the next one, and no fall of the voltage waits for it."""

import pytest

from gateway.codes.faults import FaultCode
from tests.service.running_rig.lines.output.played_output import REPLY_TIMEOUT_S, ROUND_TRIP_S, Wire, wire

__all__ = ["wire"]


class SlowDevice:
    """Obeys at once and answers in order; one answer in `every` takes longer than a host waits."""

    def __init__(self, wire: Wire, every: int, slow_s: float, pressure: str = "7") -> None:
        self.wire, self.every, self.slow_s, self.pressure = wire, every, slow_s, pressure
        self.answers: list[tuple[float, str]] = []
        self.seen = 0

    def advance(self, until_s: float) -> None:
        """To that time in steps of a millisecond, a tick every ten."""
        while self.wire.now_s < until_s - 1e-9:
            self._hear()
            self.wire.now_s += 0.001
            while self.answers and self.answers[0][0] <= self.wire.now_s:
                self.wire.answer(self.answers.pop(0)[1], after_s=0.0)
                self._hear()
            if round(self.wire.now_s * 1000) % 10 == 0:
                self.wire.tick(0.0)

    def _hear(self) -> None:
        for question in self.wire.written[self.seen :]:
            self.seen += 1
            after_s = self.slow_s if self.seen % self.every == 0 else ROUND_TRIP_S
            word = question.decode().split()[-1]
            self.answers.append((self.wire.now_s + after_s, self.pressure if word == "MON" else word))
            self.answers.sort(key=lambda answer: answer[0])


@pytest.mark.parametrize("every", [7, 10, 23])
@pytest.mark.parametrize("slow_s", [0.062, 0.075, 0.09, 0.11])
def test_a_late_answer_is_not_taken_for_the_next_one(wire: Wire, every: int, slow_s: float) -> None:
    wire.settle(200)
    device = SlowDevice(wire, every, slow_s)
    device.seen = len(wire.written)
    for index in range(200):  # a setpoint that moves all the time: the wire is never idle
        wire.set_voltage(200 + (index * 7) % 500)
        device.advance(wire.now_s + 0.01)
        assert wire.exchange.fault is FaultCode.NONE
    device.advance(wire.now_s + 0.4)
    assert wire.exchange.acknowledged_v == pytest.approx((200 + (199 * 7) % 500) * 10 / 1023)
    assert {round(pressure_pa) for pressure_pa in wire.pressures_pa} <= {0, round(7 * 0.9e6 / 1023)}
    assert wire.exchange.pressure_pa == pytest.approx(7 * 0.9e6 / 1023)


@pytest.mark.sampled
@pytest.mark.parametrize("slow_s", [0.065, 0.07, 0.08, 0.09, 0.099, 0.115, 0.13, 0.18])
@pytest.mark.parametrize("step", [1, 3, 7, -2])
def test_a_device_that_is_always_late_is_no_device_that_alters(wire: Wire, slow_s: float, step: int) -> None:
    """Its silence is as long as it is late: up to the bound of supervision the force is held, beyond it that is what is
    blamed."""
    wire.settle(400)
    device = SlowDevice(wire, every=1, slow_s=slow_s)
    device.seen = len(wire.written)
    longest_s = 0.0
    for index in range(400):
        wire.set_voltage(400 + (step * index) % 500 if index < 300 else 400)
        device.advance(wire.now_s + 0.01)
        assert wire.exchange.fault is FaultCode.NONE
        since_s = wire.exchange.unanswered_since_s
        longest_s = max(longest_s, 0.0 if since_s is None else wire.now_s - since_s)
    assert slow_s - 0.025 <= longest_s <= slow_s + 0.011
    assert wire.exchange.acknowledged_v == pytest.approx(400 * 10 / 1023)


@pytest.mark.parametrize("rounds", [20, 21, 22, 23])
def test_an_answer_that_comes_twice_makes_no_honest_device_one_that_alters(wire: Wire, rounds: int) -> None:
    """While the setpoint moves each answer behind it would be taken for the next question's, for as long as it moves."""
    wire.settle(200)
    device = SlowDevice(wire, every=1_000_000, slow_s=0.0)
    device.seen = len(wire.written)
    for index in range(120):
        wire.set_voltage(200 + 3 * index)
        device.advance(wire.now_s + 0.004)
        if index == rounds:
            answered_s, word = device.answers[0]
            device.answers.insert(1, (answered_s + 0.005, word))
        assert wire.exchange.fault is FaultCode.NONE
    device.advance(wire.now_s + 0.2)
    assert wire.exchange.standing_v == pytest.approx((200 + 3 * 119) * 10 / 1023)


def test_a_late_answer_costs_one_reply_time_and_no_fall_waits_for_it(wire: Wire) -> None:
    wire.settle(200)
    wire.set_voltage(210)
    wire.set_voltage(220)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    wire.answer("210")  # of the question that was given up
    wire.set_voltage(230)
    assert wire.last == "SET 220", "a rise waits until the line is quiet"
    wire.set_voltage(0)
    assert wire.last == "SET 0"


def test_a_device_that_alters_its_settings_is_found_after_a_lost_answer_too(wire: Wire) -> None:
    wire.set_voltage(512)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    wire.answer("510")
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    for _ in range(3):
        assert wire.exchange.fault is FaultCode.NONE
        wire.answer("510")
    assert wire.exchange.fault is FaultCode.OUTPUT_ALTERED


def test_a_device_whose_answers_are_cut_still_hears_the_safe_voltage(wire: Wire) -> None:
    """It may have obeyed the question whose answer was lost: what it acknowledged before that does not stand for sure."""
    wire.settle(0)
    wire.set_voltage(512)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    wire.set_voltage(0)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    assert wire.last == "SET 0"


def given_up(wire: Wire) -> Wire:
    """A question was given up and the next one is out: the answer to the first may still come."""
    wire.settle(200)
    wire.set_voltage(210)
    wire.set_voltage(220)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    assert wire.last == "SET 220"
    return wire


def test_a_fall_that_does_not_wait_believes_no_answer_but_its_own_echo(wire: Wire) -> None:
    """It is out while a later answer may still be on its way, as any question behind a silence is."""
    given_up(wire).answer("210")
    wire.set_voltage(0)
    wire.answer("220")
    assert wire.exchange.acknowledged_v == pytest.approx(200 * 10 / 1023)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    wire.answer("0")
    assert wire.exchange.standing_v == 0.0


def test_garbage_before_a_late_answer_makes_it_none_of_the_next_question(wire: Wire) -> None:
    given_up(wire).answer("#?#")
    wire.answer("210", after_s=0.001)
    assert wire.exchange.acknowledged_v == pytest.approx(200 * 10 / 1023)


@pytest.mark.parametrize(("after_s", "is_asked"), [(0.005, False), (0.015, True)])
def test_a_garbled_answer_is_asked_again_behind_a_round_trip_and_not_before(
    wire: Wire, after_s: float, is_asked: bool
) -> None:
    """Three tries fit into the bound on silence: one spoiled answer and a loop that was 26 ms late dropped a held force."""
    wire.settle(200)
    wire.set_voltage(300)
    wire.answer("3a0", after_s=0.006)
    written = len(wire.written)
    wire.tick(after_s)
    assert len(wire.written) == written + is_asked
    wire.answer("300", after_s=0.001)
    assert wire.exchange.acknowledged_v == pytest.approx(300 * 10 / 1023)


def test_a_device_that_is_silent_for_long_leaves_no_more_than_its_last_questions(wire: Wire) -> None:
    """Its answers come no more, and the first one behind days without power must not be held against a million."""
    wire.settle(200)
    for _ in range(1000):
        wire.tick(REPLY_TIMEOUT_S + 0.001)
    assert len(wire.exchange._given_up.questions) <= 4
    assert wire.exchange.unanswered_since_s == pytest.approx(wire.now_s - 61.0, abs=0.2)
    wire.set_voltage(300)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    wire.answer("200")  # a late one, of which of them nobody knows
    assert wire.now_s - (wire.exchange.unanswered_since_s or 0.0) < 3.0
    wire.set_voltage(200)
    wire.answer("200")
    assert wire.exchange._given_up.questions == [] and wire.exchange.acknowledged_v == pytest.approx(200 * 10 / 1023)


def late_out_of_three(wire: Wire) -> list[float]:
    """Three settings were given up, and a fourth is out: when each of them went out."""
    sent_s = []
    wire.settle(200)
    for counts in (210, 220, 230, 240):
        wire.set_voltage(counts)
        assert wire.last == f"SET {counts}"
        sent_s.append(wire.now_s)
        wire.set_voltage(counts + 10)
        if counts < 240:
            wire.now_s += REPLY_TIMEOUT_S + 0.001
            wire.tick(0.0)
    return sent_s


@pytest.mark.parametrize("answered", [0, 1, 2])
def test_a_late_answer_tells_its_own_round_trip_and_leaves_the_silence_of_those_behind_it(
    wire: Wire, answered: int
) -> None:
    """Those before it never will be answered. What is out stays so, and no second question goes out beside it."""
    sent_s = late_out_of_three(wire)
    wire.answer(str(210 + 10 * answered), after_s=0.001)
    assert wire.exchange.answer_late_s == pytest.approx(wire.now_s - sent_s[answered])
    assert wire.exchange.unanswered_since_s == sent_s[answered + 1]
    assert wire.last == "SET 240" and wire.exchange.acknowledged_v == pytest.approx(200 * 10 / 1023)
    wire.set_voltage(300)
    wire.answer("240", after_s=0.001)
    assert wire.exchange.acknowledged_v == pytest.approx(240 * 10 / 1023) and wire.last == "SET 300"


def test_a_fall_goes_out_beside_a_question_that_is_behind_and_beside_no_other(wire: Wire) -> None:
    """A fall below what was asked last, however high it still is above what was confirmed."""
    given_up(wire).answer("210")
    wire.set_voltage(215)
    assert wire.last == "SET 215"
    wire.answer("220")
    wire.answer("215")
    assert wire.last == "MON"
    wire.answer("0")
    wire.set_voltage(400)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    assert wire.last == "SET 400"
    wire.set_voltage(0)
    assert wire.last == "SET 400", "its own answer is the next, and not late"


def test_behind_an_answer_that_repeats_nothing_a_rise_waits_and_a_fall_does_not_and_is_believed_by_its_echo(
    wire: Wire,
) -> None:
    given_up(wire).answer("333")
    wire.set_voltage(230)
    assert wire.last == "SET 220"
    wire.set_voltage(0)
    assert wire.last == "SET 0"
    wire.answer("333")
    assert wire.exchange.acknowledged_v == pytest.approx(200 * 10 / 1023)


def test_garbage_leaves_an_answer_that_repeats_nothing_as_doubtful_as_it_was(wire: Wire) -> None:
    given_up(wire).answer("#?#")
    wire.answer("#", after_s=0.001)
    assert wire.exchange.counts.garbled == 2
    wire.answer("333", after_s=0.001)
    assert wire.exchange.acknowledged_v == pytest.approx(200 * 10 / 1023)


def test_a_late_reading_is_not_taken_for_the_setting_that_is_out_and_costs_no_time(wire: Wire) -> None:
    wire.settle(200)
    wire.tick(0.2)
    assert wire.last == "MON"
    wire.set_voltage(300)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    assert wire.last == "SET 300"
    wire.answer("7", after_s=0.001)
    assert wire.exchange.acknowledged_v == pytest.approx(200 * 10 / 1023)
    wire.answer("300", after_s=0.001)
    assert wire.exchange.acknowledged_v == pytest.approx(300 * 10 / 1023)


def test_an_answer_in_time_ends_what_is_said_of_late_ones_and_so_does_an_opening(wire: Wire) -> None:
    for end in ("answer", "opening"):
        wire.exchange.reset()
        given_up(wire).answer("210")
        assert wire.exchange.answer_late_s > REPLY_TIMEOUT_S
        wire.answer("220") if end == "answer" else wire.exchange.reset()
        assert wire.exchange.answer_late_s == 0.0


def test_of_many_that_were_given_up_the_newest_may_still_be_answered_and_none_for_ever(wire: Wire) -> None:
    wire.settle(200)
    for counts in range(210, 280, 10):
        wire.set_voltage(counts)
        if counts < 270:
            wire.set_voltage(counts + 10)
            wire.tick(REPLY_TIMEOUT_S + 0.001)
    sent_s = wire.now_s
    assert wire.last == "SET 270"
    wire.answer("250", after_s=0.001)
    assert wire.exchange.unanswered_since_s == pytest.approx(sent_s - REPLY_TIMEOUT_S - 0.001), "260 is out, too"
    wire.answer("260", after_s=0.4)
    assert wire.exchange.unanswered_since_s is None, "what comes so late is nobody's"


def test_behind_an_answer_of_nobody_knows_which_no_older_question_counts_as_silent(wire: Wire) -> None:
    """And what was out then is answered by its own echo, however the next one is asked by that time."""
    for late in ("210", "220"):
        wire.exchange.reset()
        given_up(wire).answer("333", after_s=0.001)
        wire.set_voltage(230)
        wire.tick(REPLY_TIMEOUT_S + 0.001)
        sent_s = wire.now_s
        assert wire.last == "SET 230"
        wire.answer(late, after_s=0.001)
        assert wire.exchange.acknowledged_v == pytest.approx(200 * 10 / 1023)
        assert wire.exchange.unanswered_since_s == sent_s
        wire.answer("230", after_s=0.001)
        assert wire.exchange.acknowledged_v == pytest.approx(230 * 10 / 1023)
