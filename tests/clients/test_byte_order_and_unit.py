"""What a rig may want of each generated client besides: a proof of its byte order, another unit than 1, its own address."""

from dataclasses import replace

import pytest

from gateway.clients import Endpoint, render_client
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.s7 import S7
from tests.clients.scenes import MAP, TEXTS, WHERE, cycles


@pytest.mark.sampled
def test_a_rig_that_wants_the_byte_order_first_is_enabled_and_shown_it_once_a_connection(language: str) -> None:
    gateway = GatewayAtHand(MAP, wants_echo=True)
    client = CONTROLLERS[language](TEXTS[language], gateway)
    cycles(client)
    assert gateway.echoes == 0, "who only watches writes nothing"
    client.enable(12.0)
    cycles(client, 12)
    assert client.enabled and gateway.exceptions == []
    assert gateway.echoes == 1
    gateway.is_cut = True
    cycles(client)
    gateway.is_cut = False
    cycles(client, 12)
    client.cycle(4.0)
    client.enable(12.0)
    cycles(client, 12)
    assert client.enabled and gateway.echoes == 2


@pytest.mark.sampled
def test_a_refused_echo_leaves_the_reason_to_the_command(language: str) -> None:
    gateway = GatewayAtHand(MAP)
    client = CONTROLLERS[language](TEXTS[language].replace("20480", "20481").replace("16#5000", "16#5001"), gateway)
    client.enable(12.0)
    cycles(client, 12)
    assert client.enabled and gateway.exceptions == [(16, 3)] and gateway.echoes == 1


@pytest.mark.sampled
def test_a_gateway_that_answers_another_unit_than_1_is_asked_as_that_unit(language: str) -> None:
    gateway = GatewayAtHand(MAP, units=(7,))
    text = render_client(MAP, {"twincat": "st", "codesys": "st"}.get(language, language), replace(WHERE, unit=7))
    client = CONTROLLERS[language](text, gateway)
    client.enable(12.0)
    cycles(client)
    assert client.enabled and not gateway.exceptions
    assert "255" not in "".join(line for line in text.splitlines() if "modbus_add_signal(" in line)


@pytest.mark.parametrize("language", sorted(set(CONTROLLERS) - {"c"}))
def test_each_request_goes_to_the_address_and_port_of_the_rig(language: str) -> None:
    """A program of C says them itself. With a value of before, or of an example, nobody answers, or another cell's gateway."""
    gateway, where = GatewayAtHand(MAP), Endpoint("10.11.12.13", 5021, 1)
    text = render_client(MAP, {"twincat": "st", "codesys": "st"}.get(language, language), where)
    client = CONTROLLERS[language](text, gateway)
    client.enable(12.0)
    cycles(client, 12)
    assert client.enabled and gateway.echoes == 1, "reads, writes and exchanges have gone out"
    assert gateway.asked_at == {("10.11.12.13", 5021)}


def test_an_s7_opens_the_connection_that_its_inputs_name() -> None:
    """Two gateways at one CPU need two connections, and another interface may lead to them."""
    client = S7(TEXTS["scl"], GatewayAtHand(MAP))
    cycles(client)
    assert client.connection == (64, 1)
    client.inputs |= {"interfaceId": 72, "connectionId": 9}
    cycles(client)
    assert client.connection == (72, 9)
