"""A gateway at hand, and each controller with its generated client."""

from typing import Any

import pytest

from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.c_program import CProgram
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.s7 import S7
from tests.clients.programs.controllers.structured_text import Codesys, TwinCat
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.programs.python_program import PythonProgram
from tests.clients.scenes import MAP, TEXTS

CONTROLLERS: dict[str, Any] = {
    "rapid": Irc5,
    "scl": S7,
    "urscript": UniversalRobot,
    "twincat": TwinCat,
    "codesys": Codesys,
    "python": PythonProgram,
    "c": CProgram,
}


@pytest.fixture(autouse=True)
def scan_finely_throughout_in_the_long_run(budget: int, monkeypatch: pytest.MonkeyPatch) -> None:
    if budget > 1:
        monkeypatch.setattr(Plc, "WAIT_CYCLE_S", Plc.CYCLE_S)


@pytest.fixture(params=CONTROLLERS)
def language(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def gateway() -> GatewayAtHand:
    return GatewayAtHand(MAP)


@pytest.fixture
def client(language: str, gateway: GatewayAtHand) -> Any:
    return CONTROLLERS[language](TEXTS[language], gateway)
