"""Questions that were given up: until when what comes is doubted, and which answer tells what a round trip takes."""

from math import isnan

import pytest

from gateway.devices.messages import SetVoltage
from gateway.service.running_rig.lines.given_up_questions import GivenUpQuestions
from tests.service.running_rig.lines.output.played_output import REPLY_TIMEOUT_S, Wire, wire

__all__ = ["wire"]


@pytest.fixture
def given_up() -> GivenUpQuestions:
    """One question was given up at 100.06 s."""
    questions = GivenUpQuestions(REPLY_TIMEOUT_S)
    questions.give_up(SetVoltage(3.0), 100.0)
    return questions


def test_an_answer_behind_a_late_one_does_not_tell_the_round_trip(given_up: GivenUpQuestions) -> None:
    """None is out any more, and the answer may be one behind all the same."""
    assert given_up.take_answer(lambda question: question == SetVoltage(3.0), 100.1) == 100.0
    assert not given_up.questions and given_up.is_overdue
    given_up.note_answer(0.001)
    assert isnan(given_up.round_trip_s)


def test_an_answer_beside_one_that_may_still_come_does_not_tell_it_either(given_up: GivenUpQuestions) -> None:
    given_up.note_strange(100.1)
    assert given_up.questions and not given_up.is_overdue
    given_up.note_answer(0.001)
    assert isnan(given_up.round_trip_s)
    given_up.note_answer(0.02)
    assert given_up.round_trip_s == 0.02


def test_of_a_port_that_was_opened_again_nothing_is_overdue(given_up: GivenUpQuestions) -> None:
    given_up.forget()
    assert (given_up.questions, given_up.is_overdue, given_up.silent_since_s) == ([], False, None)
    given_up.note_answer(0.02)
    assert given_up.round_trip_s == 0.02


@pytest.mark.parametrize(("beside", "is_believed"), [(b"30#\r\n", True), (b"", False)])
def test_what_comes_garbled_and_unasked_was_the_missing_answer(wire: Wire, beside: bytes, is_believed: bool) -> None:
    """What is asked next is believed at its first word then; else that may still be the missing one."""
    wire.settle(200)
    wire.set_voltage(300)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    wire.exchange.on_bytes(b"300\r\n" + beside, wire.now_s + 0.001)
    assert wire.last == "MON"
    wire.answer("7")
    assert (wire.exchange.pressure_pa > 0.0) is is_believed
