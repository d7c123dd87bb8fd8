"""Two masters at one gateway: who commands nothing takes no other master's force, whatever words it has set beside enable, and
who commands a force undoes no other master's stop."""

from __future__ import annotations

import ctypes
from typing import Any

import pytest

from gateway.modbus import Peer
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.c_program import CProgram
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.scenes import TEXTS, cycles

OTHER = Peer("10.0.0.7", 40001)


def set_ramp(client: Any) -> None:
    """50 N/s, in the words of each language."""
    if isinstance(client, Irc5):
        client.get("fgCommand")[client.get("FG_C_FORCE_RAMP") - 1] = 500
    elif isinstance(client, UniversalRobot):
        client.machine.start("fg_set_command", client.get("FG_C_FORCE_RAMP"), 500)
    elif isinstance(client, Plc):
        client.structures[client.NAMES["command"]]["FORCE_RAMP"] = 50.0
    elif isinstance(client, CProgram):
        assert client._library.fg_set(client._client, 2, ctypes.c_float(50.0), ctypes.c_float(10.0)) == 0
    else:
        client.client.set("force_ramp", 50.0)


def held_elsewhere(gateway: GatewayAtHand) -> bool:
    command = gateway.bank.command
    return bool(command.control_word & 1) and command.force_setpoint_n == 7.0


def test_a_word_that_is_set_while_another_master_presses_is_not_its_stop(client: Any, gateway: GatewayAtHand) -> None:
    """The whole command goes out with enable 0, which anybody may: a second robot that only set its ramp took the force."""
    gateway.take_over_from_elsewhere()
    set_ramp(client)
    cycles(client)
    assert held_elsewhere(gateway) and gateway.writes == [] and gateway.requests
    gateway.stop_from_elsewhere()
    cycles(client)
    assert gateway.bank.command.force_ramp_n_per_s == 50.0, "it waited for the other one's end"


@pytest.mark.sampled
@pytest.mark.parametrize("edge", ["tare", "reset"])
def test_an_edge_that_is_asked_for_while_another_master_presses_is_refused_and_not_its_stop(
    client: Any, gateway: GatewayAtHand, edge: str
) -> None:
    """It goes out in a whole command with enable 0: it took the force, nothing was tared, and no word said so."""
    cycles(client)
    gateway.take_over_from_elsewhere()
    getattr(client, edge)()
    cycles(client)
    assert held_elsewhere(gateway) and "W210" in client.text and len(gateway.exceptions) == 1


def test_a_guest_that_connects_again_stops_nobody(client: Any, gateway: GatewayAtHand) -> None:
    """Each loss of a panel with a ramp in its data was the end of the force that a robot held."""
    set_ramp(client)
    cycles(client)
    gateway.take_over_from_elsewhere()
    count = len(gateway.writes)
    gateway.is_cut = True
    cycles(client, 3)
    gateway.is_cut = False
    for _ in range(6):
        client.cycle(1.0)
    assert held_elsewhere(gateway) and len(gateway.writes) == count


@pytest.mark.sampled
def test_a_word_that_is_set_while_nobody_presses_goes_out_and_with_the_next_enable(
    client: Any, gateway: GatewayAtHand
) -> None:
    set_ramp(client)
    cycles(client)
    assert gateway.bank.command.force_ramp_n_per_s == 50.0 and not gateway.bank.command.control_word
    client.enable(12.0)
    cycles(client)
    assert gateway.words[-1][:3] == (1, 1200, 500) and client.enabled
    client.disable()
    cycles(client)
    assert not gateway.bank.command.control_word and not client.enabled


@pytest.mark.sampled
@pytest.mark.parametrize("scans", range(0, 10, 2))
def test_a_force_that_changes_each_cycle_does_not_undo_another_master_s_stop(
    client: Any, gateway: GatewayAtHand, scans: int
) -> None:
    """The whole command went out with each new force, enable in it: behind a stop by MQTT it was holding again in 0.3 s.
    scans: where between its requests a PLC is when the stop comes."""
    client.enable(12.0)
    cycles(client)
    for _ in range(scans if isinstance(client, Plc) else 0):
        client.scan()
    client.force(12.5)
    cycles(client)
    assert gateway.bank.command.force_setpoint_n == 12.5 and gateway.bank.command.control_word == 1
    gateway.stop_from_elsewhere()
    client.force(13.0)
    cycles(client)
    assert gateway.bank.command.control_word == 0
    assert gateway.bank.command.force_setpoint_n == 0.0 and gateway.bank.owner is None, "nor does it keep others out"
    assert client.ended and not client.enabled
    assert "another master" in client.text
    client.force(14.0)
    cycles(client)
    assert gateway.bank.command.force_setpoint_n == 0.0 and gateway.bank.owner is None


@pytest.mark.sampled
def test_a_force_that_another_master_has_taken_over_is_asked_to_be_taken_back_no_more_than_twice(
    client: Any, gateway: GatewayAtHand
) -> None:
    """It went out behind a stop, and its owner took it back; by then the other one had taken over, and refuses."""
    client.enable(12.0)
    cycles(client)
    answer = gateway.answer

    def stop_and_take_over(request: bytes) -> bytes:
        is_new_force = b"\x05\x14" in request  # 13.00 N
        if is_new_force:
            gateway.stop_from_elsewhere()
        answered = answer(request)
        if is_new_force:
            gateway.take_over_from_elsewhere()
            gateway.bank.write_registers(0, b"\0\x08", OTHER)
        return answered

    gateway.answer = stop_and_take_over  # type: ignore[method-assign]
    client.force(13.0)
    cycles(client, 3)
    gateway.answer = answer  # type: ignore[method-assign]
    refused = len(gateway.exceptions)
    cycles(client, 9)
    assert len(gateway.exceptions) <= max(2, refused) and client.ended
    assert gateway.bank.owner == OTHER.host


@pytest.mark.parametrize("asked", ["pull", "tare"])
def test_a_pull_or_a_tare_does_not_undo_a_stop_of_since_the_last_cycle(
    client: Any, gateway: GatewayAtHand, asked: str
) -> None:
    """It goes out in a whole command, enable in it. A PLC has a status that is no older than its last request."""
    if isinstance(client, Plc):
        pytest.skip("asks without a pause")
    client.enable(12.0)
    cycles(client)
    gateway.stop_from_elsewhere()
    client.pull(pulls=True) if asked == "pull" else client.tare()
    cycles(client)
    assert not any(words[0] & 1 for words in gateway.words[-4:] if words[0] not in (0, 1)), "no enable beside it"
    assert gateway.bank.command.control_word & 1 == 0 and client.ended and not client.enabled
    client.enable(12.0)
    cycles(client)
    assert gateway.bank.command.control_word == (17 if asked == "pull" else 1)


def test_a_pull_that_is_asked_for_behind_a_stop_writes_nothing(client: Any, gateway: GatewayAtHand) -> None:
    """Not even a heartbeat: who presses by then would refuse it, and its word would stand for the stop."""
    if isinstance(client, Plc):
        pytest.skip("its request may be on its way")
    client.enable(12.0)
    cycles(client)
    gateway.stop_from_elsewhere()
    written = len(gateway.writes)
    client.pull(pulls=True)
    cycles(client)
    assert client.ended and not client.enabled
    assert gateway.bank.owner is None and len(gateway.writes) == written


@pytest.mark.sampled
def test_a_pull_and_a_tare_go_out_while_the_force_stands(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    client.pull(pulls=True)
    cycles(client)
    assert gateway.bank.command.control_word == 17 and client.enabled
    client.tare()
    client.force(13.0)
    cycles(client)
    assert 21 in [words[0] for words in gateway.words] and gateway.bank.command.force_setpoint_n == 13.0
    assert client.enabled and not client.ended and not gateway.exceptions


@pytest.mark.parametrize("language", ["rapid", "urscript"])
def test_a_force_that_another_master_holds_is_not_in_band_for_a_robot_whose_enable_was_refused(
    language: str, gateway: GatewayAtHand
) -> None:
    """Its program waited for that bit alone, and went to the part under the other one's force."""
    robot = CONTROLLERS[language](TEXTS[language], gateway)
    gateway.take_over_from_elsewhere()
    cycles(robot)
    robot.enable(12.0)
    assert not is_in_band(robot), "before its own enable is sent"
    cycles(robot)
    assert not is_in_band(robot) and "W210" in robot.text
    gateway.stop_from_elsewhere()
    robot.machine.start("fg_take_ownership") if language == "urscript" else robot.set(fgTake=True)
    cycles(robot)
    robot.enable(12.0)
    cycles(robot)
    assert is_in_band(robot) and gateway.bank.command.force_setpoint_n == 12.0


def is_in_band(robot: Any) -> bool:
    """What its program waits for behind an enable."""
    if isinstance(robot, Irc5):
        return bool(robot.get("fgInBand"))
    return bool(robot.machine.start("fg_wait_in_band", 0.1))


def test_a_force_that_another_master_holds_is_in_band_for_no_program(client: Any, gateway: GatewayAtHand) -> None:
    """A PLC program that waited for that bit alone went on to the part behind a refused enable."""
    if isinstance(client, Irc5 | UniversalRobot):
        pytest.skip("asked above, as its program asks")
    gateway.take_over_from_elsewhere()
    cycles(client)
    client.enable(12.0)
    cycles(client)
    assert "W210" in client.text
    assert client.in_band is False
    gateway.stop_from_elsewhere()
    cycles(client)
    client.enable(12.0)
    cycles(client)
    assert client.in_band is True and gateway.bank.command.force_setpoint_n == 12.0
