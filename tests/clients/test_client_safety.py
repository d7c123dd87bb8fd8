"""What no generated client may do to a force: begin it by itself, believe another one's answer, send one below 0."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.registers.words import ControlBit
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged
from tests.clients.programs.c_program import CProgram
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.scenes import TEXTS, command, commands, cycles

OWN_SOCKETS = ["rapid", "urscript", "python", "c"]
"""Languages whose client reads the header of an answer; the others leave it to a library."""


def test_a_reset_ends_the_enable_before_it(client: Any, gateway: GatewayAtHand) -> None:
    """A reset needs force 0; an enable that stood beside it would be a new rise behind it."""
    client.enable(12.0)
    cycles(client)
    client.reset()
    cycles(client)
    told = [words[0] for words in gateway.words]
    assert told[0] == 1 and told[1:] in ([2], [0, 2])  # a PLC's OFF goes ahead, alone
    assert not gateway.bank.command.control_word & 1 and not client.enabled


@pytest.mark.parametrize("counts", [29, 435])
def test_a_force_is_the_nearest_count(client: Any, gateway: GatewayAtHand, counts: int) -> None:
    """0.29 and 4.35 times 100 are a little less than 29 and 435: cut, a count would be missing."""
    client.enable(counts / 100.0)
    cycles(client)
    assert int(counts / 100.0 * 100.0) == counts - 1
    assert commands(gateway) == [command(1, counts)]


def test_a_force_below_0_is_not_sent(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(12.0)
    cycles(client)
    client.force(-1.0)
    cycles(client)
    assert commands(gateway) == [command(1, 1200)]
    assert "0.00 .. 327.67" in client.text


COUNTERS: dict[str, Any] = {
    "rapid": lambda client, number: client.set(nHeartbeat=number, nTransaction=number),
    "urscript": lambda client, number: client.set(fg_heartbeat=number, fg_transaction=number),
    "python": lambda client, number: vars(client.client).update(heartbeat=number, transaction=number),
}
"""Of the languages whose numbers have no width of 16 bits of their own."""


@pytest.mark.parametrize("language", COUNTERS)
def test_a_force_is_held_on_when_the_numbers_of_its_requests_have_gone_round(
    language: str, gateway: GatewayAtHand
) -> None:
    """At 20 ms a request they do so every 22 minutes: a robot that lost its gateway then would not be understood."""
    client = CONTROLLERS[language](TEXTS[language], gateway)
    client.enable(12.0)
    cycles(client)
    before = len(gateway.beats)
    COUNTERS[language](client, 0xFFFF - 3)
    cycles(client, 8)
    assert gateway.beats[before:] == [0xFFFD, 0xFFFE, 0xFFFF, 0, 1, 2, 3, 4]
    assert client.enabled and not client.ended and commands(gateway) == [command(1, 1200)]


@pytest.mark.parametrize("language", COUNTERS)
def test_a_heartbeat_that_leaves_out_the_last_number_goes_round(language: str, gateway: GatewayAtHand) -> None:
    """65535 stands in the gateway: what follows 65534 is 0, for no word holds 65536."""
    client = CONTROLLERS[language](TEXTS[language], gateway)
    gateway.answer(b"\x06\0\4\xff\xff")  # FC06 of the heartbeat, by an earlier program at this address
    cycles(client)
    COUNTERS[language](client, 0xFFFE)
    client.enable(12.0)
    cycles(client)
    assert client.enabled and gateway.beats[:3] == [0xFFFF, 0, 1]


@pytest.mark.parametrize(
    "place", [pytest.param(1, id="transaction"), pytest.param(2, id="protocol"), pytest.param(6, id="unit")]
)
@pytest.mark.parametrize("language", OWN_SOCKETS)
def test_an_answer_to_another_question_is_a_loss(language: str, place: int, gateway: GatewayAtHand) -> None:
    """A late one, or another unit's behind the same bridge: its status would be taken for this gateway's."""
    client = CONTROLLERS[language](TEXTS[language], gateway)
    cycles(client)
    assert not client.text
    ask = gateway.ask

    def alter(frame: bytes) -> bytes:
        answer = bytearray(ask(frame))
        answer[place] ^= 0x10
        return bytes(answer)

    gateway.ask = alter  # type: ignore[method-assign]
    client.cycle()
    assert "lost" in client.text


@pytest.mark.parametrize("more", [-2, 80])
@pytest.mark.parametrize("language", OWN_SOCKETS)
def test_an_answer_of_another_length_is_a_loss(language: str, more: int, gateway: GatewayAtHand) -> None:
    """Whole by its header, and one register short: the words behind it would be those of the answer before. A robot's list has
    no place for what is longer: its program would stop."""
    client = CONTROLLERS[language](TEXTS[language], gateway)
    cycles(client)
    assert not client.text
    ask = gateway.ask

    def cut(frame: bytes) -> bytes:
        whole = ask(frame)
        answer = bytearray((whole + bytes(max(more, 0)))[: len(whole) + more])
        answer[5], answer[8] = answer[5] + more, answer[8] + more
        return bytes(answer)

    gateway.ask = cut  # type: ignore[method-assign]
    client.cycle()
    assert "lost" in client.text


def test_a_robot_that_starts_again_remembers_no_force(gateway: GatewayAtHand) -> None:
    """PERS data keep their values over a restart of the controller, and over a stop of the program."""
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    client.machine.start("FgInit")
    cycles(client)
    assert gateway.writes == [] and not client.enabled


def test_a_robot_that_stops_its_timer_lets_go(gateway: GatewayAtHand) -> None:
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    cycles(client)
    client.machine.start("FgTimerStop")
    assert commands(gateway) == [command(1, 1200), command(0, 0)]


def test_a_robot_that_stops_its_timer_behind_a_loss_lets_go_at_once(gateway: GatewayAtHand) -> None:
    """It waited for no more back-off, for there is no cycle behind this one: a gateway without a lease went on pressing."""
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    cycles(client)
    gateway.is_cut = True
    cycles(client)
    gateway.is_cut = False
    client.machine.start("FgTimerStop")
    assert commands(gateway) == [command(1, 1200), command(0, 0)]


def test_a_robot_that_stops_its_timer_over_a_connection_that_is_dead_lets_go_over_another(
    gateway: GatewayAtHand,
) -> None:
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    cycles(client)
    ask, lost = gateway.ask, list[bytes]()

    def lose_one(frame: bytes) -> bytes:
        if lost:
            return ask(frame)
        lost.append(frame)
        raise Unplugged

    gateway.ask = lose_one  # type: ignore[method-assign]
    client.machine.start("FgTimerStop")
    assert lost and commands(gateway) == [command(1, 1200), command(0, 0)]


@pytest.mark.parametrize("stops", [True, False])
def test_a_robot_that_could_not_let_go_does_so_when_its_timer_starts_again(stops: bool, gateway: GatewayAtHand) -> None:
    """Behind a loss; or a main routine that begins again, and starts the timer while the force is on."""
    client = Irc5(TEXTS["rapid"], gateway)
    client.machine.start("FgTimerStart")
    client.enable(12.0)
    cycles(client)
    if stops:
        gateway.is_cut = True
        client.machine.start("FgTimerStop")
        gateway.is_cut = False
    client.machine.start("FgTimerStart")
    cycles(client)
    assert commands(gateway) == [command(1, 1200), command(0, 0)]


@pytest.mark.parametrize(("counts", "word"), [(-200.4, 65336), (-200.6, 65335), (200.4, 200), (200.6, 201)])
def test_a_word_that_a_robot_sets_is_the_nearest_count(counts: float, word: int, gateway: GatewayAtHand) -> None:
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    place = robot.get("FG_C_TILT_ANGLE")
    assert robot.machine.start("fg_set_command", place, counts)
    robot.enable(12.0)
    cycles(robot)
    assert gateway.words[-1][place] == word


def take(client: Any) -> None:
    """Have a client ask for the setpoint that another master owns."""
    if isinstance(client, Plc):
        client.inputs[client.NAMES["take"]] = True
    elif isinstance(client, Irc5):
        client.set(fgTake=True)
    elif isinstance(client, UniversalRobot):
        client.machine.start("fg_take_ownership")
    elif isinstance(client, CProgram):
        client._library.fg_take_ownership(client._client)
    else:
        client.client.take_ownership()


def test_who_takes_over_asks_for_that_and_for_no_zero_of_the_cell(client: Any, gateway: GatewayAtHand) -> None:
    """A tare under another master's force would make it the zero of its own."""
    gateway.take_over_from_elsewhere()
    cycles(client)
    take(client)
    cycles(client)
    assert [words[0] for words in gateway.words] == [int(ControlBit.TAKE_OWNERSHIP)]
