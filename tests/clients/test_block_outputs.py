"""What a block or module shows its program: nothing of before a loss or a start."""

from __future__ import annotations

from typing import Any

import pytest

from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers import Irc5, Plc, UniversalRobot
from tests.clients.scenes import TEXTS, cycles

BLOCKS = ("scl", "twincat", "codesys")


def shown(client: Any, name: str) -> Any:
    """A value of the status, by the register's name."""
    if isinstance(client, Plc):
        return client.machine.member(client.output("status"), name)
    place = client.get(f"FG_S_{name.upper()}")
    return client.get("fgStatus")[place - 1] if isinstance(client, Irc5) else client.get("fg_status")[place]


@pytest.mark.parametrize("language", [*BLOCKS, "rapid", "urscript"])
def test_behind_a_loss_no_word_of_the_status_says_that_force_is_held(language: str, gateway: GatewayAtHand) -> None:
    """C shows zeros and no force then, Python None: here a panel that reads state or contact showed 'holding 11.5 N'."""
    client: Any = CONTROLLERS[language](TEXTS[language], gateway)
    client.enable(12.0)
    cycles(client)
    assert (shown(client, "status_word"), shown(client, "state")) == (11, 3)
    gateway.is_cut = True
    client.cycle(1.5)
    assert (shown(client, "status_word"), shown(client, "state")) == (0, 0)
    if isinstance(client, UniversalRobot):
        assert shown(client, "force_measured") == 0x8000 and client.get("fg_force_measured") == pytest.approx(9e9)
    else:
        assert shown(client, "force_measured") == pytest.approx(9e9)
    if isinstance(client, Plc):
        assert not any(shown(client, name) for name in ("contact", "fault", "warning"))


def test_a_module_of_rapid_that_starts_again_shows_nothing_of_its_last_run(gateway: GatewayAtHand) -> None:
    """PERS data outlast a restart of the controller: in band, before the first exchange, was the force of the day before."""
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    cycles(client)
    names = ("fgEnabled", "fgReady", "fgInBand", "fgConnected")
    assert all(client.get(name) for name in names) and shown(client, "state") == 3
    client.machine.start("FgInit")
    assert not any(client.get(name) for name in names)
    assert (shown(client, "state"), shown(client, "force_measured")) == (0, pytest.approx(9e9))
