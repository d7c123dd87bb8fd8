"""Each law of drawn programs is broken by one frame at least; what goes on, and what has just hung, breaks none."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.registers.words import State
from tests.control.bench import settings
from tests.service.running_rig.masters.drawn.laws import DOWN_S, LEASE_S, Laws
from tests.service.running_rig.simulated_rig import ENABLE, OTHER, TARE, TICK_S

HOST = OTHER.host


class Told(Laws):
    """Laws of a rig and of one program that are only what is told of them."""

    def __init__(self, state: State = State.OFF, *, is_live: bool = False, word: int = ENABLE, **program: Any) -> None:
        super().__init__()
        self.control = settings(lease_s=LEASE_S)
        self.now_s = 100.0
        self.decision = SimpleNamespace(state=state, force_accepted_n=0.0)
        self.bank = SimpleNamespace(owner=None, command=SimpleNamespace(peer=HOST, control_word=word))
        self.rig: Any = SimpleNamespace(
            now=lambda: self.now_s, bank=self.bank, loop=SimpleNamespace(decision=self.decision),
            controller=SimpleNamespace(active_run=SimpleNamespace(is_local=False)),
        )  # fmt: skip
        known = {
            "period": 2,
            "cycles": 9,
            "stale": 0,
            "held": 0,
            "pools": False,
            "identity": HOST,
            "asks": (word, 1200),
        }
        self.program: Any = SimpleNamespace(
            **known | program, is_live=is_live, note_beat=lambda _: False, peer=lambda: OTHER
        )
        self.programs, self.moved_s = [self.program], {HOST: 0.0}

    def sends(self, state: State | None = None, accepted_n: float = 0.0, owner: str | None = None) -> None:
        """One frame, and what comes of it."""

        def write(*_: Any) -> None:
            self.decision.state = self.decision.state if state is None else state
            self.decision.force_accepted_n, self.bank.owner = accepted_n, owner

        self.program.write = write
        self.send(self.program, lambda *_: None)

    def presses(self, seconds: float, owner: str | None) -> None:
        """For so long, while nothing moves."""
        self.bank.owner, self.decision.state = owner, State.HOLDING
        self.judge_presence()
        self.now_s += seconds
        self.judge_presence()


def tares_twice(told: Told) -> None:
    told.sends()
    told.sends()


def taken_over() -> None:
    told = Told(State.HOLDING)
    told.bank.owner = "10.0.0.9"
    told.sends(owner=HOST)


LAWS: list[tuple[str, Callable[[], object]]] = [
    ("hung begins: ", lambda: Told().sends(State.RAMPING)),
    ("hung begins a run: ", lambda: Told(State.READY).sends(State.CALIBRATING)),
    ("hung raises: ", lambda: Told(State.HOLDING).sends(accepted_n=5.0)),
    ("hung takes over: ", taken_over),
    ("hung tares again: ", lambda: tares_twice(Told(word=TARE))),
    ("honest is told stale: ", lambda: Told(is_live=True, stale=3).sends()),
    ("honest is told held: ", lambda: Told(is_live=True, held=3).sends()),
    ("pressed for nobody ", lambda: Told().presses(DOWN_S + TICK_S, None)),
    ("presses without a beat ", lambda: Told().presses(LEASE_S + DOWN_S, HOST)),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law[0])
def test_each_law_of_programs_can_be_broken(law: tuple[str, Callable[[], object]]) -> None:
    words, play = law
    with pytest.raises(AssertionError, match=words):
        play()


def test_what_lives_and_what_has_just_hung_breaks_no_law() -> None:
    told = Told(is_live=True)
    told.sends(State.RAMPING, 12.0, HOST)
    hung = Told()
    hung.moved_s[HOST] = hung.now_s - LEASE_S
    hung.sends(State.RAMPING, 12.0, HOST)
    held = Told()
    held.moved_s[HOST] = held.now_s
    held.presses(LEASE_S + DOWN_S - TICK_S, HOST)
    assert told.begun_s == hung.begun_s == {HOST: 100.0}
