"""What takes a force back is never lost: not beside what is refused, not behind an answer that is late."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.registers.words import CommitStatus
from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged, refuse_commands
from tests.clients.losses.test_edges_and_losses import TARE, control_word_of
from tests.clients.programs.c_program import CProgram
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.s7 import S7, MbClient
from tests.clients.programs.controllers.structured_text import TwinCat
from tests.clients.programs.iec_libraries import TwinCatRequest
from tests.clients.programs.python_program import PythonProgram
from tests.clients.scenes import MODEL, TEXTS, command, commands, cycles


def refuse_tares(gateway: GatewayAtHand) -> list[bytes]:
    """As the gateway does while air presses; return where each one will be noted."""
    answer, asked = gateway.answer, list[bytes]()

    def refuse(request: bytes) -> bytes:
        if not control_word_of(request) & TARE:
            return answer(request)
        asked.append(request)
        return bytes((request[0] | 0x80, 6))

    gateway.answer = refuse  # type: ignore[method-assign]
    return asked


def lose_the_answer_to(gateway: GatewayAtHand, is_it: Any) -> None:
    """Let the gateway take that request, once, and its answer come too late; the connection stands, or the next one does."""
    answer = gateway.answer

    def lose(request: bytes) -> bytes:
        pdu = answer(request)
        if is_it(request):
            gateway.answer = answer  # type: ignore[method-assign]
            raise Unplugged
        return pdu

    gateway.answer = lose  # type: ignore[method-assign]


def test_a_disable_beside_a_tare_that_is_refused_is_no_less_a_disable(client: Any, gateway: GatewayAtHand) -> None:
    """A tool is lifted and tared in one: the tare comes too early, the whole write is refused, and the force has to go."""
    client.enable(12.0)
    cycles(client)
    asked = refuse_tares(gateway)
    client.disable()
    client.tare()
    cycles(client, 8)
    assert len(asked) == 1
    assert gateway.bank.command.control_word == 0 and not client.enabled
    assert commands(gateway) == [command(1, 1200), command(0, 0)]


def test_who_may_not_even_disable_asks_for_it_no_more_than_twice(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    asked = refuse_commands(gateway)
    client.disable()
    cycles(client, 10)
    assert 1 <= len(asked) <= 2


@pytest.mark.sampled
@pytest.mark.parametrize("counts", [1200, None], ids=["enable", "heartbeat"])
def test_an_answer_that_comes_too_late_is_a_loss_and_no_refusal(
    counts: int | None, client: Any, gateway: GatewayAtHand
) -> None:
    """Libraries connect again by themselves, and the read behind a write without an answer succeeds."""
    cycles(client)
    if counts is None:
        client.enable(12.0)
        cycles(client)
    lose_the_answer_to(gateway, lambda request: request[0] in (6, 16, 23) and bool(gateway.words))
    client.enable(12.0)
    for _ in range(6):
        client.cycle(1.0)
    assert commands(gateway) == [command(1, 1200), command(0, 0)]
    assert client.ended and not client.enabled and "refused" not in client.text


@pytest.mark.parametrize(("kind", "language"), [(S7, "scl"), (TwinCat, "st")])
def test_an_answer_that_is_lost_is_no_refusal_whatever_number_the_library_gives_it(
    kind: Any, language: str, gateway: GatewayAtHand, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not all their numbers are documented; heartbeat_echo shows whether the gateway has taken what was written."""
    monkeypatch.setattr(MbClient, "NO_ANSWER", 0x80A1)
    monkeypatch.setattr(TwinCatRequest, "NO_ANSWER", 0x8004)
    client = kind(TEXTS[language], gateway)
    cycles(client)
    lose_the_answer_to(gateway, lambda request: request[0] in (16, 23) and bool(gateway.words))
    client.enable(12.0)
    for _ in range(6):
        client.cycle(1.0)
    assert commands(gateway) == [command(1, 1200), command(0, 0)]
    assert client.ended and not client.enabled and "lost" in client.text


@pytest.mark.parametrize(("kind", "language"), [(S7, "scl"), (TwinCat, "st")])
def test_a_heartbeat_that_the_gateway_has_seen_of_another_is_left_out(
    kind: Any, language: str, gateway: GatewayAtHand
) -> None:
    """Of the program before a start, or of another master: its echo would bear witness for a write that was refused."""
    gateway.answer(bytes((6, 0, 4, 0, 1)))
    gateway.answer(bytes((16, 0, 0, 0, 2, 4, 0, 0, 0, 0)))
    client = kind(TEXTS[language], gateway)
    cycles(client)
    seen = len(gateway.writes)
    client.enable(65.0)
    cycles(client)
    assert [words[4] for _, words in gateway.writes[seen:]] == [2] and "W204" in client.text


@pytest.mark.sampled
def test_an_enable_right_behind_a_reset_waits_until_the_reset_is_taken(client: Any, gateway: GatewayAtHand) -> None:
    """In one write they would be refused: a reset needs enable 0 and force 0."""
    client.enable(12.0)
    cycles(client)
    client.disable()
    cycles(client)
    client.reset()
    client.enable(5.0)
    cycles(client)
    assert commands(gateway)[-2:] == [command(2, 0), command(1, 500)]
    assert not gateway.exceptions and client.enabled


@pytest.mark.sampled
def test_a_force_that_is_refused_during_an_upload_ends_no_upload(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    client.begin_upload(MODEL, 3)
    client.cycle()
    client.force(65.0)
    cycles(client, 10)
    assert client.uploaded and client.enabled
    assert [code for _, code in gateway.exceptions] == [3]


def refuse_uploads(gateway: GatewayAtHand) -> None:
    answer = gateway.answer
    gateway.answer = lambda request: b"\x90\x03" if request[:2] == b"\x10\x03" else answer(request)  # type: ignore[method-assign]


def test_an_upload_that_is_refused_forgets_no_command_that_waits_in_python(gateway: GatewayAtHand) -> None:
    program = PythonProgram(TEXTS["python"], gateway)
    program.enable(12.0)
    cycles(program)
    refuse_uploads(gateway)
    program.disable()
    with pytest.raises(program.module["Refused"]):
        program.client.stage(MODEL, 3)
    cycles(program)
    assert commands(gateway) == [command(1, 1200), command(0, 0)] and not program.enabled


def test_an_upload_that_is_refused_forgets_no_command_that_waits_in_c(gateway: GatewayAtHand) -> None:
    program = CProgram(TEXTS["c"], gateway)
    program.enable(12.0)
    cycles(program)
    refuse_uploads(gateway)
    program.begin_upload(MODEL, 3)
    program.disable()
    assert program._upload is not None
    assert program._stage(*program._upload) == 1
    program._upload = None
    cycles(program)
    assert commands(gateway) == [command(1, 1200), command(0, 0)] and not program.enabled


@pytest.mark.sampled
def test_a_heartbeat_goes_on_while_a_commit_is_written_to_the_disk(client: Any, gateway: GatewayAtHand) -> None:
    """That may take longer than a lease."""
    client.enable(12.0)
    cycles(client)
    beats: list[int] = []

    def take_long(_action: object, _words: bytes, _peer: object) -> None:
        gateway.bank.staging.show_commit(CommitStatus.WRITING)
        answer = gateway.answer

        def finish_behind_five(request: bytes) -> bytes:
            if request[:3] == b"\x03\x04\x7a" and len(gateway.beats) >= len(beats) + 5:  # FC03 of commit_status
                gateway.bank.staging.show_commit(CommitStatus.COMMITTED)
            return answer(request)

        beats.extend(gateway.beats)
        gateway.answer = finish_behind_five  # type: ignore[method-assign]

    gateway.bank.staging.on_commit = take_long
    client.begin_upload(MODEL, 3)
    cycles(client, 30)
    assert client.uploaded and client.enabled, client.text


def test_a_robot_s_task_that_starts_again_while_a_force_was_asked_for_says_that_it_has_ended(
    gateway: GatewayAtHand,
) -> None:
    """Behind a power failure the motion program goes on where it stood, and looks at fgEnded."""
    client = Irc5(TEXTS["rapid"], gateway)
    client.machine.start("FgInit")
    assert not client.ended
    client.enable(12.0)
    cycles(client)
    client.machine.start("FgInit")
    assert client.ended and not client.get("fgEnable")
    client.enable(12.0)
    client.cycle(10.0)
    assert not client.ended


@pytest.mark.sampled
def test_a_refusal_of_something_else_turns_no_pull_into_a_push(client: Any, gateway: GatewayAtHand) -> None:
    """A tare that comes too early, between the program's choice of the direction and its enable."""
    client.pull(pulls=True)
    cycles(client)
    refuse_tares(gateway)
    client.tare()
    cycles(client, 8)
    client.enable(12.0)
    cycles(client)
    client.pull(pulls=False)
    client.disable()
    client.tare()
    cycles(client, 8)
    client.enable(12.0)
    cycles(client)
    assert commands(gateway) == [command(17, 1200), command(0, 0), command(1, 1200)]
