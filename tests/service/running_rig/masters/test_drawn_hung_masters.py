"""Masters whose programs hang while their last frame flows on, as a seed draws it, beside a page that stops and resets, a cell
that goes silent, runs of this machine, deaths of control and restarts of the service: what repeats begins nothing and raises
nothing.
"""

from dataclasses import replace
from random import Random
from typing import Any

import pytest

from gateway.control import LeaseAction
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.settings import Defaults
from gateway.modbus import Peer
from gateway.registers.words import State
from gateway.service.running_rig.handover import Handover, left_of
from tests.control.bench import settings
from tests.service.running_rig.runs.test_runs_and_masters import LEASE_S
from tests.service.running_rig.simulated_rig import ENABLE, RESET, TAKE, SmallRig

MASTERS, PAGE = tuple(Peer(f"10.0.0.{number}") for number in (5, 6, 7)), Peer("web")
PRESSING = State.RAMPING, State.HOLDING, State.READY
HAPPENINGS = (
    *("hang", "hang", "go on", "ask", "ask", "idle", "stop"),
    *("stop here", "reset", "5 N", "run here", "cell", "death", "restart"),
)
COUNT, STEPS = 2, 120
SEEDS = 6, 11, 23, 281
"""What was pressed so once is seen by these."""


class Master:
    """Writes its whole block in each cycle; asks: control word and force, None while it is idle."""

    def __init__(self, draw: Random) -> None:
        self.asks: tuple[int, int] | None = None
        self.hangs, self._beat = False, draw.randrange(1, 65000)

    @property
    def frame(self) -> tuple[int, ...]:
        self._beat += not self.hangs
        assert self.asks
        return (*self.asks, 0, 0, self._beat)


class Cell:
    """One rig through several processes."""

    def __init__(self, seed: int) -> None:
        self.draw, self.kept, self.told = Random(seed), dict[str, Any](), list[str]()
        control = settings(lease_s=LEASE_S, lease_action=self.draw.choice(tuple(LeaseAction)))
        self.control = replace(control, defaults=Defaults(force_ramp_n_per_s=self.draw.choice((5.0, 30.0, 200.0))))
        self.masters = {peer: Master(self.draw) for peer in MASTERS}
        self.begin(None)

    def begin(self, left_beats: list[int] | None) -> None:
        """Another process of control, with what the one before has left."""
        self.rig = SmallRig(self.control)
        hand = Handover(dict(self.kept), record=False)
        hand.restore_held(self.rig.bank, self.rig.now(), lambda **facts: self.kept.update(facts), left_beats)
        self.rig.beats = False

    def end(self, *, is_death: bool) -> None:
        bank = self.rig.bank
        beats = self.rig.loop.owner_beats
        if is_death:
            self.kept["owner"] = bank.owner
        else:
            bank.held_enables.note_lost(bank.owner, beats[0])
            self.kept = left_of(self.kept)
        self.kept.pop("held_enables", None)  # by times of this clock, which begins anew
        for master in self.masters.values():
            if master.hangs and self.rig.state is State.FAULT:
                master.asks = None  # else that would have been what kept it off
        self.begin(beats if is_death else None)

    def happen(self) -> None:
        draw, rig, (peer, master) = self.draw, self.rig, self.draw.choice(tuple(self.masters.items()))
        name = draw.choice(HAPPENINGS)
        self.told.append(f"{rig.now():.2f} {peer.host} {name}")
        if name in ("hang", "go on"):
            master.hangs = name == "hang"
        elif name == "ask":
            master.asks, master.hangs = (ENABLE | draw.choice((0, 0, TAKE)), draw.choice((300, 1200, 3000))), False
        elif name == "idle":
            master.asks = None
        elif name == "stop" and not master.hangs:
            rig.answer(0, 0, peer=peer)
            master.asks = None
        elif name == "stop here":
            rig.answer(0, 0, peer=PAGE)
        elif name == "reset":
            rig.answer(0, RESET, 0, 0, 0, draw.randrange(1, 65536), peer=PAGE)
        elif name == "cell":
            rig.is_cell_silent = not rig.is_cell_silent
        elif name == "run here":
            rig.controller.active_run.ask(CalibrationPlan())
        elif name == "5 N":
            rig.answer(1, 500, peer=PAGE)
        elif name in ("death", "restart") and draw.random() < 0.5:
            self.end(is_death=name == "death")

    def cycle(self) -> None:
        for peer, master in self.masters.items():
            if master.asks is None:
                continue
            state, accepted = self.rig.state, self.rig.word("force_accepted")
            refused = self.rig.answer(0, *master.frame, peer=peer)
            begins = state not in PRESSING and self.rig.state in PRESSING
            rises = self.rig.state in PRESSING and self.rig.word("force_accepted") > accepted + COUNT
            about = f"{peer.host} {master.asks} {refused}: {'; '.join(self.told[-12:])}"
            assert not (master.hangs and (begins or rises)), about


@pytest.mark.parametrize("first", SEEDS)
def test_the_frames_of_a_program_that_hung_begin_nothing_and_raise_nothing(first: int, budget: int) -> None:
    for seed in (first, *range(1000 * first, 1000 * first + 2 * (budget - 1))):
        cell = Cell(seed)
        for _ in range(STEPS):
            cell.happen()
            for _ in range(cell.draw.choice((1, 2, 5, 10))):
                cell.cycle()
                cell.rig.run(0.05)
        assert cell.rig.trace
