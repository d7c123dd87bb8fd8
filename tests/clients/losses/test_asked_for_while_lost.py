"""What a program asks for while nobody is there is not done when somebody comes: nobody expects it any more."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.c_program import CProgram
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.programs.python_program import PythonProgram
from tests.clients.scenes import MODEL, TEXTS, cycles


def reset(client: Any) -> None:
    client.reset()


def tare(client: Any) -> None:
    client.tare()


def take(client: Any) -> None:
    if isinstance(client, Irc5):
        client.set(fgTake=True)
    elif isinstance(client, UniversalRobot):
        client.machine.start("fg_take_ownership")
    elif isinstance(client, Plc):
        client.inputs[client.NAMES["take"]] = True
        client.scan()
        client.inputs[client.NAMES["take"]] = False
    elif isinstance(client, PythonProgram):
        client.client.take_ownership()
    elif isinstance(client, CProgram):
        client._library.fg_take_ownership(client._client)


def enable(client: Any) -> None:
    client.enable(12.0)


def be_lost(client: Any, gateway: GatewayAtHand) -> None:
    """A wire that is cut, until the pause between two attempts is the longest."""
    cycles(client, 2)
    gateway.is_cut = True
    for _ in range(6):
        client.cycle(5.0)


@pytest.mark.sampled
@pytest.mark.parametrize("ask", [enable, tare, reset, take])
@pytest.mark.parametrize("attempts", [0, 3])
def test_what_is_asked_for_between_two_attempts_does_not_go_out_with_the_next_connection(
    client: Any, gateway: GatewayAtHand, ask: Any, attempts: int
) -> None:
    """A force began up to 4 s behind the enable, when the program had long gone on to its fault; a tare of any time before
    took the tool's force for zero. attempts: that fail behind it."""
    be_lost(client, gateway)
    ask(client)
    client.cycle(0.04)
    assert "lost" in client.text
    for _ in range(attempts):
        client.cycle(5.0)
    gateway.is_cut = False
    for _ in range(8):
        client.cycle(1.0)
    assert gateway.requests and gateway.words == []
    assert client.ended or ask is not enable


@pytest.mark.sampled
def test_an_enable_behind_the_new_connection_goes_out(client: Any, gateway: GatewayAtHand) -> None:
    be_lost(client, gateway)
    enable(client)
    client.cycle(0.04)
    gateway.is_cut = False
    for _ in range(8):
        client.cycle(1.0)
    client.disable()
    cycles(client)
    assert gateway.bank.command.control_word == 0
    enable(client)
    cycles(client)
    assert gateway.bank.command.force_setpoint_n == 12.0 and client.enabled and not client.ended


@pytest.mark.sampled
def test_an_upload_that_is_asked_for_between_two_attempts_is_not_sent_later(
    client: Any, gateway: GatewayAtHand
) -> None:
    be_lost(client, gateway)
    if isinstance(client, CProgram | PythonProgram):
        pytest.skip("its stage() says so itself")
    client.begin_upload(MODEL, 3)
    client.cycle(0.04)
    gateway.is_cut = False
    for _ in range(8):
        client.cycle(1.0)
    assert gateway.requests and not gateway.uploads and not client.uploaded


def test_a_robot_that_asks_while_it_is_lost_is_told_so_at_once_and_nothing_goes_out(gateway: GatewayAtHand) -> None:
    """Also where the very next attempt finds the gateway again."""
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    be_lost(robot, gateway)
    assert robot.machine.start("fg_enable", 12.0) is False and robot.ended
    gateway.is_cut = False
    cycles(robot, 8)
    assert gateway.words == [] and not robot.enabled


@pytest.mark.sampled
def test_what_has_ended_is_told_until_the_next_enable(client: Any, gateway: GatewayAtHand) -> None:
    """C and Python forgot it with a disable, as a program's own way out of it."""
    client.enable(12.0)
    cycles(client)
    gateway.fail(FaultCode.OVER_FORCE)
    cycles(client)
    client.disable()
    cycles(client)
    assert client.ended
    client.reset()
    cycles(client)
    assert client.ended
    client.enable(12.0)
    cycles(client, 8)
    assert client.enabled and not client.ended
