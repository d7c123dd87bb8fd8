"""A client that was made from another map than the gateway's, where 12 N may be 120: it says so, and commands nothing."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import pytest

from gateway.registers import RegisterMap
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.scenes import MAP, MODEL, TEXTS, command, commands, cycles
from tests.clients.texts.test_controller_rules import own_map

FORCE = "force_setpoint, address: 1, type: int16, scale: 0.01, unit: N, access: RW, min: 0, max: 327.67"
HASH = struct.pack(">BHH", 3, 412, 2)


@pytest.fixture
def tenths(tmp_path: Path) -> RegisterMap:
    return own_map(tmp_path, FORCE, FORCE.replace("0.01", "0.1"))


@pytest.mark.sampled
def test_a_client_of_another_map_says_so_and_commands_nothing(language: str, tenths: RegisterMap) -> None:
    gateway = GatewayAtHand(tenths)
    client = CONTROLLERS[language](TEXTS[language], gateway)
    for _ in range(2):
        client.enable(12.0)
        cycles(client, 8)
        client.cycle(5.0)
        assert client.ended and not client.enabled
        assert "the map has changed: generate this client again" in client.text
        client.disable()
        cycles(client)
    client.begin_upload(MODEL, 1)
    client.cycle(5.0)
    assert set(gateway.requests) == {HASH}, "no force, no upload, no proof of the byte order"


@pytest.mark.sampled
def test_of_another_map_it_asks_less_and_less_often(language: str, tenths: RegisterMap) -> None:
    """Each answer of that gateway was a success, behind which the pause began anew."""
    gateway = GatewayAtHand(tenths)
    client = CONTROLLERS[language](TEXTS[language], gateway)
    for _ in range(200):
        client.cycle(0.1)
    if language == "urscript":  # its thread sleeps for the pause itself
        assert client.get("fg_backoff") == 4.0
    else:
        assert 4 <= gateway.requests.count(HASH) <= 10, "in 20 s, at pauses of 0.25 to 4 s"


@pytest.mark.sampled
def test_a_gateway_that_comes_back_with_another_map_is_not_commanded(language: str, tenths: RegisterMap) -> None:
    """Not even the OFF behind a loss: what has another map by now has started anew, in OFF."""
    gateway = GatewayAtHand(MAP)
    client = CONTROLLERS[language](TEXTS[language], gateway)
    client.enable(12.0)
    cycles(client)
    gateway.is_cut = True
    cycles(client)
    known, gateway.bank, gateway.is_cut = gateway.bank, GatewayAtHand(tenths).bank, False
    count = len(gateway.writes)
    client.cycle(5.0)
    client.enable(12.0)
    client.cycle(5.0)
    assert len(gateway.writes) == count and "the map has changed" in client.text
    gateway.bank = known
    client.disable()
    client.cycle(5.0)
    client.enable(3.0)
    cycles(client)
    assert client.enabled and commands(gateway)[-1] == command(1, 300)


def test_the_map_is_asked_for_once_a_connection(client: Any, gateway: GatewayAtHand) -> None:
    cycles(client)
    client.enable(12.0)
    cycles(client)
    assert gateway.requests.count(HASH) == 1 and gateway.requests[0] == HASH


def test_a_gateway_that_has_its_hash_elsewhere_or_answers_another_unit_is_not_commanded(
    client: Any, gateway: GatewayAtHand
) -> None:
    answer = gateway.answer
    gateway.answer = lambda request: b"\x83\x02" if request == HASH else answer(request)  # type: ignore[method-assign]
    client.enable(12.0)
    cycles(client)
    client.cycle(5.0)
    assert gateway.requests == [] and client.ended
    assert "map_hash is refused: another map or unit" in client.text


@pytest.mark.sampled
def test_a_hash_that_differs_in_one_byte_is_another_map_s(client: Any, gateway: GatewayAtHand) -> None:
    answer = gateway.answer
    right = answer(HASH)
    for place in range(2, len(right)):
        other = right[:place] + bytes([right[place] ^ 1]) + right[place + 1 :]
        gateway.answer = lambda request, other=other: other if request == HASH else answer(request)  # type: ignore[method-assign]
        client.enable(12.0)
        client.cycle(5.0)
        cycles(client, 3)
        assert gateway.writes == [] and client.ended, place
        client.disable()
        client.cycle(5.0)
