"""An S7's block between two of its calls: an answer that comes late, and what an upload says of itself."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest

from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.s7 import S7, MbClient
from tests.clients.scenes import MAP, MODEL, TEXTS, commands, cycles


@pytest.fixture
def client(gateway: GatewayAtHand) -> S7:
    return S7(TEXTS["scl"], gateway)


@pytest.mark.sampled
@pytest.mark.parametrize("scans", range(1, 16))
def test_an_enable_that_falls_before_its_answer_has_come_is_stopped(
    client: S7, gateway: GatewayAtHand, monkeypatch: pytest.MonkeyPatch, scans: int
) -> None:
    """The gateway presses already while its answer is on the network: the fall of one call was over by then, and the force
    stayed on."""
    begin, finish = MbClient.call, MbClient.finish

    def ask_at_once(self: MbClient, given: dict[str, Any]) -> None:
        was_busy = self.BUSY
        begin(self, given)
        if self.BUSY and not was_busy:
            finish(self, given)
            self.late, self.data = (self.DONE, self.ERROR, self.STATUS), list(given["MB_DATA_PTR"])
            self.DONE = self.ERROR = False

    def tell(self: MbClient, given: dict[str, Any]) -> None:
        self.DONE, self.ERROR, self.STATUS = self.late

    monkeypatch.setattr(MbClient, "call", ask_at_once)
    monkeypatch.setattr(MbClient, "finish", tell)
    cycles(client)
    client.enable(12.0)
    for _ in range(scans):
        client.scan()
    presses = any(words[0] for words in gateway.words)
    client.inputs["enable"] = False
    client.scan()
    client.inputs["enable"] = True
    cycles(client)
    assert [words[0] for words in commands(gateway)] == ([1, 0, 1] if presses else [1])


def test_the_largest_force_of_the_map_is_asked_for_and_a_larger_one_is_not(client: S7, gateway: GatewayAtHand) -> None:
    most_n = MAP.find("force_setpoint").maximum
    client.enable(most_n + 0.02)
    cycles(client)
    assert gateway.words == [] and not gateway.exceptions
    client.enable(most_n)
    cycles(client)
    assert gateway.exceptions == [(16, 3)], "what this rig allows the gateway says"


def test_an_infinite_value_is_no_number(client: S7, gateway: GatewayAtHand) -> None:
    (address,) = (one.address for one in MAP.registers_of("float_abcd") if one.name == "force_setpoint")
    gateway.answer(struct.pack(">BHHBf", 16, address, 2, 4, math.inf))
    cycles(client)
    assert client.output("status")["REFUSAL_VALUE"] == 9.0e9


def member(client: S7, name: str) -> Any:
    return client.machine.member(client.block, name)


def test_an_upload_that_is_asked_for_while_lost_has_failed(client: S7, gateway: GatewayAtHand) -> None:
    """A program that waits for `uploadDone` or `uploadError` would wait for ever."""
    cycles(client)
    gateway.is_cut = True
    client.cycle(3.0)
    client.begin_upload(MODEL, 1)
    client.scan()
    assert (member(client, "uploadBusy"), member(client, "uploadError")) == (False, True)


def test_the_next_upload_blames_no_number_of_the_last_one(client: S7, gateway: GatewayAtHand) -> None:
    client.begin_upload(MODEL | {"rising_b": [0.0, 500.0, 600.0]}, 0)
    cycles(client, 8)
    assert (client.output("failing"), member(client, "uploadError")) == (1, True)
    client.begin_upload(MODEL | {"rising_b": [0.0, 20.25, 60.1]}, 0)
    client.scan()
    assert (client.output("failing"), member(client, "uploadError")) == (-1, False)


@pytest.mark.sampled
@pytest.mark.parametrize("scans", range(3, 36, 2))
def test_a_second_upload_waits_for_the_end_of_the_first(client: S7, gateway: GatewayAtHand, scans: int) -> None:
    """Begun anew between two parts it would send a CRC-32 of some of both, and be refused."""
    client.begin_upload(MODEL, 3)
    for _ in range(scans):
        client.scan()
    client.begin_upload(MODEL, 3)
    cycles(client, 8)
    assert (client.uploaded, len(gateway.uploads)) == (True, 5), client.text


def test_a_force_that_is_in_range_again_is_refused_no_more(client: S7, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    client.force(400.0)
    cycles(client)
    assert member(client, "refused") and commands(gateway)[-1][:2] == (1, 1200), "what holds goes on"
    client.force(13.0)
    cycles(client)
    assert not member(client, "refused") and commands(gateway)[-1][:2] == (1, 1300)


@pytest.mark.parametrize("scans", range(0, 12, 2))
def test_a_value_that_is_refused_takes_no_stop_with_it(client: S7, gateway: GatewayAtHand, scans: int) -> None:
    """A program that ends a job sets its next values in the same call; one of them is none, and the force has to go."""
    client.enable(12.0)
    cycles(client)
    for _ in range(scans):
        client.scan()
    client.structures["command"]["FORCE_RAMP"] = 1.0e6
    client.disable()
    refused_before = len(gateway.exceptions)
    while gateway.bank.command.control_word and len(gateway.exceptions) == refused_before:
        client.scan()
    assert gateway.bank.command.control_word == 0, "the stop is not behind a refusal: it is the first that goes out"


def test_a_write_that_was_taken_and_whose_answer_is_none_is_a_loss_and_no_refusal(
    client: S7, gateway: GatewayAtHand, monkeypatch: pytest.MonkeyPatch
) -> None:
    """16#8383: an answer that MB_CLIENT does not understand. The gateway presses by then, and a block that called it a refusal
    would not take it off."""
    finish, garbled = MbClient.finish, list[int]()

    def garble(self: MbClient, given: dict[str, Any]) -> None:
        finish(self, given)
        if given["MB_MODE"] == 1 and given["MB_DATA_LEN"] > 2 and not garbled:
            garbled.append(1)
            self.DONE, self.ERROR, self.STATUS = False, True, 0x8383

    cycles(client)
    monkeypatch.setattr(MbClient, "finish", garble)
    client.enable(12.0)
    client.cycle(3.0)
    assert garbled and [words[0] for words in commands(gateway)] == [1, 0]
    assert client.ended and not client.enabled
