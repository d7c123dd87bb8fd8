"""The self-test of a robot: its end with the program that began it, and what its program asks for beside the exchange."""

from __future__ import annotations

import pytest

from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.scenes import TEXTS, command, commands, cycles
from tests.clients.self_tests.test_self_tests import BEGUN, OFF, begin


def test_a_self_test_ends_with_the_timer_of_an_irc5(gateway: GatewayAtHand) -> None:
    client = Irc5(TEXTS["rapid"], gateway)
    begin(client, gateway)
    client.machine.start("FgTimerStop")
    assert commands(gateway) == [BEGUN, OFF] and not gateway.is_testing


def test_a_program_of_an_irc5_that_shows_no_life_begins_no_self_test(gateway: GatewayAtHand) -> None:
    client = Irc5(TEXTS["rapid"], gateway)
    client.set(fgTested=True)  # of an earlier one
    client.serve(20, client.self_test)
    assert gateway.writes == [] and "fgAlive" in client.text and not client.found


@pytest.mark.parametrize("late", [1, 3, 5])
def test_a_self_test_right_behind_a_start_of_the_program_waits_for_its_timer(late: int, gateway: GatewayAtHand) -> None:
    client = Irc5(TEXTS["rapid"], gateway)
    pauses: list[bool] = []

    def go_on_from_a_breakpoint() -> None:
        pauses.append(gateway.is_testing)
        if len(pauses) == 30:
            client.self_test()
        if len(pauses) >= 30 + late:
            client.set(fgAlive=(client.get("fgAlive") + 1) % 1000)

    client.serve(45, go_on_from_a_breakpoint)
    assert not any(pauses[: 30 + late]) and gateway.is_testing and client.is_testing


def test_a_self_test_ends_with_the_program_of_an_irc5_that_began_it(gateway: GatewayAtHand) -> None:
    """A SemiStatic task goes on at a stop of T_ROB1."""
    client = Irc5(TEXTS["rapid"], gateway)
    alive: list[bool] = []

    def program() -> None:
        if len(alive) == 2:
            client.self_test()
        if len(alive) < 20:
            client.set(fgAlive=(client.get("fgAlive") + 1) % 1000)
        alive.append(gateway.is_testing)

    client.serve(40, program)
    assert alive[19] and not alive[-1]
    assert commands(gateway) == [BEGUN, OFF] and "T_ROB1 does not count fgAlive" in client.text
    assert not client.is_testing and not client.found


def test_a_robot_is_told_that_an_enable_beside_a_self_test_is_none(gateway: GatewayAtHand) -> None:
    """Asked for, running, and let go while its OFF is not answered yet."""
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    enable = lambda: robot.machine.start("fg_enable", 12.0)  # noqa: E731
    cycles(robot)
    robot.self_test()
    told = [enable()]
    cycles(robot)
    told.append(enable())
    robot.disable()
    told.append(enable())
    cycles(robot)
    told.append(enable())
    assert told == [False, False, False, True]


def test_an_enable_of_a_robot_while_its_self_test_is_on_its_way_goes_out_behind_off(gateway: GatewayAtHand) -> None:
    """The program has let go of the one and asks for the other before the first is answered."""
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    cycles(robot)
    answer = gateway.answer

    def change_of_mind(request: bytes) -> bytes:
        if request[0] == 23:
            gateway.answer = answer  # type: ignore[method-assign]
            robot.disable()
            robot.enable(12.0)
        return answer(request)

    gateway.answer = change_of_mind  # type: ignore[method-assign]
    robot.self_test()
    cycles(robot)
    assert commands(gateway) == [BEGUN, OFF, command(1, 1200)] and robot.enabled
