"""The program and the exchange run side by side, on IRC5 and Universal Robots: what one sets, the other does not lose."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers.words import SelfTestResult
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.losses.test_edges_and_losses import TARE
from tests.clients.programs.syntax.parser import Node
from tests.clients.refusals.test_disables_beside_refusals import refuse_tares
from tests.clients.scenes import MAP, TEXTS, cycles

RESET = 2
ENABLING: dict[str, list[Callable[[Any], object]]] = {
    "rapid": [lambda client: client.set(fgForce=12.0), lambda client: client.set(fgEnable=True)],
    "urscript": [lambda client: client.enable(12.0)],
}
"""What the program does, one thing at a time: RAPID sets two data."""
EVERY = 3
"""Of so many places one is tried in the push gate."""


@pytest.fixture(autouse=True)
def try_each_place_in_the_long_run(budget: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{__name__}.EVERY", 1 if budget > 1 else EVERY)


class Switches:
    """Lets the other task do its next thing at the place-th switch of tasks, and each further one `apart` later."""

    def __init__(self, client: Any, acts: list[Callable[[Any], object]], place: int, apart: int = 1) -> None:
        self.client, self.acts = client, acts
        self.at = {place + k * apart: act for k, act in enumerate(acts)}
        self.count, self.is_busy, self.met = 0, False, Counter[int]()
        client.machine.switch = self.switch

    def switch(self, statement: Node) -> None:
        self.met[id(statement)] += 1
        if self.is_busy or self.met[id(statement)] > 2:  # a loop's later turns show nothing new
            return
        self.count += 1
        if act := self.at.pop(self.count, None):
            self.is_busy = True
            steps = self.client.machine.steps
            act(self.client)
            self.client.machine.steps, self.is_busy = steps, False

    def end(self) -> None:
        """Do now what was not done yet."""
        self.client.machine.switch = None
        for act in self.at.values():
            act(self.client)


def every_place(
    language: str, prepare: Callable[[Any, GatewayAtHand], object], acts: list[Callable[[Any], object]], apart: int = 1
) -> Iterator[tuple[Any, GatewayAtHand]]:
    """Run one cycle behind `prepare`, the program's acts at each of its places, and three cycles more."""
    place, last = 1, 1
    while place <= last:
        gateway = GatewayAtHand(MAP)
        client = CONTROLLERS[language](TEXTS[language], gateway)
        prepare(client, gateway)
        switches = Switches(client, acts, place, apart)
        client.cycle(5.0)
        last = switches.count
        switches.end()
        gateway.is_cut = False
        for _ in range(3):
            client.cycle(5.0)
        yield client, gateway
        place += EVERY


def tare_that_is_refused(client: Any, gateway: GatewayAtHand) -> None:
    refuse_tares(gateway)
    client.tare()


def nobody_there(_client: Any, gateway: GatewayAtHand) -> None:
    gateway.is_cut = True


def stopped_by_another(client: Any, gateway: GatewayAtHand) -> None:
    client.enable(7.0)
    cycles(client, 2)
    gateway.stop_from_elsewhere()


@pytest.mark.sampled
@pytest.mark.parametrize(("language", "apart"), [("rapid", 1), ("rapid", 4), ("urscript", 1)])
@pytest.mark.parametrize("prepare", [tare_that_is_refused, nobody_there, stopped_by_another])
def test_an_enable_beside_an_exchange_holds_its_own_force_or_none(language: str, prepare: Any, apart: int) -> None:
    """In band at 0 N: the program would grind without force."""
    for client, gateway in every_place(language, prepare, ENABLING[language], apart):
        found = gateway.bank.command
        assert (int(found.control_word), found.force_setpoint_n) in ((1, 12.0), (0, 0.0))
        assert found.control_word or client.ended or "refused" in client.text


@pytest.mark.parametrize("language", ["rapid", "urscript"])
def test_an_edge_that_is_set_beside_another_goes_out_as_well_and_once(language: str) -> None:
    def prepare(client: Any, gateway: GatewayAtHand) -> None:
        cycles(client, 2)
        gateway.fail(FaultCode.OVER_FORCE)
        client.tare()

    for _, gateway in every_place(language, prepare, [lambda client: client.reset()]):
        edges = [words[0] for words in gateway.words if words[0]]
        assert sorted(edges) in ([RESET, TARE], [RESET | TARE]), edges


def test_a_force_that_is_set_beside_a_refusal_of_another_is_the_one_that_holds() -> None:
    """Too much was asked for, the program lowers it at once: the last accepted force must not come back over that."""

    def prepare(client: Any, gateway: GatewayAtHand) -> None:
        client.enable(7.0)
        cycles(client, 2)
        answer = gateway.answer

        def refuse(request: bytes) -> bytes:
            too_much = request[0] == 23 and request[12:14] == (4000).to_bytes(2, "big")
            return bytes((request[0] | 0x80, 3)) if too_much else answer(request)

        gateway.answer = refuse  # type: ignore[method-assign]
        client.force(40.0)

    for _, gateway in every_place("urscript", prepare, [lambda client: client.force(5.0)]):
        assert gateway.bank.command.force_setpoint_n == 5.0


@pytest.mark.sampled
@pytest.mark.parametrize("force_n", [9.0, 7.0])
@pytest.mark.parametrize("language", ["rapid", "urscript"])
def test_a_disable_at_any_place_of_an_exchange_takes_the_force_off(language: str, force_n: float) -> None:
    """Beside a heartbeat, too: it was taken for sent with that, and the force ended by its lease alone."""

    def prepare(client: Any, _gateway: GatewayAtHand) -> None:
        client.enable(7.0)
        cycles(client, 2)
        client.force(force_n)

    for client, gateway in every_place(language, prepare, [lambda client: client.disable()]):
        assert gateway.bank.command.control_word == 0 and not client.enabled and not client.ended


@pytest.mark.parametrize("act", ["tare", "enable", "self-test"])
def test_what_a_robot_asks_for_while_its_gateway_is_being_lost_is_not_done_later(act: str) -> None:
    """Set behind the place where a loss forgets the edges, and before it says that it is one, a tare went out seconds later."""
    acts = {"tare": lambda client: client.tare(), "self-test": lambda client: client.self_test()}

    def prepare(client: Any, gateway: GatewayAtHand) -> None:
        cycles(client, 2)
        gateway.is_cut = True

    for client, gateway in every_place("urscript", prepare, [acts.get(act, lambda client: client.enable(12.0))]):
        asked = [words[0] for words in gateway.words if words[0]]
        assert asked == [] and not client.get("fg_is_on"), client.text


@pytest.mark.sampled
@pytest.mark.parametrize("language", ["rapid", "urscript"])
@pytest.mark.parametrize("prepare", [tare_that_is_refused, nobody_there, stopped_by_another])
def test_a_self_test_asked_for_beside_an_exchange_is_begun_or_dropped(language: str, prepare: Any) -> None:
    for client, gateway in every_place(language, prepare, [lambda client: client.self_test()]):
        assert gateway.is_testing == client.is_testing == (gateway.bank.command.control_word == 64), client.text
        assert gateway.is_testing or not client.found


@pytest.mark.sampled
@pytest.mark.parametrize("language", ["rapid", "urscript"])
@pytest.mark.parametrize("has_ended", [False, True])
def test_a_self_test_that_is_let_go_at_any_place_of_an_exchange_ends(language: str, has_ended: bool) -> None:
    def prepare(client: Any, gateway: GatewayAtHand) -> None:
        cycles(client)
        client.self_test()
        cycles(client, 2)
        if has_ended:
            gateway.end_self_test(SelfTestResult.PASSED)

    for client, gateway in every_place(language, prepare, [lambda client: client.end_self_test()]):
        assert gateway.bank.command.control_word == 0 and not client.is_testing and not client.ended
        assert client.found.get("result", "passed") == "passed" and not gateway.exceptions


@pytest.mark.parametrize("late", [1, 3, 5])
def test_an_enable_right_behind_a_start_of_the_program_waits_for_its_timer(late: int, gateway: GatewayAtHand) -> None:
    """A breakpoint before it, or a stop: the timer interrupt of T_ROB1 comes up to 0.1 s behind that line, which was told
    'T_ROB1 does not count fgAlive'. late: pauses of T_FORCE until it comes."""
    client = CONTROLLERS["rapid"](TEXTS["rapid"], gateway)
    pauses: list[int] = []

    def go_on_from_a_breakpoint() -> None:
        pauses.append(int(gateway.bank.command.control_word))
        if len(pauses) == 30:
            client.enable(12.0)
        if len(pauses) >= 30 + late:
            client.set(fgAlive=(client.get("fgAlive") + 1) % 1000)

    client.serve(45, go_on_from_a_breakpoint)
    assert not any(pauses[: 30 + late]), "nothing before the program shows that it runs"
    assert client.enabled and not client.ended and gateway.bank.command.force_setpoint_n == 12.0


def test_a_program_that_stands_right_behind_its_enable_begins_nothing_and_one_that_stands_longer_ends(
    gateway: GatewayAtHand,
) -> None:
    client = CONTROLLERS["rapid"](TEXTS["rapid"], gateway)
    held: list[int] = []
    told: list[bool] = []

    def stand_but_from_the_60th_to_the_80th_pause() -> None:
        held.append(int(gateway.bank.command.control_word))
        told.append(client.ended and not client.get("fgEnable") and "fgAlive" in client.text)
        if len(held) in (20, 60):
            client.enable(12.0)
        if 60 <= len(held) < 80 or len(held) > 110:
            client.set(fgAlive=(client.get("fgAlive") + 1) % 1000)

    client.serve(130, stand_but_from_the_60th_to_the_80th_pause)
    assert told[58] and told[-1]
    assert not any(held[:60]) and all(held[62:80]) and not any(held[95:]), held


@pytest.mark.parametrize("answer_s", [0.0, 0.05, 0.2])
def test_the_force_of_a_program_that_stands_ends_as_soon_at_a_gateway_that_answers_late(
    answer_s: float, gateway: GatewayAtHand
) -> None:
    """The task counted its cycles, each as long as an answer: of 0.2 s each the force lasted for 3.2 s behind the stop."""
    client = CONTROLLERS["rapid"](TEXTS["rapid"], gateway)
    answer, ends_s = gateway.answer, list[float]()

    def answer_late(request: bytes) -> bytes:
        client.now_s += answer_s
        return answer(request)

    gateway.answer = answer_late  # type: ignore[method-assign]

    def program_until_2_s() -> None:
        if client.now_s < 2.0:
            client.set(fgAlive=int(10 * client.now_s))
            client.enable(12.0)
        elif not gateway.bank.command.control_word:
            ends_s.append(client.now_s - 2.0)

    client.serve(100, program_until_2_s)
    assert 0.4 < ends_s[0] < 0.6 + 3 * answer_s and client.ended and "fgAlive" in client.text


WORDS = [(before, given) for before in (900, 900.4, 70000) for given in (600, 600.4, 70000)]
EACH_ONCE = [(900, 70000), (900.4, 600.4), (70000, 600)]
"""A word that is whole, one that is rounded and one that is refused, on either side: in the push gate each beside one other."""


@pytest.mark.parametrize(
    ("before", "given"), [pytest.param(*pair, marks=[] if pair in EACH_ONCE else pytest.mark.long) for pair in WORDS]
)
def test_a_word_that_is_set_beside_an_exchange_is_the_one_that_is_sent_and_costs_no_force(
    before: float, given: float
) -> None:
    """A tilt angle of 123.4 counts, set ten times a second: one that came between the look at the words and their copy ended
    the connection, and each one after it, for the OFF went out with that word. One that was set beside the rounding of the
    last one was lost, and in band was said of that."""

    def set_word(client: Any, counts: float) -> None:
        client.get("fgCommand")[client.get("FG_C_TILT_ANGLE") - 1] = counts

    def prepare(client: Any, _gateway: GatewayAtHand) -> None:
        client.enable(12.0)
        cycles(client, 2)
        set_word(client, 300)
        cycles(client, 2)
        set_word(client, before)

    lost = 0
    for client, gateway in every_place("rapid", prepare, [lambda client: set_word(client, given)]):
        assert client.enabled and not client.ended and not client.said, client.text
        is_taken = gateway.bank.command.tilt_angle_rad == pytest.approx(math.radians(60))
        assert is_taken or (max(before, given) > 65535 and "allowed -32768 .. 65535" in client.text)
        assert client.get("fgInBand") is is_taken
        lost += not is_taken
    assert lost <= 1 or given > 65535, "but between the look whether it still stands and what is put in its place"
