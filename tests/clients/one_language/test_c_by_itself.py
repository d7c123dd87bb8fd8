"""What the client of C alone does: words below 0, a close that forgets, a band that ends with the demand, how long it waits,
what it takes for a value and for an answer."""

from __future__ import annotations

import ctypes
from math import isnan, nan

import pytest

from gateway.registers import Status
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.losses.test_asked_for_while_lost import be_lost
from tests.clients.programs.c_program import OK, CProgram
from tests.clients.scenes import TEXTS, commands, cycles

TILT_ANGLE, SEQUENCE = 6, 10


@pytest.fixture
def program(gateway: GatewayAtHand) -> CProgram:
    return CProgram(TEXTS["c"], gateway)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("counts", "word"), [(-200.0, 65336), (-200.4, 65336), (-200.6, 65335), (-0.4, 0), (0.4, 0), (200.6, 201)]
)
def test_a_word_below_0_is_the_nearest_count_too(
    program: CProgram, gateway: GatewayAtHand, counts: float, word: int
) -> None:
    set_word = program._library.fg_set
    assert set_word(program._client, TILT_ANGLE, ctypes.c_float(counts), ctypes.c_float(1.0)) == OK
    program.enable(12.0)
    cycles(program)
    assert commands(gateway)[-1][TILT_ANGLE - 1] == word  # without the heartbeat


@pytest.mark.parametrize(("number", "is_taken"), [(32768, True), (65535, True), (65536, False), (-1, False)])
def test_a_word_without_a_sign_has_16_bits(
    program: CProgram, gateway: GatewayAtHand, number: int, is_taken: bool
) -> None:
    """A program that counts command_sequence was refused from 32768 on, 18 minutes at 30 Hz."""
    told = program._library.fg_set(program._client, SEQUENCE, ctypes.c_float(number), ctypes.c_float(1.0))
    assert (told == OK) is is_taken
    program.enable(12.0)
    cycles(program)
    assert gateway.bank.command.command_sequence == (number if is_taken else 0)


def test_who_closes_and_connects_again_commands_nothing_until_it_asks(
    program: CProgram, gateway: GatewayAtHand
) -> None:
    """A program that closes at its end and goes on would have pressed at once."""
    program.enable(12.0)
    cycles(program)
    program._library.fg_close(program._client)
    assert program.ended
    cycles(program)
    assert [words[:2] for words in commands(gateway)] == [(1, 1200), (0, 0)]
    program.enable(7.0)
    cycles(program)
    assert gateway.bank.command.force_setpoint_n == 7.0


def test_a_force_that_is_let_go_is_in_band_no_more(program: CProgram) -> None:
    program.enable(12.0)
    cycles(program)
    assert program.in_band
    program.disable()
    assert not program.in_band


def test_the_pause_before_another_attempt_has_an_end(program: CProgram, gateway: GatewayAtHand) -> None:
    """Behind a night without power the gateway would be there for hours before its client."""
    be_lost(program, gateway)
    for _ in range(20):
        program.cycle(60.0)
    gateway.is_cut, before = False, len(gateway.requests)
    program.cycle(4.1)
    assert len(gateway.requests) > before, "4 s are the longest"


def test_a_force_that_nobody_knows_is_no_number(program: CProgram, gateway: GatewayAtHand) -> None:
    """-327.68 N would be a pull that nobody sees, and 0 N behind a loss a tool that rests."""
    shown = []
    for force_n in (-1.25, nan):
        gateway.bank.publish(Status(force_measured_n=force_n))
        program.cycle()
        shown.append(program.force_measured_n)
    assert shown[0] == -1.25 and isnan(shown[1])
    gateway.bank.publish(Status(force_measured_n=3.5))
    program.cycle()
    assert program.force_measured_n == 3.5
    gateway.is_cut = True
    program.cycle()
    assert isnan(program.force_measured_n)


def test_what_says_that_it_is_longer_than_any_answer_is_none(program: CProgram, gateway: GatewayAtHand) -> None:
    """All of it would be written behind the room for one: who serves on the gateway's address need not be a gateway."""
    gateway.ask = lambda frame: frame[:4] + b"\x00\xff" + frame[6:8] + bytes(253)  # type: ignore[method-assign]
    program.cycle()
    assert program.text.endswith("an answer that does not belong to the question")


def test_who_enables_anew_has_ended_no_more(program: CProgram, gateway: GatewayAtHand) -> None:
    program.enable(12.0)
    cycles(program)
    gateway.stop_from_elsewhere()
    cycles(program)
    assert program.ended
    program.enable(12.0)
    assert not program.ended
    cycles(program)
    assert program.enabled and not program.ended


def test_a_machine_that_is_off_holds_the_program_for_no_longer_than_its_timeout(
    program: CProgram, gateway: GatewayAtHand
) -> None:
    """A socket that waits would hold it for the two minutes that TCP tries, and the heartbeats to others beside it."""
    gateway.is_cut = program.is_silent = True
    program.cycle(0.0)
    assert program.now_s == 0.5 and "not accepted in time" in program.text


def test_a_signal_that_comes_while_it_waits_costs_no_force(program: CProgram, gateway: GatewayAtHand) -> None:
    """A timer of the program, say: poll ends with EINTR, and what was waited for is still to come."""
    program.enable(12.0)
    cycles(program)
    program.send_signals(3)
    program.cycle()
    assert program.enabled and not program.ended and not program.text
