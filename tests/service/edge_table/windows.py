"""What a rig does in the five seconds after a write: each future is lived once, however many cells lead to it."""

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from typing import Final, TypeAlias

from gateway.registers.words import State
from tests.service.edge_table.cells import Cell
from tests.service.edge_table.places import Place
from tests.service.edge_table.rules import Verdict
from tests.service.running_rig.simulated_rig import TICK_S, SmallRig

WATCHED_S: Final = 5.0
Trace: TypeAlias = list[tuple[State, float, float]]
"""State, voltage and true force at each tick."""


@dataclass(frozen=True)
class Window:
    """What was there at once (control word and setpoint as read), and what came: `trace` begins with the tick after."""

    word: int
    force_n: float
    trace: Trace

    @property
    def at_end(self) -> tuple[State, float]:
        return self.trace[-1][0], self.trace[-1][2]


_LIVED: dict[Hashable, Window] = {}


def future(place: Place, leased: bool, cell: Cell | None, outcome: Hashable = None) -> Window:
    """Return the seconds after this write, or without any. outcome: what it becomes; equal ones are lived once."""
    key = place.name, leased, cell and outcome
    if key not in _LIVED:
        rig = place.make(leased)
        if cell:
            assert cell.write(rig) is None, f"{cell} in {place.name}"
        _LIVED[key] = watched(rig)
    return _LIVED[key]


@cache
def rig_to_ask(place: Place, leased: bool) -> SmallRig:
    """Return a rig of which outcomes are asked, and nothing is written."""
    return place.make(leased)


def watched(rig: SmallRig) -> Window:
    before = len(rig.trace)
    word, setpoint = rig.words(0, 2)
    rig.run(WATCHED_S)
    return Window(word, setpoint / 100, rig.trace[before:])


def is_same(trace: Trace, other: Trace) -> bool:
    """A decision more in between splits a step of time in two: the same voltage but for its last bits, and a ramp that ends
    a tick earlier or later."""
    states, others = ([state for state, _ in groupby(one[0] for one in each)] for each in (trace, other))
    numbers = zip(trace, other, strict=True)
    close = all(abs(one[1] - two[1]) < 1e-6 and abs(one[2] - two[2]) < 1e-6 for one, two in numbers)
    return close and states == others


def assert_as_the_rules_say(window: Window, place: Place, verdict: Verdict, untouched: Window) -> None:
    """Force, voltage and state from the write on. untouched: the same place without the write."""
    trace, settled = window.trace, window.trace[round(2.0 / TICK_S) :]
    assert all(0.0 <= voltage_v <= 9.0 for _, voltage_v, _ in trace)
    highest_n = max(force_n for _, _, force_n in untouched.trace) if place.runs else place.force_n
    if not verdict.begins_run:
        assert all(force_n <= max(highest_n, verdict.force_n) + 3.0 for _, _, force_n in trace)
    if verdict.changes_nothing:
        assert is_same(trace, untouched.trace)
    elif not verdict.is_enabled:
        rests = State.FAULT if place.state is State.FAULT and not verdict.resets else State.OFF
        assert {(state, voltage_v) for state, voltage_v, _ in trace} == {(rests, 0.0)}
        assert all(force_n < 0.5 for _, _, force_n in settled)
    elif verdict.begins_run:
        assert {state for state, _, _ in trace} == {State.CALIBRATING}
    elif verdict.ends_run:
        assert trace[0][0] is State.CALIBRATING and window.at_end[0] is State.OFF
        voltages_v = [voltage_v for _, voltage_v, _ in trace]
        assert voltages_v[-1] == 0.0 and max(voltages_v) <= voltages_v[0] + 0.05
    elif not verdict.changes_another:
        assert window.at_end[0] is (State.HOLDING if verdict.force_n else State.READY)
        assert abs(window.at_end[1] - verdict.force_n) < 1.5
