"""State x edge x block x lease: every cell has the answer that the rules give it, and the force of the next five seconds.

Enumerated: each of the 128 control words by each of the four faces, alone, with either setpoint and in a whole block with a new
heartbeat, and each other register alone, in each place of a rig, with and without a lease. Refused writes are made, and leave
no trace; what taken ones become is compared, and each different future is lived (in the push gate those of the page).
"""

from collections.abc import Hashable, Iterator

import pytest

from gateway.registers import Refusal
from gateway.registers.words import State
from tests.service.edge_table.cells import Cell, cells
from tests.service.edge_table.page import PAGE, render, rows
from tests.service.edge_table.places import PLACES, Place
from tests.service.edge_table.rules import Verdict
from tests.service.edge_table.windows import assert_as_the_rules_say, future, is_same, rig_to_ask, watched
from tests.service.running_rig.simulated_rig import SmallRig

STANDS = [
    pytest.param(place, leased, id=f"{place.name}{', leased' * leased}") for place in PLACES for leased in place.leases
]


def standing(rig: SmallRig) -> tuple[object, ...]:
    """All that a refusal must leave as it was: the command's three faces, the owner, what control was handed."""
    bank = rig.bank
    return *(bank.read_registers(*one) for one in ((0, 16), (200, 32), (300, 32))), bank.owner, bank.command, rig.state


@pytest.mark.parametrize(("place", "leased"), STANDS)
def test_every_cell_has_its_answer_and_a_refused_one_leaves_no_trace(place: Place, leased: bool) -> None:
    rig = place.make(leased)
    before, refused = standing(rig), 0
    assert rig.state is place.state
    for cell in cells(place.force_n):
        reason = Verdict(place, leased, cell.asked).reason
        if not reason:
            assert cell.outcome(rig) is not None
            continue
        refusal = cell.write(rig)
        assert refusal is not None, f"taken: {cell}"
        assert (refusal.reason, refusal.address) == (reason, cell.address), cell
        assert refusal.code in (3, 4, 6)
        assert rig.words(118, 2) == (cell.address, reason)
        refused += 1
    assert refused > 500
    assert standing(rig) == before
    assert watched(rig).trace == future(place, leased, None).trace, "five seconds after hundreds of refusals"


def taken(place: Place, leased: bool, every: Iterator[Cell]) -> dict[Hashable, Cell]:
    """One cell of each different outcome."""
    rig = rig_to_ask(place, leased)
    found: dict[Hashable, Cell] = {}
    for cell in every:
        if not Verdict(place, leased, cell.asked).reason:
            found.setdefault(cell.outcome(rig), cell)
    return found


def assert_lived(place: Place, leased: bool, every: Iterator[Cell]) -> int:
    lived, untouched = taken(place, leased, every), future(place, leased, None)
    for outcome, cell in lived.items():
        verdict, window = Verdict(place, leased, cell.asked), future(place, leased, cell, outcome)
        assert (window.word, window.force_n) == (verdict.word, verdict.force_n), cell
        assert_as_the_rules_say(window, place, verdict, untouched)
    return len(lived)


@pytest.mark.parametrize("place", [pytest.param(place, id=place.name) for place in PLACES])
def test_a_taken_edge_makes_the_force_of_the_next_five_seconds(place: Place) -> None:
    named = (cell for _, cell in rows(place))
    assert assert_lived(place, place.leases[0], named) >= 3


@pytest.mark.long
@pytest.mark.parametrize(("place", "leased"), STANDS)
def test_every_cell_makes_the_force_of_the_next_five_seconds(place: Place, leased: bool) -> None:
    """About forty seconds of processor for all places: 700 different futures."""
    assert assert_lived(place, leased, cells(place.force_n)) >= 5


def test_every_state_has_its_places() -> None:
    assert {place.state for place in PLACES} == set(State)
    holding = next(place for place in PLACES if place.name == "holding 12 N")
    off = next(place for place in PLACES if place.name == "off")
    assert not is_same(future(holding, False, None).trace, future(off, False, None).trace)
    with pytest.raises(Refusal, match="tare"):
        next(cell for name, cell in rows(holding) if name == "tare").outcome(rig_to_ask(holding, False))


def test_the_page_is_what_the_gateway_does() -> None:
    """`tools/edges` writes it anew."""
    assert PAGE.read_text(encoding="utf-8") == render()
