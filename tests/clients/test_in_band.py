"""In band is said of the force that is asked for now: not of the one before, nor of one that was refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gateway.clients import render_client
from gateway.registers import Command, Status
from gateway.registers.words import ControlBit, State, StatusBit
from tests.calibrations.coefficients import calibration
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.losses.test_edges_and_losses import control_word_of
from tests.clients.one_language.test_two_tasks import every_place
from tests.clients.programs.c_program import CProgram
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.programs.python_program import PythonProgram
from tests.clients.refusals.test_guests import set_ramp
from tests.clients.scenes import TEXTS, WHERE, cycles
from tests.clients.texts.test_controller_rules import own_map


def ramp_above(gateway: GatewayAtHand, force_n: float) -> None:
    """Let each force above this one, and each pull, be on its way for ever, instead of in band at once."""

    def obey(command: Command) -> None:
        held = StatusBit.ENABLED | StatusBit.READY
        if command.force_setpoint_n <= force_n and ControlBit.VALVE_PULL not in command.control_word:
            held |= StatusBit.IN_BAND
        is_on = ControlBit.ENABLE in command.control_word
        gateway.bank.publish(
            Status(
                state=State.RAMPING if is_on else State.OFF,
                status_word=int(held) if is_on else 0,
                force_requested_n=command.force_requested_n,
                heartbeat_echo=command.heartbeat,
            )
        )

    gateway.bank.on_command = obey


def in_band(client: Any) -> bool:
    if isinstance(client, Irc5):
        return bool(client.get("fgInBand"))
    return bool(client.get("fg_in_band") if isinstance(client, UniversalRobot) else client.in_band)


def ask_for(client: Any, force_n: float, *, pulls: bool = False) -> None:
    """Ask for a new force as the head of the client's text says."""
    client.force(force_n)
    client.pull(pulls=pulls)
    if isinstance(client, Irc5):
        client.set(fgInBand=False)


def seen_in_band(client: Any, count: int = 6) -> list[bool]:
    """What a program sees that looks as often as it can."""
    seen = []
    if not isinstance(client, Plc):  # whose program sees nothing between an input and the scan
        seen.append(in_band(client))
    for _ in range(count * (12 if isinstance(client, Plc) else 1)):
        client.scan() if isinstance(client, Plc) else client.cycle()
        seen.append(in_band(client))
    return seen


def test_a_new_force_is_not_in_band_because_the_old_one_was(client: Any, gateway: GatewayAtHand) -> None:
    """A program that asks for more and waits for that bit went to the part at once: it had to wait 0.2 s first."""
    ramp_above(gateway, 12.0)
    client.enable(12.0)
    cycles(client)
    assert in_band(client)
    ask_for(client, 30.0)
    assert not any(seen_in_band(client)) and gateway.bank.command.force_setpoint_n == 30.0
    ask_for(client, 10.0)
    assert seen_in_band(client)[-1]


def test_an_enable_is_not_in_band_because_the_one_before_was(client: Any, gateway: GatewayAtHand) -> None:
    """Off and on again between two exchanges."""
    ramp_above(gateway, 12.0)
    client.enable(12.0)
    cycles(client)
    client.disable()
    if isinstance(client, Plc):
        client.scan()
    client.enable(30.0)
    if isinstance(client, Irc5):
        client.set(fgInBand=False)
    assert not any(seen_in_band(client)) and gateway.bank.command.force_setpoint_n == 30.0


@pytest.mark.parametrize("pulls", [False, True])
@pytest.mark.parametrize("language", ["rapid", "urscript"])
def test_a_force_or_pull_beside_an_exchange_is_not_in_band_because_the_last_one_was(language: str, pulls: bool) -> None:
    """Whatever the other task is doing at that moment."""
    force_n = 12.0 if pulls else 30.0
    seen: list[bool] = []

    def prepare(client: Any, gateway: GatewayAtHand) -> None:
        ramp_above(gateway, 12.0)
        client.enable(12.0)
        cycles(client, 2)

    acts = [lambda client: ask_for(client, force_n, pulls=pulls), *[lambda client: seen.append(in_band(client))] * 400]
    for client, gateway in every_place(language, prepare, acts):
        assert not in_band(client) and gateway.bank.command.force_setpoint_n == force_n
        assert (ControlBit.VALVE_PULL in gateway.bank.command.control_word) is pulls
    assert len(seen) > 400 and not any(seen)


def test_a_force_that_was_refused_is_not_in_band_because_the_last_one_that_was_taken_is(
    client: Any, gateway: GatewayAtHand
) -> None:
    """A robot's program that asked for 65 N of a rig of 60 N, and waited, ground on with 12 N."""
    client.enable(12.0)
    cycles(client)
    ask_for(client, 65.0)
    told = seen_in_band(client, 8)
    assert "W204" in client.text and gateway.bank.command.force_setpoint_n == 12.0
    if isinstance(client, PythonProgram | CProgram):
        pytest.skip("exchange() itself says that it was refused")
    assert not any(told)
    if isinstance(client, UniversalRobot):
        assert not client.machine.start("fg_wait_in_band", 0.1)
    ask_for(client, 12.0)
    cycles(client)
    assert in_band(client) and client.enabled
    ask_for(client, 400.0)
    assert not any(seen_in_band(client)) and "327.67" in client.text
    ask_for(client, 13.0)
    cycles(client)
    assert in_band(client) and gateway.bank.command.force_setpoint_n == 13.0


def test_a_push_is_not_in_band_for_who_asked_for_a_pull_that_was_refused(client: Any, gateway: GatewayAtHand) -> None:
    """W307, the valve cannot follow: the program waited for that bit, and lifted a part that was pushed."""
    if isinstance(client, PythonProgram | CProgram):
        pytest.skip("exchange() itself says that it was refused")
    client.enable(12.0)
    cycles(client)
    answer = gateway.answer
    gateway.answer = lambda request: (  # type: ignore[method-assign]
        bytes((request[0] | 0x80, 3)) if control_word_of(request) & 0x10 else answer(request)
    )
    client.pull(pulls=True)
    if isinstance(client, Irc5):
        client.set(fgInBand=False)
    assert not any(seen_in_band(client, 8)) and client.enabled
    client.pull(pulls=False)
    ask_for(client, 13.0)
    cycles(client)
    assert in_band(client) and gateway.bank.command.force_setpoint_n == 13.0


def test_a_force_that_another_master_takes_over_is_in_band_for_nobody_else(client: Any, gateway: GatewayAtHand) -> None:
    """The refused heartbeat was explained by a status that is the other one's, and its band stood for a cycle."""
    client.enable(12.0)
    cycles(client)
    assert in_band(client)
    gateway.take_over_from_elsewhere()
    if isinstance(client, Plc):
        cycles(client)
    else:
        client.cycle()
    assert client.ended and not any([in_band(client), *seen_in_band(client, 2)])


def test_a_force_that_another_program_of_this_address_commands_is_not_in_band(
    client: Any, gateway: GatewayAtHand
) -> None:
    """Both own the setpoint, for an owner is an address: the tool held 7 N, and who had asked for 12 N read "in band"."""
    client.enable(12.0)
    cycles(client)
    assert in_band(client)
    gateway.write_beside_the_client(7.0)
    assert not any(seen_in_band(client)[1 if not isinstance(client, Plc) else 12 :])
    assert client.enabled and gateway.bank.command.force_setpoint_n == 7.0
    ask_for(client, 13.0)
    cycles(client)
    assert in_band(client) and gateway.bank.command.force_setpoint_n == 13.0


def test_a_force_that_a_calibration_lowered_is_in_band_for_who_asked_for_more(
    client: Any, gateway: GatewayAtHand
) -> None:
    """W314: what was asked for stands in force_requested still, so nobody waits for ever."""
    client.enable(12.0)
    cycles(client)
    gateway.bank.set_active_model(calibration(force_limits_n=(0.0, 9.0)))
    cycles(client)
    assert in_band(client) and gateway.bank.command.force_setpoint_n == 9.0


def test_a_force_that_the_status_shows_more_coarsely_is_in_band(language: str, tmp_path: Path) -> None:
    """A map of one's own may show tenths of a newton of a force that is asked for in hundredths."""
    shown = "name: force_requested, address: 103, type: int16, scale: 0."
    coarse = own_map(tmp_path, f"{shown}01", f"{shown}1")
    gateway = GatewayAtHand(coarse)
    text = render_client(coarse, "st" if language in ("twincat", "codesys") else language, WHERE)
    client = CONTROLLERS[language](text, gateway)
    client.enable(12.04)
    cycles(client)
    assert in_band(client)
    gateway.write_beside_the_client(12.2)
    cycles(client, 12)
    assert not in_band(client)


def test_a_command_with_another_word_is_in_band_once_it_is_taken(client: Any, gateway: GatewayAtHand) -> None:
    """Another voltage, or a narrower band: in band was what stood there before."""
    if isinstance(client, Irc5):
        pytest.skip("its program sets fgInBand FALSE itself")
    client.enable(12.0)
    cycles(client)
    assert in_band(client)
    set_ramp(client)
    if isinstance(client, Plc):
        client.scan()
    assert not in_band(client)
    cycles(client)
    assert in_band(client) and gateway.bank.command.force_ramp_n_per_s == 50.0


COMMAND_OF = {"rapid": "fgCommand", "urscript": "fg_command"}


def set_voltage(client: Any, millivolts: int) -> None:
    """voltage_setpoint, as the head of the client's text says."""
    if isinstance(client, Plc):
        client.structures[client.NAMES["command"]]["VOLTAGE_SETPOINT"] = float(millivolts)
        return
    place = client.get("FG_C_VOLTAGE_SETPOINT")
    if isinstance(client, Irc5):
        client.get("fgCommand")[place - 1] = millivolts
        client.set(fgInBand=False)
    else:
        client.machine.start("fg_set_command", place, millivolts)


@pytest.mark.sampled
@pytest.mark.parametrize("language", ["scl", "twincat", "codesys", "rapid", "urscript"])
@pytest.mark.parametrize("wrong", [20000, 70000])
def test_a_word_that_was_refused_leaves_nothing_in_band_until_another_one_is_taken(
    language: str, wrong: int, gateway: GatewayAtHand
) -> None:
    """A program that asked for a voltage, and waited for that bit, went on with the one before. 70000 has no 16 bits."""
    client: Any = CONTROLLERS[language](TEXTS[language], gateway)
    client.enable(12.0)
    cycles(client)
    set_voltage(client, wrong)
    assert not any(seen_in_band(client, 8)) and client.enabled
    assert ("W204" if isinstance(client, Plc) or wrong == 20000 else "-32768 .. 65535") in client.text
    if isinstance(client, UniversalRobot):
        assert not client.machine.start("fg_wait_in_band", 0.1)
    set_voltage(client, 3000)
    cycles(client)
    assert in_band(client) and gateway.bank.command.voltage_setpoint_v == pytest.approx(3.0)


@pytest.mark.parametrize("language", ["rapid", "urscript"])
def test_a_word_without_16_bits_beside_an_enable_is_told_and_not_in_band(language: str, gateway: GatewayAtHand) -> None:
    """The enable went out with the word of before, and cleared the text that said so. A disable is a new beginning."""
    client: Any = CONTROLLERS[language](TEXTS[language], gateway)
    cycles(client)
    set_voltage(client, 70000)
    client.enable(12.0)
    assert not any(seen_in_band(client, 8)) and client.enabled and "a word of" in client.text
    client.disable()
    cycles(client)
    client.enable(12.0)
    cycles(client)
    assert in_band(client)


@pytest.mark.parametrize("language", ["rapid", "urscript"])
def test_a_new_word_beside_an_exchange_is_not_in_band_because_the_old_one_was(language: str) -> None:
    """Whatever the other task is doing at that moment."""
    seen: list[bool] = []

    def look(client: Any) -> None:
        is_new = client.gateway.bank.command.voltage_setpoint_v == 3.0
        seen.append(in_band(client) and not is_new and 3000 in client.get(COMMAND_OF[language]))

    def prepare(client: Any, gateway: GatewayAtHand) -> None:
        client.enable(12.0)
        cycles(client, 2)
        answer = gateway.answer
        gateway.answer = lambda request: look(client) or answer(request)  # type: ignore[method-assign, func-returns-value]

    acts = [lambda client: set_voltage(client, 3000), *[look] * 400]
    for client, gateway in every_place(language, prepare, acts):
        assert in_band(client) and gateway.bank.command.voltage_setpoint_v == 3.0
    assert len(seen) > 100 and not any(seen)
