"""The rig's self-test, begun by each generated client: held up by its heartbeat, let go as a force is, told in words."""

from __future__ import annotations

import ctypes
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers.words import ControlBit, SelfTestResult, SelfTestVerdict, State
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.c_program import CProgram
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.s7 import S7
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.programs.python_program import PythonProgram
from tests.clients.scenes import TEXTS, command, commands, cycles
from tests.clients.test_in_band import in_band

RUN = int(ControlBit.START_SELF_TEST)
BEGUN, OFF = command(RUN, 0), command(0, 0)


def begin(client: Any, gateway: GatewayAtHand) -> None:
    cycles(client)
    client.self_test()
    cycles(client)
    assert gateway.is_testing and client.is_testing and not client.found, client.text


@pytest.mark.sampled
def test_a_self_test_is_begun_once_held_by_the_heartbeat_and_told_item_by_item(
    client: Any, gateway: GatewayAtHand
) -> None:
    begin(client, gateway)
    beats = len(gateway.beats)
    cycles(client)
    assert len(gateway.beats) > beats and not client.found
    gateway.end_self_test(SelfTestResult.FAILED, leak=SelfTestVerdict.FAILED, noise=SelfTestVerdict.PASSED)
    cycles(client)
    assert not client.is_testing and not client.ended
    assert {name: client.found[name] for name in ("result", "leak")} == {"result": "failed", "leak": "failed"}
    assert client.text == "self-test failed"
    beats = len(gateway.beats)
    cycles(client)
    assert commands(gateway) == [BEGUN] and len(gateway.beats) == beats


@pytest.mark.sampled
def test_a_second_self_test_is_another_and_a_force_may_follow(client: Any, gateway: GatewayAtHand) -> None:
    for verdict, result in ((SelfTestVerdict.WARNED, "warned"), (SelfTestVerdict.PASSED, "passed")):
        begin(client, gateway)
        gateway.end_self_test(SelfTestResult[result.upper()], leak=verdict)
        cycles(client)
        assert (client.found["result"], client.found["leak"]) == (result, result)
    client.enable(12.0)
    cycles(client)
    assert client.enabled and commands(gateway) == [BEGUN, command(1, 1200)]


@pytest.mark.sampled
def test_a_self_test_that_is_let_go_ends_at_once(client: Any, gateway: GatewayAtHand) -> None:
    begin(client, gateway)
    client.end_self_test()
    cycles(client)
    assert commands(gateway) == [BEGUN, OFF] and not gateway.is_testing
    assert not client.is_testing and not client.ended
    assert client.found.get("result", "stopped") == "stopped"


def test_a_self_test_that_is_refused_says_why_and_is_asked_for_once(client: Any, gateway: GatewayAtHand) -> None:
    cycles(client)
    gateway.take_over_from_elsewhere()
    client.self_test()
    cycles(client, 8)
    assert gateway.exceptions == [(23 if not isinstance(client, S7) else 16, 6)]
    assert "W210" in client.text and not client.is_testing and not client.found
    assert gateway.bank.command.force_setpoint_n == 7.0


@pytest.mark.sampled
def test_a_fault_ends_a_self_test_and_is_told(client: Any, gateway: GatewayAtHand) -> None:
    begin(client, gateway)
    gateway.fail(FaultCode.OVER_FORCE)
    cycles(client)
    assert not client.is_testing and client.text == "A313 too much force"
    cycles(client)
    assert commands(gateway) == [BEGUN]


@pytest.mark.sampled
def test_behind_a_loss_during_a_self_test_the_first_write_is_off(client: Any, gateway: GatewayAtHand) -> None:
    begin(client, gateway)
    gateway.is_cut = True
    cycles(client, 3)
    assert not client.is_testing and not client.found and "lost" in client.text
    gateway.is_cut = False
    for _ in range(6):
        client.cycle(1.0)
    assert commands(gateway) == [BEGUN, OFF] and not gateway.is_testing


@pytest.mark.sampled
def test_what_is_asked_for_while_a_gateway_is_lost_begins_no_self_test_later(
    client: Any, gateway: GatewayAtHand
) -> None:
    """What was found before is none of it either."""
    begin(client, gateway)
    gateway.end_self_test(SelfTestResult.PASSED)
    cycles(client)
    assert client.found
    gateway.is_cut = True
    cycles(client, 3)
    client.self_test()
    client.cycle()
    assert not client.is_testing and not client.found
    gateway.is_cut = False
    for _ in range(6):
        client.cycle(1.0)
    assert commands(gateway) == [BEGUN]


@pytest.mark.sampled
def test_a_tare_right_behind_the_end_begins_no_other_self_test(client: Any, gateway: GatewayAtHand) -> None:
    begin(client, gateway)
    gateway.end_self_test(SelfTestResult.PASSED)
    client.tare()
    cycles(client)
    tared = [] if isinstance(client, Plc) else [command(4, 0)]
    assert commands(gateway)[:2] == [BEGUN, *tared] and not gateway.is_testing


@pytest.mark.sampled
@pytest.mark.parametrize("language", ["scl", "twincat", "codesys"], indirect=True)
@pytest.mark.parametrize("scans", range(12))
def test_a_tare_at_the_end_begins_no_other_self_test_wherever_the_request_of_a_plc_is(
    client: Any, gateway: GatewayAtHand, scans: int
) -> None:
    begin(client, gateway)
    for _ in range(scans):
        client.scan()
    gateway.end_self_test(SelfTestResult.PASSED)
    client.tare()
    cycles(client)
    assert commands(gateway) == [BEGUN] and client.found["result"] == "passed"


@pytest.mark.sampled
def test_an_enable_during_a_self_test_does_not_press_behind_it(client: Any, gateway: GatewayAtHand) -> None:
    begin(client, gateway)
    client.enable(12.0)
    cycles(client)
    assert gateway.is_testing and client.is_testing
    gateway.end_self_test(SelfTestResult.PASSED)
    cycles(client)
    assert client.found["result"] == "passed" and not client.enabled
    assert {words[:2] for words in commands(gateway)} <= {(RUN, 0), (RUN | 1, 1200)}


def test_a_self_test_in_place_of_a_force_waits_for_off(client: Any, gateway: GatewayAtHand) -> None:
    """Refused with the force still held, the last accepted command would have gone on: nobody wanted it any more."""
    client.enable(12.0)
    cycles(client)
    client.disable()
    client.self_test()
    cycles(client)
    assert commands(gateway) == [command(1, 1200), OFF, BEGUN] and gateway.is_testing
    assert not gateway.exceptions and not client.ended


@pytest.mark.sampled
def test_a_force_in_place_of_a_self_test_is_none(client: Any, gateway: GatewayAtHand) -> None:
    begin(client, gateway)
    client.end_self_test()
    client.enable(12.0)
    cycles(client)
    assert not gateway.is_testing
    assert gateway.bank.command.control_word in (0, 1)


@pytest.mark.parametrize("language", ["rapid", "scl", "urscript", "twincat", "codesys"], indirect=True)
def test_a_self_test_beside_a_force_is_none(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    client.self_test()
    cycles(client)
    assert client.enabled and not client.is_testing and "no self-test beside" in client.text
    if isinstance(client, Plc):
        client.end_self_test()
        cycles(client)
    assert commands(gateway) == [command(1, 1200)] and client.enabled


@pytest.mark.parametrize("language", ["scl", "twincat", "codesys"], indirect=True)
def test_an_enable_that_is_taken_back_during_a_self_test_leaves_that_alone(client: Any, gateway: GatewayAtHand) -> None:
    begin(client, gateway)
    client.enable(12.0)
    cycles(client)
    assert client.ended and "a self-test runs" in client.text
    client.disable()
    cycles(client)
    assert gateway.is_testing and client.is_testing and commands(gateway) == [BEGUN]


@pytest.mark.sampled
def test_a_reset_ends_a_self_test_too(client: Any, gateway: GatewayAtHand) -> None:
    """The gateway refuses it, busy, and the stop beside it: OFF goes out all the same."""
    begin(client, gateway)
    client.reset()
    assert not isinstance(client, Plc) or client.text == "the self-test was ended by a reset"
    cycles(client)
    assert not gateway.is_testing and not client.is_testing
    assert commands(gateway)[0] == BEGUN and OFF in commands(gateway)


def test_every_language_says_a_state_in_words(language: str, gateway: GatewayAtHand) -> None:
    client = CONTROLLERS[language](TEXTS[language], gateway)
    say: Any = None
    if isinstance(client, CProgram):
        client._library.fg_state_text.restype = ctypes.c_char_p
        say = lambda state: client._library.fg_state_text(state).decode()  # noqa: E731
    elif isinstance(client, PythonProgram):
        say = client.module["STATES"].get
    else:
        names = {Irc5: "FgStateText", S7: "FG_StateText", UniversalRobot: "fg_state_text"}
        say = lambda state: client.machine.start(names.get(type(client), "F_FgStateText"), state)  # noqa: E731
    assert [say(state) for state in State] == [state.name.lower() for state in State]


@pytest.mark.sampled
def test_a_tare_during_a_self_test_is_told_to_be_none(client: Any, gateway: GatewayAtHand) -> None:
    begin(client, gateway)
    client.tare()
    cycles(client)
    assert "a self-test runs" in client.text or "busy" in client.text
    assert gateway.is_testing and client.is_testing


@pytest.mark.sampled
def test_a_self_test_is_in_no_band_and_a_force_beside_it_is_not_written(client: Any, gateway: GatewayAtHand) -> None:
    begin(client, gateway)
    assert not in_band(client)
    client.force(5.0)
    cycles(client)
    assert not in_band(client) and commands(gateway) == [BEGUN] and not gateway.exceptions
