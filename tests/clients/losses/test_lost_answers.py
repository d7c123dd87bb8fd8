"""Whoever is not sure whether it has enabled says OFF first; whoever has not enabled stops no other master."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.clients import render_client
from gateway.codes.refusals import RefusalReason
from gateway.registers.words import ControlBit
from gateway.registers.writes.proposed_write import EdgeRefusal
from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged, refuse_commands
from tests.clients.programs.c_program import CProgram
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.scenes import MAP, TEXTS, WHERE, command, commands, cycles


def test_an_enable_whose_answer_is_lost_is_taken_back(client: Any, gateway: GatewayAtHand) -> None:
    """A rig without a lease would press on."""
    cycles(client)
    answer = gateway.answer

    def lose(request: bytes) -> bytes:
        pdu = answer(request)
        if gateway.words:
            gateway.is_cut = True
            raise Unplugged
        return pdu

    gateway.answer = lose  # type: ignore[method-assign]
    client.enable(12.0)
    cycles(client)
    gateway.answer = answer  # type: ignore[method-assign]
    assert gateway.bank.command.control_word == 1 and client.ended
    gateway.is_cut = False
    for _ in range(6):
        client.cycle(1.0)
    assert commands(gateway) == [command(1, 1200), command(0, 0)]
    assert gateway.bank.command.control_word == 0


def test_who_never_reached_a_gateway_stops_no_other_master_there(client: Any, gateway: GatewayAtHand) -> None:
    gateway.is_cut = True
    client.enable(12.0)
    cycles(client)
    gateway.is_cut = False
    gateway.take_over_from_elsewhere()
    for _ in range(6):
        client.cycle(1.0)
    assert gateway.requests and gateway.writes == []
    assert client.ended and gateway.bank.command.force_setpoint_n == 7.0


def test_an_off_that_is_refused_behind_a_loss_is_not_asked_for_again_and_again(
    client: Any, gateway: GatewayAtHand
) -> None:
    """Another master may have the setpoint by now: its refusal registers and its log would fill for as long as we run."""
    client.enable(12.0)
    cycles(client)
    gateway.is_cut = True
    cycles(client, 3)
    gateway.is_cut = False
    asked = refuse_commands(gateway)
    client.CYCLE_S = 0.05
    for _ in range(8):
        client.cycle(1.0)
    assert len(asked) == 1 and client.ended


def ask_before_off(client: Any, gateway: GatewayAtHand, ask: Any) -> None:
    """Ask over the new connection, behind the byte order and before OFF is answered."""
    answer, echoes = gateway.answer, gateway.echoes
    if isinstance(client, Plc):  # one thing after the other
        while gateway.echoes == echoes:
            client.scan()
        client.scan()
        ask(client)
        return

    def ask_behind_the_echo(request: bytes) -> bytes:
        if gateway.echoes > echoes:
            gateway.answer = answer  # type: ignore[method-assign]
            ask(client)
        return answer(request)

    gateway.answer = ask_behind_the_echo  # type: ignore[method-assign]


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("ask", "behind"),
    [
        pytest.param(lambda client: client.enable(20.0), [command(1, 2000)], id="another force"),
        pytest.param(lambda client: client.enable(65.0), [command(1, 6500)], id="a force that is refused"),
        pytest.param(lambda client: client.tare(), [command(4, 0)], id="a tare that is refused"),
    ],
)
def test_what_is_asked_for_behind_a_loss_waits_for_off(
    client: Any, gateway: GatewayAtHand, ask: Any, behind: list[tuple[int, ...]]
) -> None:
    """Beside it OFF went out with a tare, or was none, and was refused with it: 12 N were pressed on, and no more was said."""
    tare = EdgeRefusal(RefusalReason.TARE_REFUSED, ControlBit.TARE, "12.00 N are pressed")
    gateway.bank.on_asked = lambda proposal: tare if ControlBit.TARE in proposal.command.control_word else None
    client.enable(12.0)
    cycles(client)
    gateway.is_cut = True
    cycles(client, 3)
    gateway.is_cut = False
    ask_before_off(client, gateway, ask)
    for _ in range(6):
        client.cycle(1.0)
    assert commands(gateway) == [command(1, 1200), command(0, 0), *behind]
    assert gateway.bank.command.force_setpoint_n == (0.0 if gateway.exceptions else 20.0)


@pytest.mark.parametrize(
    "ask", [lambda client: client.enable(20.0), lambda client: client.tare()], ids=["force", "tare"]
)
def test_what_is_asked_for_while_it_connects_again_goes_out_behind_off_or_not_at_all(
    client: Any, gateway: GatewayAtHand, ask: Any
) -> None:
    """Ahead of OFF, or in its place, a force that nobody expects any more would be followed by another one."""
    client.enable(12.0)
    cycles(client)
    gateway.is_cut = True
    cycles(client, 3)
    gateway.is_cut = False
    answer, before = gateway.answer, len(gateway.requests)

    def ask_beside_the_map(request: bytes) -> bytes:
        gateway.answer = answer  # type: ignore[method-assign]
        ask(client)
        return answer(request)

    if isinstance(client, Plc):
        while len(gateway.requests) == before:
            client.scan()
        ask(client)
    else:
        gateway.answer = ask_beside_the_map  # type: ignore[method-assign]
    for _ in range(6):
        client.cycle(1.0)
    first, off, *behind = commands(gateway)
    assert (first, off) == (command(1, 1200), command(0, 0))
    assert behind in ([], [command(1, 2000)], [command(4, 0)], [command(4, 0), command(0, 0)])
    if isinstance(client, Irc5):
        assert behind, "its data are read once it is connected"


def test_the_python_client_takes_an_enable_back_whose_answer_was_lost(gateway: GatewayAtHand) -> None:
    python: dict[str, Any] = {}
    exec(render_client(MAP, "python", WHERE), python)
    client = python["Client"]()

    def lose(frame: bytes) -> bytes:
        gateway.ask(frame)
        raise client._drop("no answer")

    def answer(frame: bytes) -> bytes:
        return gateway.ask(frame)[8:]

    client._connect = lambda: None
    client._drop("not there yet")
    client.enable(12.0)
    client._drop("not there yet")
    client._ask = answer
    client.exchange()
    assert gateway.writes == [], "who has not enabled stops no other master"
    client.enable(12.0)
    client._prove_byte_order()
    client._ask = lose
    with pytest.raises(python["Lost"]):
        client.exchange()
    client._ask = answer
    client.tare()
    client.exchange()
    assert commands(gateway) == [command(1, 1200), command(0, 0)] and client.ended
    client.exchange()
    assert commands(gateway)[2:] == [command(4, 0)], "what was asked for behind the loss waits for OFF, and goes then"


@pytest.mark.parametrize("has_looked", [False, True])
def test_the_first_heartbeat_of_a_program_is_not_the_last_of_the_one_before(
    client: Any, gateway: GatewayAtHand, has_looked: bool
) -> None:
    """A reset wants a new one: of a short program that was started again and again each was refused."""
    gateway.bank.write_registers(4, b"\0\1", gateway.peer)
    gateway.publish(0.0, on=False)
    if has_looked or isinstance(client, (Irc5, Plc, UniversalRobot)):  # their cycles go on while nobody commands
        cycles(client)
    client.reset()
    cycles(client)
    assert [words[0] for words in gateway.words] == [2] and gateway.beats[0] == 2


def test_how_a_connection_was_lost_is_told_by_the_client_of_c(gateway: GatewayAtHand) -> None:
    """Of a gateway that had closed it, that nobody answered in time; of one that is not there, that it did not accept in time;
    of an answer that was cut, that it belonged to another question."""
    client = CProgram(TEXTS["c"], gateway)
    ask, told = gateway.ask, list[str]()

    def close(frame: bytes) -> bytes:
        raise ConnectionResetError

    def refuse() -> None:
        raise Unplugged

    for act in (close, lambda frame: ask(frame)[:-2], lambda frame: b""):
        gateway.ask = ask  # type: ignore[method-assign]
        client.cycle(5.0)
        gateway.ask = act  # type: ignore[method-assign, assignment]
        client.cycle()
        told.append(client.text.rpartition(": ")[2])
    gateway.connect = refuse  # type: ignore[method-assign]
    client.cycle(5.0)
    assert told == ["closed by the gateway", "no answer in time", "no answer in time"]
    assert client.text.endswith(": Connection refused")
