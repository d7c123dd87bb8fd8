"""A stop that is shorter than a request of a PLC: its block sees it in one call, and the gateway hears of it."""

from __future__ import annotations

import pytest

from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers import Plc
from tests.clients.scenes import TEXTS, command, commands, cycles

BLOCKS = ("scl", "twincat", "codesys")


def switch(client: Plc, *, on: bool) -> None:
    client.inputs[client.NAMES["enable"]] = on


@pytest.mark.parametrize("language", BLOCKS)
@pytest.mark.parametrize("scans", range(12))
def test_an_enable_that_falls_for_one_call_is_a_stop_wherever_its_request_is(
    language: str, scans: int, gateway: GatewayAtHand
) -> None:
    """`released` falls for 10 ms, a guard that bounces, say: the fall was over before the next request, and no word of it went
    out. scans: where between its requests the block is then."""
    client: Plc = CONTROLLERS[language](TEXTS[language], gateway)
    client.enable(12.0)
    cycles(client)
    for _ in range(scans):
        client.scan()
    switch(client, on=False)
    client.scan()
    switch(client, on=True)
    cycles(client)
    assert commands(gateway) == [command(1, 1200), command(0, 0), command(1, 1200)]
    assert client.enabled and not client.ended and not gateway.exceptions


@pytest.mark.parametrize("language", BLOCKS)
@pytest.mark.parametrize("scans", range(1, 24))
def test_a_fall_while_the_enable_is_on_its_way_is_a_stop_too(language: str, scans: int, gateway: GatewayAtHand) -> None:
    client: Plc = CONTROLLERS[language](TEXTS[language], gateway)
    cycles(client)
    client.enable(12.0)
    for _ in range(scans):
        client.scan()
    was_asked = bool(gateway.words)
    switch(client, on=False)
    client.scan()
    switch(client, on=True)
    cycles(client)
    told = [words[:2] for words in commands(gateway)]
    assert told in ([(1, 1200), (0, 0), (1, 1200)], *([] if was_asked else [[(1, 1200)]]))
    assert client.enabled and not client.ended and not gateway.exceptions
