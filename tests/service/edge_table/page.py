"""The table of edges for people: measured on the rig in virtual time, written by tools/edges."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from gateway.registers import Refusal
from tests.service.edge_table.cells import BEAT, Cell
from tests.service.edge_table.places import PLACES, Place
from tests.service.edge_table.rules import CALIBRATE, ENABLE, RESET, RUNS, SELF_TEST, TAKE, TARE, VALVE, Asked
from tests.service.edge_table.windows import WATCHED_S, future, is_same, rig_to_ask
from tests.service.running_rig.simulated_rig import SmallRig

PAGE: Final = Path(__file__).parents[3] / "gateway" / "control" / "EDGES.md"
HEAD: Final = f"""# What each edge does in each state

Written by `tools/edges` from the gateway itself: bank and controller beside a small plant, in virtual time. A test asks
whether this page is what they do, and whether it is what the rules say (`tests/service/edge_table/rules.py`), for every control
word by every face (int16, float ABCD, float CDAB, coils), alone, with a setpoint and in a whole block: all faces get the same
answer. The owner writes; the rig has a self-test and no valve.

A refusal is an exception (its number first) with its reason in `refusal_reason`; nothing of that write is taken, and the
seconds after it are those of a rig that nobody has written to. _same_: so are they where a write is taken and changes nothing.
Otherwise: state and force {WATCHED_S:.0f} s later. `+`: beside the bits that stand; without it the other bits are written as 0,
so that enable falls where it stood.
"""


def rows(place: Place) -> Iterator[tuple[str, Cell]]:
    """The writes that people know by a name, by the int16 block."""
    stands = place.stands
    yield "0", _word(0)
    yield "+ enable", _word(stands | ENABLE)
    yield "+ enable, force_setpoint 13 N", Cell("command", 0, (stands | ENABLE, 13.0), Asked(stands | ENABLE, 13.0))
    if stands & RUNS and stands & ENABLE:
        yield "enable (the run's bit falls)", _word(ENABLE)
    names = {"reset_fault": RESET, "tare": TARE, "start_calibration": CALIBRATE, "start_self_test": SELF_TEST}
    for name, bit in names.items():
        yield name, _word(bit)
        if stands & ~bit:
            yield f"+ {name}", _word(stands | bit)
    yield "reset_fault, enable", _word(RESET | ENABLE)
    yield "+ take_ownership", _word(stands | TAKE)
    yield "+ valve_pull", _word(stands | VALVE)
    whole = (float(stands), place.force_n, 0.0, 0.0, float(BEAT), *(0.0,) * 8)
    yield "the block as it is, new heartbeat", Cell("command", 0, whole, Asked(stands, place.force_n, beats=True))
    reset = (float(RESET), 0.0, 0.0, 0.0, float(BEAT))
    yield "reset_fault, setpoint 0, new heartbeat", Cell("command", 0, reset, Asked(RESET, 0.0, beats=True))
    yield "force_setpoint 13 N alone", Cell("command", 1, (13.0,), Asked(force_n=13.0))
    yield "tilt_angle 10 deg alone", Cell("command", 6, (10.0,), Asked(changes=True))


def _word(word: int) -> Cell:
    return Cell("command", 0, (float(word),), Asked(word))


def render() -> str:
    """Return the page: one table for each place, one row for each write."""
    return "\n".join([HEAD, *(line for place in PLACES for line in _table(place))])


def _table(place: Place) -> Iterator[str]:
    leased = place.leases[0]
    state, force_n = future(place, leased, None).at_end
    lease = " (with a lease)" if leased else ""
    yield f"## {place.name}{lease}\n"
    yield f"Nobody writes: {state.name.lower()}, {force_n:.0f} N after {WATCHED_S:.0f} s.\n"
    rigs = {kind: rig_to_ask(place, kind) for kind in place.leases}
    yield f"| control_word {place.stands}, written | answer |{' with a lease |' * (len(rigs) - 1)} then |"
    yield f"| --- | --- |{' --- |' * (len(rigs) - 1)} --- |"
    for name, cell in rows(place):
        answers = [_answer(cell, rig) for rig in rigs.values()]
        others = [" the same |" if one == answers[0] else f" {one} |" for one in answers[1:]]
        then = _then(place, leased, cell, rigs[leased]) if answers[0] == "taken" else ""
        yield f"| {name} | {answers[0]} |{''.join(others)} {then} |".replace("  ", " ")
    yield ""


def _answer(cell: Cell, rig: SmallRig) -> str:
    try:
        cell.outcome(rig)
    except Refusal as refusal:
        words = refusal.reason.name.lower().replace("_", " ")
        return f"{refusal.code:02d} {words} ({refusal.reason.code})"
    return "taken"


def _then(place: Place, leased: bool, cell: Cell, rig: SmallRig) -> str:
    window = future(place, leased, cell, cell.outcome(rig))
    if is_same(window.trace, future(place, leased, None).trace):
        return "_same_"
    state, force_n = window.at_end
    return f"{state.name.lower()}, {abs(force_n):.0f} N"
