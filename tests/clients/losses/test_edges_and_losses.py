"""What a program asks for once is done once: edges, uploads, and what of them a loss leaves."""

from __future__ import annotations

from typing import Any

import pytest

from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.s7 import S7
from tests.clients.programs.controllers.structured_text import Codesys, TwinCat
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.scenes import MODEL, TEXTS, command, commands, cycles

TARE = 4
OF_A_PROGRAM = ("rapid", "urscript", "python", "c")
"""Languages whose client a program calls, and which read answers themselves; the others are blocks with inputs."""


def tares(gateway: GatewayAtHand) -> list[int]:
    return [words[0] for words in gateway.words if words[0] & ~1]


@pytest.mark.sampled
def test_a_force_is_sent_as_the_nearest_count(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.346)
    cycles(client)
    assert commands(gateway) == [command(1, 1235)]


@pytest.mark.parametrize("language", OF_A_PROGRAM)
def test_a_tare_that_is_asked_for_twice_before_it_is_sent_is_one(language: str, gateway: GatewayAtHand) -> None:
    client = CONTROLLERS[language](TEXTS[language], gateway)
    client.tare()
    client.tare()
    cycles(client)
    assert set(tares(gateway)) == {TARE}


def test_a_tare_that_was_lost_is_not_taken_when_nobody_expects_it_any_more(client: Any, gateway: GatewayAtHand) -> None:
    """A tool may press by then, and its force would be the new zero."""
    cycles(client)
    gateway.is_cut = True
    client.tare()
    cycles(client, 3)
    gateway.is_cut = False
    for _ in range(6):
        client.cycle(1.0)
    assert gateway.requests and tares(gateway) == []


@pytest.mark.parametrize("language", ["urscript"])
def test_a_tare_asked_for_between_a_question_and_its_answer_is_not_lost(language: str, gateway: GatewayAtHand) -> None:
    """The program's thread runs beside the client's."""
    client = CONTROLLERS[language](TEXTS[language], gateway)
    client.enable(12.0)
    answer = gateway.answer

    def tare_meanwhile(request: bytes) -> bytes:
        gateway.answer = answer  # type: ignore[method-assign]
        client.tare()
        return answer(request)

    client.cycle()
    gateway.answer = tare_meanwhile  # type: ignore[method-assign]
    client.force(13.0)
    cycles(client)
    assert tares(gateway) == [TARE | 1]


@pytest.mark.sampled
def test_a_second_upload_is_staged_as_the_first_was(client: Any, gateway: GatewayAtHand) -> None:
    for _ in range(2):
        client.begin_upload(MODEL, 3)
        cycles(client, 8)
        assert client.uploaded, client.text
    assert gateway.uploads[:5] == gateway.uploads[5:]


@pytest.mark.sampled
def test_an_upload_that_a_loss_has_cut_does_not_go_on_by_itself(client: Any, gateway: GatewayAtHand) -> None:
    """What was staged before may be another master's by then."""
    client.begin_upload(MODEL, 3)
    answer = gateway.answer

    def lose_the_second_part(request: bytes) -> bytes:
        gateway.is_cut = gateway.is_cut or request[:3] == b"\x10\x04\x2e"  # FC16 to 1070
        return answer(request)

    gateway.answer = lose_the_second_part  # type: ignore[method-assign]
    cycles(client, 8)
    assert gateway.is_cut and not client.uploaded
    gateway.is_cut, gateway.answer = False, answer  # type: ignore[method-assign]
    for _ in range(6):
        client.cycle(1.0)
    assert len(gateway.uploads) == 1 and not client.uploaded


@pytest.mark.sampled
def test_an_upload_that_is_refused_ends_and_says_why(client: Any, gateway: GatewayAtHand) -> None:
    answer, asked = gateway.answer, list[bytes]()

    def refuse_the_second_part(request: bytes) -> bytes:
        if request[:3] != b"\x10\x04\x2e":
            return answer(request)
        asked.append(request)
        return b"\x90\x03"

    gateway.answer = refuse_the_second_part  # type: ignore[method-assign]
    client.begin_upload(MODEL, 3)
    cycles(client, 8)
    assert len(asked) == 1 and len(gateway.uploads) == 1
    assert not client.uploaded and client.text


@pytest.mark.parametrize("language", OF_A_PROGRAM)
def test_an_answer_of_another_function_is_a_loss(language: str, gateway: GatewayAtHand) -> None:
    client = CONTROLLERS[language](TEXTS[language], gateway)
    cycles(client)
    ask = gateway.ask

    def alter(frame: bytes) -> bytes:
        answer = bytearray(ask(frame))
        answer[7] ^= 0x07  # FC03 -> FC04
        return bytes(answer)

    gateway.ask = alter  # type: ignore[method-assign]
    client.cycle()
    assert "lost" in client.text


def test_a_robot_that_has_reached_its_gateway_waits_no_longer_between_cycles(gateway: GatewayAtHand) -> None:
    gateway.is_cut = True
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    cycles(robot, 6)
    assert robot.get("fg_backoff") == 4.0
    gateway.is_cut = False
    cycles(robot)
    assert robot.get("fg_backoff") == 0.0


def test_a_robot_s_program_waits_for_a_force_that_stands_and_for_no_other(gateway: GatewayAtHand) -> None:
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    wait = lambda: robot.machine.start("fg_wait_in_band", 1.0)  # noqa: E731
    robot.enable(12.0)
    cycles(robot)
    robot.set(fg_in_band=True)
    assert wait() is True
    robot.set(fg_enabled=False)
    assert wait() is False, "of a force that is off"
    slept: list[float] = []
    robot.machine.library["sleep"] = lambda machine, arguments, frame: slept.append(0.0)
    robot.set(fg_ended=True, fg_enabled=False)
    assert wait() is False and not slept, "nobody waits for a gateway that has switched off"


def test_a_program_that_starts_again_reads_no_answer_to_the_one_before(gateway: GatewayAtHand) -> None:
    """Its transactions begin at 1 again: an answer left in a socket that the controller kept open would belong."""
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    robot.enable(12.0)
    cycles(robot, 2)
    left = gateway.ask(bytes((0, 1, 0, 0, 0, 6, 1, 3, 0, 100, 0, 32)))
    gateway.stop_from_elsewhere()
    robot.machine.begin()
    robot.received = left
    robot.cycle()
    assert robot.get("fg_connected") and not robot.enabled


def control_word_of(request: bytes) -> int:
    """Of a request that writes from address 0 on; else 0."""
    at = {16: 6, 23: 10}.get(request[0], 0)
    return int.from_bytes(request[at : at + 2], "big") if at and request[at - 5 : at - 3] == b"\0\0" else 0


def test_a_tare_that_is_refused_is_asked_for_once(client: Any, gateway: GatewayAtHand) -> None:
    answer, asked = gateway.answer, list[bytes]()

    def refuse(request: bytes) -> bytes:
        if not control_word_of(request) & TARE:
            return answer(request)
        asked.append(request)
        return bytes((request[0] | 0x80, 3))

    cycles(client)
    gateway.answer = refuse  # type: ignore[method-assign]
    client.tare()
    cycles(client, 8)
    assert len(asked) == 1


@pytest.mark.sampled
def test_an_upload_that_is_refused_costs_no_force(client: Any, gateway: GatewayAtHand) -> None:
    answer = gateway.answer
    client.enable(12.0)
    cycles(client)
    gateway.answer = lambda request: b"\x90\x03" if request[:3] == b"\x10\x04\x2e" else answer(request)  # type: ignore[method-assign]
    client.begin_upload(MODEL, 3)
    cycles(client, 8)
    assert client.enabled and not client.ended
    assert commands(gateway) == [command(1, 1200)]


def test_behind_a_refused_enable_nothing_is_written(client: Any, gateway: GatewayAtHand) -> None:
    """Not even a heartbeat: this master commands nothing."""
    client.enable(65.0)
    cycles(client)
    assert len(gateway.exceptions) == 1 and not client.enabled
    count = len(gateway.requests)
    cycles(client)
    assert {request[0] for request in gateway.requests[count:]} == {3}


@pytest.mark.parametrize("kind", [S7, TwinCat, Codesys])
def test_a_block_shows_nothing_stale_behind_a_loss_and_tries_soon_each_time(
    kind: type[Plc], gateway: GatewayAtHand
) -> None:
    client = kind(TEXTS["scl" if kind is S7 else "st"], gateway)
    for _ in range(2):
        client.enable(12.0)
        cycles(client)
        gateway.publish(12.0, on=True)
        cycles(client)
        shown = client.output("status")
        flags = ("enabled", "ready", "in_band")
        assert all(client.machine.member(shown, name) for name in flags)
        gateway.is_cut = True
        client.cycle(1.5)
        assert not any(client.machine.member(client.output("status"), name) for name in flags)
        gateway.is_cut = False
        client.cycle(4.0)
    gateway.is_cut = True
    client.cycle(0.3)
    gateway.is_cut = False
    count = len(gateway.requests)
    client.cycle(0.6)
    assert len(gateway.requests) > count, "the pause begins anew with each loss"


@pytest.mark.parametrize("parts", range(1, 6))
def test_an_upload_that_a_robot_s_program_took_back_is_no_part_of_its_next_one(
    parts: int, gateway: GatewayAtHand
) -> None:
    """The next one went on where that had stopped: half of each set was committed, with a CRC-32 that was right, or none of
    the second, and the program read that it was uploaded."""
    robot = CONTROLLERS["rapid"](TEXTS["rapid"], gateway)
    robot.begin_upload(MODEL | {"rising_b": [0.0, 25.0, 60.1]}, 2)
    cycles(robot, parts)
    robot.set(fgUpload=False)
    cycles(robot, 1)
    count = len(gateway.uploads)
    assert count == parts and not robot.uploaded
    robot.begin_upload(MODEL, 3)
    cycles(robot, 8)
    assert robot.uploaded and [address for address, _ in gateway.uploads[count:]] == [1000, 1070, 1150, 1140, 1145]
