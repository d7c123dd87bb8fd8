"""Over a new connection nothing of the old one is taken for known; an answer that is none is a loss, and no refusal."""

from __future__ import annotations

import ctypes
from typing import Any

import pytest

from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged
from tests.clients.losses.test_edges_and_losses import OF_A_PROGRAM
from tests.clients.programs.c_program import OK, CProgram
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.structured_text import Codesys, TwinCat
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.programs.iec_libraries import ClientTcp, TwinCatRequest
from tests.clients.scenes import TEXTS, command, commands, cycles

RAMP = 2
"""Place of force_ramp in the command."""


def set_ramp(client: Any, n_per_s: float) -> None:
    counts = round(10 * n_per_s)
    if isinstance(client, Irc5):
        client.get("fgCommand")[RAMP] = counts
    elif isinstance(client, UniversalRobot):
        assert client.machine.start("fg_set_command", RAMP, counts) is True
    elif isinstance(client, Plc):
        client.structures[client.NAMES["command"]]["FORCE_RAMP"] = n_per_s
    elif isinstance(client, CProgram):
        given = ctypes.c_float(n_per_s), ctypes.c_float(10.0)
        assert client._library.fg_set(client._client, RAMP, *given) == OK
    else:
        client.client.set("force_ramp", n_per_s)


def test_a_word_that_waits_goes_out_over_a_new_connection_behind_a_look_at_the_status_only(
    client: Any, gateway: GatewayAtHand
) -> None:
    """The status of before showed nobody who presses: the ramp went out, force 0 beside it, into another master's force."""
    cycles(client)
    gateway.is_cut = True
    cycles(client, 3)
    gateway.is_cut = False
    gateway.take_over_from_elsewhere()
    set_ramp(client, 50.0)
    for _ in range(6):
        client.cycle(1.0)
    assert gateway.writes == [] and gateway.exceptions == []
    assert gateway.bank.command.force_setpoint_n == 7.0


@pytest.mark.parametrize("language", OF_A_PROGRAM)
@pytest.mark.parametrize("function", [3, 23])
def test_an_answer_that_counts_its_bytes_otherwise_is_a_loss(
    language: str, function: int, gateway: GatewayAtHand
) -> None:
    client = CONTROLLERS[language](TEXTS[language], gateway)
    if function == 23:
        client.enable(12.0)
    cycles(client)
    ask = gateway.ask

    def alter(frame: bytes) -> bytes:
        answer = bytearray(ask(frame))
        answer[8] -= 2 * (answer[7] == function)
        return bytes(answer)

    gateway.ask = alter  # type: ignore[method-assign]
    client.cycle()
    assert "lost" in client.text and not client.enabled


def lose_one(gateway: GatewayAtHand) -> list[bytes]:
    """The next write does not come through, and the connection stands; return where it is noted."""
    answer, lost = gateway.answer, list[bytes]()

    def lose(request: bytes) -> bytes:
        if request[0] not in (6, 16, 23) or lost:
            return answer(request)
        lost.append(request)
        raise Unplugged

    gateway.answer = lose  # type: ignore[method-assign]
    return lost


@pytest.mark.sampled
@pytest.mark.parametrize("asks", ["heartbeat", "force"])
def test_a_write_that_nobody_answers_is_a_loss_and_no_refusal(client: Any, gateway: GatewayAtHand, asks: str) -> None:
    """Taken for one the last accepted force went on, and the operator was told the reason of some earlier refusal."""
    client.enable(65.0)
    cycles(client)
    client.enable(12.0)
    cycles(client)
    lost = lose_one(gateway)
    if asks == "force":
        client.force(13.0)
    client.cycle()
    assert lost and "lost" in client.text and client.ended and not client.enabled
    for _ in range(6):
        client.cycle(1.0)
    assert commands(gateway)[-2:] == [command(1, 1200), command(0, 0)]
    if isinstance(client, Plc):
        assert (
            client.machine.member(client.block, "refused" if client.TYPES[0].startswith('"') else "bRefused") is False
        )


def test_off_goes_alone_though_an_edge_waits_already(gateway: GatewayAtHand) -> None:
    """Refused with a tare that is none while a force is held, it would have left the force on."""
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    robot.enable(12.0)
    cycles(robot)
    robot.tare()
    robot.set(fg_off_pending=True)
    cycles(robot)
    assert [words[0] for words in gateway.words] == [1, 0, 5] and not gateway.exceptions


def test_a_codesys_controller_leaves_a_connection_on_which_nobody_answers(gateway: GatewayAtHand) -> None:
    """Behind a power cut of the gateway's machine nothing closes it, and it was asked over it for as long as TCP tries: the
    others have a new connection within 4 s, and their OFF."""
    client = Codesys(TEXTS["codesys"], gateway)
    client.enable(12.0)
    cycles(client)
    connection = client.machine.member(client.transport, "fbClient")
    connection.is_dead = True
    client.cycle()
    assert client.ended and "lost" in client.text and not connection.xConnected
    client.cycle(4.0)
    assert commands(gateway) == [command(1, 1200), command(0, 0)]
    client.disable()
    client.cycle()
    client.enable(5.0)
    cycles(client)
    assert client.enabled


def test_a_codesys_controller_waits_for_no_connection_without_an_end(
    gateway: GatewayAtHand, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To an address where nothing answers ClientTCP may connect for as long as TCP tries; the enable of before that time would
    press when the gateway is switched on."""
    monkeypatch.setattr(ClientTcp, "open", lambda self: None)
    client = Codesys(TEXTS["codesys"], gateway)
    client.enable(12.0)
    client.cycle(0.8)
    assert client.ended and "lost" in client.text
    monkeypatch.undo()
    client.cycle(8.0)
    assert gateway.requests and gateway.writes == [] and not client.enabled


@pytest.mark.parametrize("number", [1861, 0x8007274C])
def test_a_twincat_controller_takes_no_number_of_ads_or_windows_for_a_refusal(
    number: int, gateway: GatewayAtHand, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a connection that timed out, say (10060 in Winsock): a status that is read behind it has another request's reason."""
    monkeypatch.setattr(TwinCatRequest, "NO_ANSWER", number)
    client = TwinCat(TEXTS["twincat"], gateway)
    client.enable(12.0)
    cycles(client)
    lost = lose_one(gateway)
    client.force(13.0)
    cycles(client, 2)
    assert lost and client.ended and "lost" in client.text


def test_a_robot_says_whether_its_connection_was_closed_or_nobody_answered(gateway: GatewayAtHand) -> None:
    """The one is the gateway's doing (its allow-list, its limits, an end of its program), the other a cable's."""
    client = Irc5(TEXTS["rapid"], gateway)
    cycles(client)
    client.is_open = False
    client.cycle()
    assert client.text == "lost: connection closed"
    client.cycle(4.0)
    assert client.get("fgConnected")
    gateway.is_cut = True
    client.cycle()
    assert client.text == "lost: no answer in time"
