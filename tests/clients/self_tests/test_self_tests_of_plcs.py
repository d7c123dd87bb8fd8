"""The self-test's input and outputs of the blocks: what a bounce, another input, a scan between two requests make of them."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers.words import ControlBit, SelfTestResult
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand, refuse_commands
from tests.clients.losses.test_new_connections import set_ramp
from tests.clients.programs.controllers.plc import Plc
from tests.clients.scenes import TEXTS, command, commands, cycles

BEGUN, OFF = command(int(ControlBit.START_SELF_TEST), 0), command(0, 0)
SCANS = range(12)
"""Where between its requests a block is."""


@pytest.fixture(params=["scl", "twincat", "codesys"])
def plc(request: pytest.FixtureRequest, gateway: GatewayAtHand) -> Plc:
    found: Plc = CONTROLLERS[request.param](TEXTS[request.param], gateway)
    return found


def switch(plc: Plc, name: str, *, on: bool) -> None:
    plc.inputs[plc.NAMES[name]] = on
    plc.scan()


def begin(plc: Plc, gateway: GatewayAtHand) -> None:
    cycles(plc)
    plc.self_test()
    cycles(plc)
    assert gateway.is_testing and outputs(plc) == "busy"


def outputs(plc: Plc) -> str:
    """Which of busy, done and error is set; at most one ever is."""
    names = {"testing": "busy", "tested": "done", "not tested": "error"}
    return " ".join(word for name, word in names.items() if plc.output(name))


@pytest.mark.sampled
@pytest.mark.parametrize("scans", SCANS)
def test_a_self_test_that_falls_for_one_call_is_let_go_and_begun_anew(
    plc: Plc, gateway: GatewayAtHand, scans: int
) -> None:
    begin(plc, gateway)
    for _ in range(scans):
        plc.scan()
    switch(plc, "test", on=False)
    switch(plc, "test", on=True)
    cycles(plc)
    assert commands(gateway) == [BEGUN, OFF, BEGUN] and outputs(plc) == "busy" and not gateway.exceptions


@pytest.mark.sampled
@pytest.mark.parametrize("scans", SCANS)
def test_an_input_that_bounces_at_the_end_of_a_self_test_presses_nothing(
    plc: Plc, gateway: GatewayAtHand, scans: int
) -> None:
    """While its verdicts are read it is neither on nor over: a rise taken for a new one enabled, at the force input."""
    begin(plc, gateway)
    plc.force(12.0)
    switch(plc, "enable", on=True)  # which is none meanwhile, and stays TRUE
    gateway.end_self_test(SelfTestResult.PASSED)
    for _ in range(scans):
        plc.scan()
    switch(plc, "test", on=False)
    switch(plc, "test", on=True)
    cycles(plc)
    assert {words[:2] for words in commands(gateway)} <= {BEGUN[:2], OFF[:2]}


@pytest.mark.sampled
@pytest.mark.parametrize("scans", SCANS)
@pytest.mark.parametrize("gap", [0, 1])
def test_an_enable_in_place_of_a_self_test_is_none_wherever_its_request_is(
    plc: Plc, gateway: GatewayAtHand, scans: int, gap: int
) -> None:
    """gap: calls from the fall of the one to the rise of the other."""
    begin(plc, gateway)
    for _ in range(scans):
        plc.scan()
    plc.force(12.0)
    plc.inputs[plc.NAMES["test"]] = False
    for _ in range(gap):
        plc.scan()
    switch(plc, "enable", on=True)
    cycles(plc)
    assert commands(gateway) == [BEGUN, OFF] and plc.ended and outputs(plc) == ""
    assert "a self-test runs" in plc.text and not gateway.exceptions


def test_an_enable_that_was_none_presses_nothing_when_the_self_test_is_let_go(plc: Plc, gateway: GatewayAtHand) -> None:
    begin(plc, gateway)
    plc.force(12.0)
    switch(plc, "enable", on=True)
    switch(plc, "test", on=False)
    cycles(plc)
    assert commands(gateway) == [BEGUN, OFF] and plc.ended


def end(gateway: GatewayAtHand) -> None:
    gateway.end_self_test(SelfTestResult.PASSED)


def fail(gateway: GatewayAtHand) -> None:
    gateway.fail(FaultCode.OVER_FORCE)


def cut(gateway: GatewayAtHand) -> None:
    gateway.is_cut = True


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("happen", "told"), [(end, "done"), (fail, "done"), (cut, "error"), (refuse_commands, "error")]
)
def test_one_output_says_how_a_self_test_ended_until_the_next_begins(
    plc: Plc, gateway: GatewayAtHand, happen: Any, told: str
) -> None:
    """`ended` is of a force: whoever waits for that would have taken a self-test's end for one."""
    answer = gateway.answer
    for _ in range(2):
        begin(plc, gateway)
        happen(gateway)
        cycles(plc, 3)
        assert outputs(plc) == told and not plc.ended
        gateway.answer, gateway.is_cut, gateway.is_testing = answer, False, False  # type: ignore[method-assign]
        gateway.bank.clear_command()
        gateway.obey(gateway.bank.command._replace(control_word=ControlBit.RESET_FAULT))
        switch(plc, "test", on=False)
        plc.cycle(2.0)
        assert outputs(plc) == told


def test_a_self_test_that_is_none_is_an_error_at_once(plc: Plc, gateway: GatewayAtHand) -> None:
    cycles(plc)
    plc.enable(12.0)
    cycles(plc)
    plc.self_test()
    assert outputs(plc) == "error"
    switch(plc, "test", on=False)
    plc.disable()
    cycles(plc)
    refuse_commands(gateway)
    plc.self_test()
    cycles(plc)
    assert outputs(plc) == "error"


def test_a_word_that_is_refused_during_a_self_test_leaves_that_alone(plc: Plc, gateway: GatewayAtHand) -> None:
    begin(plc, gateway)
    answer, refused = gateway.answer, list[bytes]()

    def refuse(request: bytes) -> bytes:
        at = {16: 1, 23: 5}.get(request[0], 0)
        if not at or request[at : at + 2] != b"\0\1":
            return answer(request)
        refused.append(request)
        return bytes((request[0] | 0x80, 6))

    gateway.answer = refuse  # type: ignore[method-assign]
    set_ramp(plc, 50.0)
    cycles(plc)
    assert len(refused) == 1 and gateway.is_testing and outputs(plc) == "busy"
    beats = len(gateway.beats)
    cycles(plc)
    assert len(gateway.beats) > beats and commands(gateway) == [BEGUN]
