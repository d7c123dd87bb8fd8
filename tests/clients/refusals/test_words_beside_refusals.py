"""The other words of the command (ramp, mode, voltage ...) beside an enable that is refused: they were not what was wrong."""

from __future__ import annotations

import ctypes
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.c_program import OK, CProgram
from tests.clients.programs.python_program import PythonProgram
from tests.clients.refusals.test_guests import set_ramp
from tests.clients.scenes import command, cycles
from tests.clients.test_in_band import set_voltage

VOLTAGE, TOO_MUCH_MV = 5, 20000


@pytest.mark.sampled
def test_the_words_beside_a_refused_enable_stay_as_they_were_set(client: Any, gateway: GatewayAtHand) -> None:
    """A program sets its ramp once, and its enable comes before the reset: the next one pressed with the rig's own ramp."""
    cycles(client)
    gateway.fail(FaultCode.OVER_FORCE)
    cycles(client)
    set_ramp(client)
    client.enable(12.0)
    cycles(client)
    assert not client.enabled and len(gateway.exceptions) == 1
    client.disable()
    client.reset()
    cycles(client)
    client.enable(12.0)
    cycles(client)
    found = gateway.bank.command
    assert client.enabled and (found.force_setpoint_n, found.force_ramp_n_per_s) == (12.0, 50.0)


def set_voltage_of(client: Any, millivolts: int) -> None:
    if isinstance(client, CProgram):
        given = ctypes.c_float(millivolts), ctypes.c_float(1.0)
        assert client._library.fg_set(client._client, VOLTAGE, *given) == OK
    elif isinstance(client, PythonProgram):
        client.client.want[VOLTAGE] = millivolts  # set() itself knows what the map allows
    else:
        set_voltage(client, millivolts)


@pytest.mark.sampled
def test_a_word_that_is_wrong_is_not_asked_for_without_an_end(client: Any, gateway: GatewayAtHand) -> None:
    """Once beside the enable, once alone."""
    cycles(client)
    set_voltage_of(client, TOO_MUCH_MV)
    client.enable(12.0)
    cycles(client, 10)
    assert 1 <= len(gateway.exceptions) <= 2 and not client.enabled and "W204" in client.text
    assert gateway.bank.command.voltage_setpoint_v == 0.0
    set_voltage_of(client, 3000)
    client.disable()
    cycles(client)
    client.enable(12.0)
    cycles(client)
    assert client.enabled and gateway.bank.command.voltage_setpoint_v == 3.0
    assert (*gateway.words[-1][:4], *gateway.words[-1][6:]) == (*command(1, 1200)[:4], *command(1, 1200)[5:])
