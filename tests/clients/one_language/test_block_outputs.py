"""What a block shows its program: nothing of before a loss, a refusal until something else is asked for, an end."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.refusals.test_disables_beside_refusals import refuse_tares
from tests.clients.scenes import TEXTS, cycles

BLOCKS = ("scl", "twincat", "codesys")


def block(language: str, gateway: GatewayAtHand) -> Plc:
    client: Plc = CONTROLLERS[language](TEXTS[language], gateway)
    return client


def is_refused(client: Plc) -> bool:
    return bool(client.machine.member(client.block, "refused" if client.NAMES["text"] == "text" else "bRefused"))


def shown(client: Any, name: str) -> Any:
    """A value of the status, by the register's name."""
    if isinstance(client, Plc):
        return client.machine.member(client.output("status"), name)
    place = client.get(f"FG_S_{name.upper()}")
    return client.get("fgStatus")[place - 1] if isinstance(client, Irc5) else client.get("fg_status")[place]


@pytest.mark.parametrize("language", [*BLOCKS, "rapid", "urscript"])
def test_behind_a_loss_no_word_of_the_status_says_that_force_is_held(language: str, gateway: GatewayAtHand) -> None:
    """C shows zeros and no force then, Python None: here a panel that reads state or contact showed 'holding 11.5 N'."""
    client: Any = CONTROLLERS[language](TEXTS[language], gateway)
    client.enable(12.0)
    cycles(client)
    assert (shown(client, "status_word"), shown(client, "state")) == (11, 3)
    gateway.is_cut = True
    client.cycle(1.5)
    assert (shown(client, "status_word"), shown(client, "state")) == (0, 0) and is_force_unknown(client)
    if isinstance(client, Plc):
        assert not any(shown(client, name) for name in ("contact", "fault", "warning"))


def is_force_unknown(client: Any) -> bool:
    if isinstance(client, UniversalRobot):
        assert client.get("fg_force_measured") == pytest.approx(9e9)
        return bool(shown(client, "force_measured") == 0x8000)
    return bool(shown(client, "force_measured") == pytest.approx(9e9))


@pytest.mark.parametrize("language", [*BLOCKS, "rapid", "urscript"])
def test_before_the_first_answer_no_measured_force_is_shown(language: str, gateway: GatewayAtHand) -> None:
    """0.0 N, for up to 2 s: a program that looks whether the tool is free before it moves found it so."""
    client: Any = CONTROLLERS[language](TEXTS[language], gateway)
    assert is_force_unknown(client)
    if isinstance(client, Plc):
        client.scan()
        assert is_force_unknown(client)
    cycles(client)
    assert shown(client, "force_measured") in (-0.5, 65486)


def test_a_module_of_rapid_that_starts_again_shows_nothing_of_its_last_run(gateway: GatewayAtHand) -> None:
    """PERS data outlast a restart of the controller: in band, before the first exchange, was the force of the day before."""
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    cycles(client)
    names = ("fgEnabled", "fgReady", "fgInBand", "fgConnected")
    assert all(client.get(name) for name in names) and shown(client, "state") == 3
    client.machine.start("FgInit")
    assert not any(client.get(name) for name in names)
    assert (shown(client, "state"), shown(client, "force_measured")) == (0, pytest.approx(9e9))


@pytest.mark.parametrize("language", BLOCKS)
def test_a_refusal_is_shown_until_another_command_is_taken(language: str, gateway: GatewayAtHand) -> None:
    """`refused` is of the last command, and stood until the next enable whatever was taken since."""
    client = block(language, gateway)
    client.enable(12.0)
    cycles(client)
    client.force(65.0)
    cycles(client)
    assert is_refused(client) and "W204" in client.text and not client.in_band
    client.force(20.0)
    cycles(client)
    assert not is_refused(client) and gateway.bank.command.force_setpoint_n == 20.0
    client.force(400.0)
    cycles(client)
    assert is_refused(client) and "0.00 .. 327.67" in client.text and not client.in_band
    client.force(20.0)
    cycles(client)
    assert not is_refused(client) and client.enabled and client.in_band


@pytest.mark.parametrize("language", BLOCKS)
def test_a_tare_that_is_refused_beside_a_disable_stays_told(language: str, gateway: GatewayAtHand) -> None:
    client = block(language, gateway)
    client.enable(12.0)
    cycles(client)
    refuse_tares(gateway)
    client.disable()
    client.tare()
    cycles(client, 8)
    assert is_refused(client) and not client.enabled


@pytest.mark.parametrize("language", BLOCKS)
def test_an_enable_that_a_reset_ends_is_told_to_have_ended(language: str, gateway: GatewayAtHand) -> None:
    """enable TRUE, nothing enabled, and no output that said why: rising with the reset, or standing beside it."""
    client = block(language, gateway)
    cycles(client)
    gateway.fail(FaultCode.OVER_FORCE)
    cycles(client)
    client.enable(12.0)
    client.inputs[client.NAMES["reset"]] = True
    cycles(client)
    assert client.inputs[client.NAMES["enable"]] and not client.enabled and gateway.fault == FaultCode.NONE
    assert client.ended
    client.inputs[client.NAMES["reset"]] = False
    client.enable(12.0)
    cycles(client)
    assert client.enabled and not client.ended
