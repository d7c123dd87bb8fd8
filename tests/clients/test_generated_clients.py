"""Each generated client, run by an interpreter of its own language against the real register bank."""

from __future__ import annotations

import math
import struct
from ipaddress import ip_address
from itertools import pairwise
from typing import Any

import pytest

from gateway.clients import render_client
from gateway.codes.faults import FaultCode
from gateway.registers import Status
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.s7 import S7
from tests.clients.programs.controllers.structured_text import Codesys
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.scenes import MAP, TEXTS, WHERE, command, commands, cycles


def test_who_commands_nothing_only_reads_the_whole_status(client: Any, gateway: GatewayAtHand) -> None:
    cycles(client)
    assert set(gateway.requests[1:]) == {struct.pack(">BHH", 3, 100, 32)}, "behind map_hash"
    assert not client.enabled


def test_enable_writes_the_whole_command_once_and_then_a_new_heartbeat_each_time(
    client: Any, gateway: GatewayAtHand
) -> None:
    client.enable(12.34)
    cycles(client)
    assert commands(gateway) == [command(1, 1234)]
    beats = gateway.beats
    assert len(beats) > 3 and beats == list(range(beats[0], beats[0] + len(beats)))
    assert len(gateway.words) == 1
    assert client.enabled
    client.disable()
    cycles(client)
    assert commands(gateway)[-1] == command(0, 0)
    assert not client.enabled


@pytest.mark.sampled
def test_a_refused_force_is_told_and_the_last_accepted_one_goes_on(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    client.force(65.0)
    cycles(client)
    assert [code for _, code in gateway.exceptions] == [3], "refused once, and not asked for again"
    assert commands(gateway) == [command(1, 1200), command(1, 6500)]
    assert "W204 value out of range" in client.text
    assert client.enabled and not client.ended
    beats = len(gateway.beats)
    cycles(client)
    assert len(gateway.beats) > beats


def test_another_master_s_stop_is_not_undone(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    gateway.stop_from_elsewhere()
    cycles(client)
    assert gateway.bank.command.control_word == 0
    assert commands(gateway) == [command(1, 1200)]
    assert client.ended and not client.enabled
    assert "another master" in client.text


def test_another_master_s_takeover_ends_it_and_leaves_that_one_alone(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    gateway.take_over_from_elsewhere()
    cycles(client)
    assert client.ended
    assert "W210" in client.text
    seen = len(gateway.writes)
    cycles(client)
    assert len(gateway.writes) == seen
    assert gateway.bank.command.force_setpoint_n == 7.0


@pytest.mark.parametrize("language", ["rapid", "urscript"], indirect=True)
def test_a_disable_while_a_refusal_comes_back_is_not_lost(client: Any, gateway: GatewayAtHand) -> None:
    """The program runs beside the client's task: it may disable between a question and its answer."""
    client.enable(12.0)
    cycles(client)
    client.force(65.0)
    answer = gateway.answer

    def disable_meanwhile(request: bytes) -> bytes:
        if request[0] == 23:
            client.disable()
        return answer(request)

    gateway.answer = disable_meanwhile  # type: ignore[method-assign]
    client.cycle()
    gateway.answer = answer  # type: ignore[method-assign]
    cycles(client)
    assert gateway.exceptions == [(23, 3)]
    assert not client.enabled
    assert commands(gateway)[-1] == command(0, 0)


def test_a_refused_enable_is_not_repeated(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(65.0)
    cycles(client, 10)
    assert len(gateway.exceptions) == 1
    assert not client.enabled
    client.enable(12.0)
    cycles(client)
    assert client.enabled


def test_a_force_that_the_map_does_not_allow_is_not_sent(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    client.force(400.0)
    cycles(client)
    assert commands(gateway) == [command(1, 1200)]
    assert "0.00 .. 327.67" in client.text


def test_a_force_that_the_map_does_not_allow_enables_nothing(client: Any, gateway: GatewayAtHand) -> None:
    if isinstance(client, UniversalRobot):
        assert client.machine.start("fg_enable", 400.0) is False
    else:
        client.enable(400.0)
    cycles(client)
    assert gateway.writes == []
    assert not client.enabled
    assert "0.00 .. 327.67" in client.text


@pytest.mark.sampled
def test_after_a_fault_nothing_is_enabled_until_it_is_asked_for_again(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    gateway.fail(FaultCode.OVER_FORCE)
    client.cycle()
    seen = len(gateway.words)
    cycles(client, 10)
    assert len(gateway.words) == seen, "nothing is written after the fault was seen"
    assert gateway.exceptions == []
    assert gateway.bank.command.control_word == 0
    assert client.ended
    assert client.text == "A313 too much force"
    client.reset()
    cycles(client)
    assert any(words[0] == 2 for words in gateway.words)
    client.enable(5.0)
    cycles(client)
    assert commands(gateway)[-1] == command(1, 500)
    assert client.enabled and not client.ended and not client.text


@pytest.mark.sampled
def test_a_loss_while_enabled_ends_in_off_and_stays_there(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    gateway.is_cut = True
    cycles(client, 3)
    assert client.ended and not client.enabled
    assert "lost" in client.text
    gateway.is_cut = False
    seen = len(gateway.requests)
    client.CYCLE_S = 0.05
    for _ in range(6):
        client.cycle(1.0)
    after = GatewayAtHand(MAP)
    after.requests = gateway.requests[seen:]
    assert commands(after) == [command(0, 0)]
    assert not client.enabled
    client.enable(3.0)
    cycles(client)
    assert client.enabled


@pytest.mark.parametrize("language", ["rapid", "scl", "twincat", "codesys", "python"], indirect=True)
def test_attempts_to_connect_again_become_rarer(language: str, gateway: GatewayAtHand) -> None:
    client = CONTROLLERS[language](TEXTS[language], gateway)
    gateway.is_cut = True
    tries: list[float] = []
    now_s = 0.0

    def refuse(*_: object) -> bytes:
        tries.append(now_s)
        raise Unplugged

    gateway.answer = refuse  # type: ignore[method-assign]
    gateway.connect = refuse  # type: ignore[method-assign,assignment]
    client.CYCLE_S = 0.05
    for _ in range(260):
        client.cycle(0.05)
        now_s += 0.05
    gaps = [later - earlier for earlier, later in pairwise(tries)]
    assert 5 <= len(tries) <= 8
    assert min(gaps[-2:]) > 3.5 > 0.8 > gaps[0], "and no rarer than each 4 s"


def test_a_robot_waits_longer_before_each_attempt(gateway: GatewayAtHand) -> None:
    client = UniversalRobot(TEXTS["urscript"], gateway)
    gateway.is_cut = True
    waits = []
    for _ in range(7):
        client.cycle()
        waits.append(client.get("fg_backoff"))
    assert waits == [0.25, 0.5, 1.0, 2.0, 4.0, 4.0, 4.0]


def test_a_robot_s_thread_pauses_between_cycles_and_longer_behind_each_loss(gateway: GatewayAtHand) -> None:
    client = UniversalRobot(TEXTS["urscript"], gateway)
    assert client.serve(3) == [0.04, 0.04, 0.04]
    gateway.is_cut = True
    assert client.serve(4) == pytest.approx([0.29, 0.54, 1.04, 2.04])


def test_words_are_signed_and_unavailable_values_are_told_from_numbers(gateway: GatewayAtHand) -> None:
    gateway.bank.publish(Status(force_measured_n=-1.25, trim_v=math.nan))
    gateway.answer(struct.pack(">BHH", 3, 5000, 1))  # refused, without a value: not a number
    irc5, robot = Irc5(TEXTS["rapid"], gateway), UniversalRobot(TEXTS["urscript"], gateway)
    irc5.cycle()
    robot.cycle()
    status = irc5.get("fgStatus")
    names = ("FG_S_FORCE_MEASURED", "FG_S_TRIM", "FG_S_REFUSAL_VALUE")
    assert [status[irc5.get(name) - 1] for name in names] == [-1.25, 9e9, 9e9]
    assert (robot.get("fg_force_measured"), robot.machine.start("fg_scaled", robot.get("FG_S_TRIM"), 1)) == (-1.25, 9e9)
    for plc in (S7(TEXTS["scl"], gateway), Codesys(TEXTS["st"], gateway)):
        gateway.answer(struct.pack(">BHH", 3, 5000, 1))
        plc.cycle()
        shown = plc.output("status")
        assert (shown["FORCE_MEASURED"], shown["TRIM"], shown["REFUSAL_VALUE"]) == (-1.25, 9e9, 9e9)
        plc.enable(65.0)
        cycles(plc, 2)
        assert plc.output("status")["REFUSAL_VALUE"] == 65.0
        plc.disable()


def test_who_owns_the_setpoint_is_told_by_the_four_numbers_of_its_address(gateway: GatewayAtHand) -> None:
    gateway.take_over_from_elsewhere()
    for plc in (S7(TEXTS["scl"], gateway), Codesys(TEXTS["st"], gateway)):
        plc.cycle()
        assert plc.output("status")["OWNER_IP"] == int(ip_address("10.0.0.7"))
    irc5 = Irc5(TEXTS["rapid"], gateway)
    irc5.cycle()
    assert irc5.get("fgStatus")[irc5.get("FG_S_OWNER_IP") - 1 :][:2] == [10 << 8, 7]
    python = CONTROLLERS["python"](TEXTS["python"], gateway)
    python.cycle()
    assert python.client.status["owner_ip"] == int(ip_address("10.0.0.7"))


def test_a_pull_goes_out_with_enable_only_and_ends_with_it(client: Any, gateway: GatewayAtHand) -> None:
    client.pull(pulls=True)
    cycles(client, 2)
    assert gateway.writes == []
    client.enable(6.0)
    cycles(client, 3)
    client.pull(pulls=False)
    cycles(client, 3)
    client.pull(pulls=True)
    cycles(client, 3)
    gateway.stop_from_elsewhere()
    cycles(client, 3)
    assert commands(gateway) == [command(17, 600), command(1, 600), command(17, 600)]
    assert client.ended and not client.enabled


@pytest.mark.parametrize("language", ["rapid", "urscript"], indirect=True)
def test_whole_frames_are_those_that_the_python_client_makes(
    language: str, client: Any, gateway: GatewayAtHand
) -> None:
    python: dict[str, Any] = {}
    exec(render_client(MAP, "python", WHERE), python)
    client.enable(12.34)
    cycles(client, 3)
    client.disable()
    cycles(client, 2)
    assert len(client.sent) == 7
    assert client.sent[0] == python["read_frame"](1, 1, 412, 2)
    assert client.sent[1] == python["write_frame"](2, 1, 416, struct.unpack(">2H", struct.pack(">f", 1234.5)))
    for number, frame in enumerate(client.sent[2:], start=3):
        if frame[7] == 3:
            assert frame == python["read_frame"](number, 1, 100, 32)
        else:
            address, words = gateway.writes[number - 3]
            assert frame == python["exchange_frame"](number, 1, address, words)
