"""How a Python program may end: Ctrl-C in the middle of a request, an error of its own. Its force ends with it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import isnan
from typing import Any

import pytest

from tests.clients.gateway_at_hand import ECHO_AT, GatewayAtHand
from tests.clients.programs.python_program import PythonProgram, SocketAtHand
from tests.clients.scenes import MODEL, TEXTS, command, commands, cycles


@pytest.fixture
def program(gateway: GatewayAtHand) -> PythonProgram:
    return PythonProgram(TEXTS["python"], gateway)


@pytest.mark.parametrize("reads", range(1, 7))
def test_an_off_behind_an_interrupted_request_goes_out(
    program: PythonProgram, gateway: GatewayAtHand, reads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer that nobody had read was taken for that of OFF: Lost, and a rig without a lease pressed on. reads: which of
    the connection's reads Ctrl-C comes in."""
    plain, left = SocketAtHand.recv, iter(range(1, 100))

    def interrupted(self: SocketAtHand, count: int) -> bytes:
        if next(left) == reads:
            raise KeyboardInterrupt
        return plain(self, count)

    monkeypatch.setattr(SocketAtHand, "recv", interrupted)
    program.enable(12.0)
    with pytest.raises(KeyboardInterrupt):
        cycles(program)
    program.client.disable()
    program.client.exchange()
    assert gateway.bank.command.control_word == 0
    program.enable(13.0)
    cycles(program, 2)
    assert program.enabled and gateway.bank.command.force_setpoint_n == 13.0


def working(seconds: int) -> Iterator[int]:
    yield from range(seconds)


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt, None])
def test_a_force_ends_with_its_with_block(program: PythonProgram, gateway: GatewayAtHand, error: Any) -> None:
    """An error between two exchanges ended the program, and left its force to the lease, which not every rig has."""
    with pytest.raises(error or StopIteration), program.client as client:
        client.enable(12.0)
        for _ in working(3):
            client.exchange()
        raise error or StopIteration
    assert commands(gateway) == [command(1, 1200), command(0, 0)]
    assert gateway.bank.command.control_word == 0


def test_a_with_block_of_a_guest_stops_nobody(program: PythonProgram, gateway: GatewayAtHand) -> None:
    gateway.take_over_from_elsewhere()
    with program.client as client:
        client.exchange()
    assert gateway.requests and gateway.writes == [] and gateway.bank.command.force_setpoint_n == 7.0


@pytest.mark.parametrize("is_cut", [False, True])
def test_a_with_block_ends_with_its_own_error_where_nobody_answers_or_off_is_refused(
    program: PythonProgram, gateway: GatewayAtHand, is_cut: bool
) -> None:
    with pytest.raises(ZeroDivisionError), program.client as client:
        client.enable(12.0)
        client.exchange()
        gateway.is_cut = is_cut
        gateway.answer = (lambda _request: b"\x97\x06") if not is_cut else gateway.answer  # type: ignore[method-assign]
        raise ZeroDivisionError
    assert commands(gateway)[0] == command(1, 1200)


def test_a_with_block_tries_once_more_where_the_connection_was_lost(
    program: PythonProgram, gateway: GatewayAtHand
) -> None:
    """Its last answer was late, say, and the pause before the next attempt would outlive the program."""
    with program.client as client:
        client.enable(12.0)
        client.exchange()
        answer, gateway.answer = gateway.answer, lambda _request: b"\x83\x0b"  # type: ignore[method-assign]
        with pytest.raises(program.module["Lost"]):
            client.exchange()
        gateway.answer = answer  # type: ignore[method-assign]
    assert gateway.bank.command.control_word == 0


def test_a_with_block_that_ends_well_says_that_its_off_did_not_get_out(
    program: PythonProgram, gateway: GatewayAtHand
) -> None:
    with pytest.raises(program.module["Lost"]), program.client as client:
        client.enable(12.0)
        client.exchange()
        gateway.is_cut = True
    assert gateway.bank.command.control_word == 1


def test_what_the_gateway_has_no_value_for_is_no_number(program: PythonProgram) -> None:
    """-327.68 N would be a pull that nobody sees."""
    python = program.module
    status = python["decode_status"]([0x8000] * python["STATUS_WORDS"])
    for name, _, kind, counts in python["STATUS"]:
        assert isnan(status[name]) if kind == "int16" else status[name] != -0x8000 / counts, name
    assert isnan(status["force_measured"])


@pytest.mark.parametrize(
    ("slip", "told"),
    [
        ({"slip_stop": 3}, "slip_stop"),
        ({"order": 2.0}, "order = 2.0 is no uint16"),
        ({"lag": 1e39}, "lag = 1e+39 is no float32"),
    ],
)
def test_a_set_with_a_slip_of_the_pen_is_not_staged(
    program: PythonProgram, gateway: GatewayAtHand, slip: dict[str, float], told: str
) -> None:
    """A name that no set has was left out, and the set put to use without what was meant by it; an order of 2.0 was a
    struct.error that names nothing."""
    with pytest.raises(ValueError, match=re.escape(told)):
        program.client.stage(MODEL | slip)
    with pytest.raises(ValueError, match="force_setpont is no word of the command"):
        program.client.set("force_setpont", 3.0)
    assert gateway.uploads == [] and gateway.writes == []


def test_an_answer_that_comes_byte_by_byte_has_no_more_time_than_any(
    program: PythonProgram, gateway: GatewayAtHand
) -> None:
    """A program that waits for each byte anew does not get to what lets its force go."""

    class Dripping(SocketAtHand):
        def __init__(self) -> None:
            super().__init__(gateway)
            self.settimeout = self._wait_for

        def _wait_for(self, seconds: float) -> None:
            self._patience_s = seconds

        def recv(self, count: int) -> bytes:
            program.now_s += min(0.2, self._patience_s)
            if self._patience_s < 0.2:
                raise TimeoutError("no answer")
            return super().recv(1)

    program.module["socket"].create_connection = lambda *_: Dripping()
    program.cycle(0.0)
    assert program.text.startswith("lost: ") and program.now_s <= program.client.timeout_s + 0.01


def test_a_connection_that_came_about_begins_anew_with_its_proof_and_its_pauses(
    program: PythonProgram, gateway: GatewayAtHand
) -> None:
    """A rig may want the proof of each connection, and a loss of hours ago is no reason to wait for longer."""
    for losses in (3, 1):
        gateway.is_cut = True
        for _ in range(losses):
            with pytest.raises(program.module["Lost"]):
                program.client.exchange()
            pause_s = program.client._retry_at_s - program.now_s
            program.now_s += pause_s
        gateway.is_cut = False
        gateway.requests.clear()
        program.client.enable(12.0)
        cycles(program)
        assert any(ECHO_AT in request for request in gateway.requests)
        program.client.disable()
        program.client.exchange()
    assert pause_s == program.module["BACKOFF_FIRST_S"]


def test_a_set_that_fails_as_a_whole_is_told_with_no_number_of_65535(program: PythonProgram) -> None:
    program.client.write = lambda *_: None
    program.client.read = lambda first, count: (4, 0xFFFF, 1)
    with pytest.raises(program.module["Refused"], match="commit failed at number -1: "):
        program.client.commit()
