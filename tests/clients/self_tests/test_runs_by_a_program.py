"""A ladder or a self-test that a program of C or Python begins by its bit presses as enable does, and is let go as that is."""

from __future__ import annotations

import ctypes
from typing import Any

import pytest

from gateway.registers.words import CommitStatus, ControlBit, SelfTestResult
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.c_program import OK, WORKING, CProgram
from tests.clients.scenes import MODEL, TEXTS, command, commands, cycles

RUN = int(ControlBit.START_SELF_TEST)


@pytest.fixture(params=["python", "c"])
def program(request: pytest.FixtureRequest, gateway: GatewayAtHand) -> Any:
    return CONTROLLERS[request.param](TEXTS[request.param], gateway)


def begin_run(program: Any) -> None:
    if isinstance(program, CProgram):
        assert program._library.fg_set(program._client, 0, ctypes.c_float(RUN), ctypes.c_float(1.0)) == OK
    else:
        program.client.set("control_word", RUN)


def test_behind_a_loss_during_a_run_the_first_write_is_off(program: Any, gateway: GatewayAtHand) -> None:
    """On a rig without a lease it pressed on, and nobody looked at it any more."""
    begin_run(program)
    cycles(program)
    assert gateway.is_testing
    gateway.is_cut = True
    cycles(program, 3)
    gateway.is_cut = False
    for _ in range(6):
        program.cycle(1.0)
    assert commands(gateway) == [command(RUN, 0), command(0, 0)]
    assert not gateway.is_testing


def test_a_run_that_has_ended_is_not_begun_again_by_its_client(program: Any, gateway: GatewayAtHand) -> None:
    """Its bit stood on in the client: heartbeats went on for nothing, and a tare would have pressed anew."""
    begin_run(program)
    cycles(program)
    gateway.end_self_test(SelfTestResult.PASSED)
    cycles(program)
    beats = len(gateway.beats)
    cycles(program)
    assert len(gateway.beats) == beats
    program.tare()
    cycles(program)
    assert commands(gateway) == [command(RUN, 0), command(4, 0)] and not gateway.is_testing
    begin_run(program)
    cycles(program)
    assert gateway.is_testing, "asked for again it is another one"


def test_a_tare_right_behind_the_end_of_a_run_begins_none(program: Any, gateway: GatewayAtHand) -> None:
    begin_run(program)
    cycles(program)
    gateway.end_self_test(SelfTestResult.PASSED)
    program.tare()
    cycles(program)
    assert commands(gateway) == [command(RUN, 0), command(4, 0)] and not gateway.is_testing


def test_a_run_is_ended_by_a_disable_beside_what_is_refused(program: Any, gateway: GatewayAtHand) -> None:
    begin_run(program)
    cycles(program)
    answer = gateway.answer
    gateway.answer = (
        lambda request: (  # type: ignore[method-assign]
            b"\x97\x06" if request[0] == 23 and request[10:12] == b"\0\4" else answer(request)
        )
    )
    program.disable()
    program.tare()
    cycles(program)
    assert not gateway.is_testing and gateway.bank.command.control_word == 0


def upload_slowly(program: Any, gateway: GatewayAtHand) -> int:
    """Press, and upload to a gateway that takes its time; return how many heartbeats there were before."""
    gateway.bank.staging.on_commit = lambda *_: gateway.bank.staging.show_commit(CommitStatus.WRITING)
    program.enable(4.0)
    cycles(program)
    if isinstance(program, CProgram):
        program.begin_upload(MODEL, 3)
        program.cycle()
    else:
        program.client.stage(MODEL, 3)
    return len(gateway.beats)


def test_a_program_of_c_that_only_waits_for_its_commit_keeps_its_heartbeat_up(gateway: GatewayAtHand) -> None:
    """A lease of 200 ms was over before the fsyncs of a slow disk were, and the force off."""
    program = CProgram(TEXTS["c"], gateway)
    beats = upload_slowly(program, gateway)
    for _ in range(5):
        assert program._library.fg_commit_state(program._client) == WORKING
    assert len(gateway.beats) == beats + 5
    gateway.bank.staging.show_commit(CommitStatus.COMMITTED)
    assert program._library.fg_commit_state(program._client) == OK


def test_a_heartbeat_that_is_refused_meanwhile_is_no_refusal_of_the_commit(
    program: Any, gateway: GatewayAtHand
) -> None:
    """commit() ended with another master's takeover as its reason, and the model was in use all the same."""
    upload_slowly(program, gateway)
    gateway.take_over_from_elsewhere()
    answer = gateway.answer

    def commit_behind_the_heartbeat(request: bytes) -> bytes:
        if request[0] == 23:
            gateway.bank.staging.show_commit(CommitStatus.COMMITTED)
        return answer(request)

    gateway.answer = commit_behind_the_heartbeat  # type: ignore[method-assign]
    if isinstance(program, CProgram):
        assert [program._library.fg_commit_state(program._client) for _ in range(2)] == [WORKING, OK]
    else:
        program.client.commit()
    assert program.ended and gateway.bank.command.force_setpoint_n == 7.0
