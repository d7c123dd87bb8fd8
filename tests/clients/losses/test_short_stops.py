"""What ends a force between two requests of a PLC: a stop that is shorter than one, a connection that ends with one."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.registers.words import ControlBit
from gateway.registers.writes.proposed_write import EdgeRefusal
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.s7 import MbClient
from tests.clients.scenes import TEXTS, command, commands, cycles

BLOCKS = ("scl", "twincat", "codesys")


def switch(client: Plc, *, on: bool) -> None:
    client.inputs[client.NAMES["enable"]] = on


@pytest.mark.sampled
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


@pytest.mark.sampled
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


@pytest.mark.parametrize("failing", [6, 16], ids=["heartbeat", "new force"])
def test_a_write_that_ends_with_the_connection_is_a_loss_and_no_refusal(
    failing: int, gateway: GatewayAtHand, monkeypatch: pytest.MonkeyPatch
) -> None:
    """MB_CLIENT connects again by itself for the read behind it: the block took 16#80C5 for a refusal, commanded nothing any
    more, and called its own force another master's, which it does not stop. A rig without a lease pressed on."""
    client: Plc = CONTROLLERS["scl"](TEXTS["scl"], gateway)
    client.enable(12.0)
    cycles(client)
    finish, failed = MbClient.finish, list[int]()

    def close(self: MbClient, given: dict[str, Any]) -> None:
        function = (6 if given["MB_DATA_LEN"] == 1 else 16) if given["MB_MODE"] == 1 else 3
        if function != failing or failed:
            finish(self, given)
            return
        failed.append(function)
        self.ERROR, self.STATUS = True, 0x80C5  # the partner has closed the connection

    monkeypatch.setattr(MbClient, "finish", close)
    if failing == 16:
        client.force(13.0)
    client.cycle(3.0)
    assert failed and commands(gateway) == [command(1, 1200), command(0, 0)]
    assert client.ended and not client.enabled and "lost" in client.text


@pytest.mark.sampled
@pytest.mark.parametrize("language", BLOCKS)
@pytest.mark.parametrize("scans", range(12))
def test_a_reset_while_enabled_stops_with_the_next_request(language: str, scans: int, gateway: GatewayAtHand) -> None:
    """With nothing to reset the gateway refused it, and the stop beside it: the force stood for two requests more, 150 ms."""
    nothing = EdgeRefusal(RefusalReason.NOTHING_TO_RESET, ControlBit.RESET_FAULT, "no fault is latched")
    gateway.bank.on_asked = lambda proposal: (
        nothing if ControlBit.RESET_FAULT in proposal.command.control_word else None
    )
    client: Plc = CONTROLLERS[language](TEXTS[language], gateway)
    client.enable(12.0)
    cycles(client)
    for _ in range(scans):
        client.scan()
    client.inputs[client.NAMES["reset"]] = True
    cycles(client)
    assert commands(gateway)[:2] == [command(1, 1200), command(0, 0)]
    assert client.ended and not client.enabled and gateway.bank.command.control_word == 0


@pytest.mark.sampled
@pytest.mark.parametrize("language", BLOCKS)
@pytest.mark.parametrize("scans", range(0, 12, 2))
@pytest.mark.parametrize("has_lease", [True, False])
def test_a_block_that_was_not_called_for_a_while_knows_nothing_of_before(
    language: str, scans: int, has_lease: bool, gateway: GatewayAtHand
) -> None:
    """TwinCAT and CODESYS go on with their data behind a stop of the PLC, and a program may call the block in one mode only:
    in band was what the gateway had held when it was called last, and without a lease that force went on by itself."""
    client: Plc = CONTROLLERS[language](TEXTS[language], gateway)
    client.enable(12.0)
    cycles(client)
    for _ in range(scans):
        client.scan()
    client.now_s += 5.0
    if has_lease:
        gateway.fail(FaultCode.MASTER_LOST)
    client.scan()
    assert client.ended and not client.enabled and not client.in_band and "was not called" in client.text
    client.cycle(3.0)
    assert gateway.bank.command.control_word == 0 and commands(gateway)[-1] == command(0, 0)
    assert client.ended and not client.enabled
    switch(client, on=False)
    client.reset()
    cycles(client)
    switch(client, on=True)
    cycles(client)
    assert client.enabled and client.in_band and not client.ended


@pytest.mark.parametrize("language", BLOCKS)
def test_a_block_that_is_called_rarely_but_steadily_loses_nothing(language: str, gateway: GatewayAtHand) -> None:
    client: Plc = CONTROLLERS[language](TEXTS[language], gateway)
    client.CYCLE_S = 0.1 if language == "codesys" else 0.4  # ModbusFB is given 0.5 s to connect, in some calls
    client.enable(12.0)
    for _ in range(40):
        client.scan()
    assert client.enabled and client.in_band and not client.ended


@pytest.mark.parametrize("language", BLOCKS)
def test_an_enable_of_before_a_stop_is_not_done_behind_it(language: str, gateway: GatewayAtHand) -> None:
    client: Plc = CONTROLLERS[language](TEXTS[language], gateway)
    client.scan()
    client.enable(12.0)
    client.scan()
    client.now_s += 5.0
    client.cycle(3.0)
    assert gateway.words == [] and client.ended and not client.enabled
