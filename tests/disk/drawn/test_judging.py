"""A law of who judges what is kept on disk that few drawn scenes ask: a slot that is selected was filled."""

from random import Random
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.registers import Refusal
from gateway.registers.refusal import RefusalReason
from tests.disk.drawn.players.upload_player import UploadPlayer


def selecting(tmp_path: Any, write: Any) -> tuple[UploadPlayer, list[str]]:
    """A player whose gateway answers the selection of a slot so, and what is complained of."""
    broken: list[str] = []
    player = UploadPlayer(SimpleNamespace(rng=Random(1), state=tmp_path, complain=broken.append))
    player.bench = SimpleNamespace(write=write)  # type: ignore[assignment]
    return player, broken


@pytest.mark.parametrize(
    ("marks", "is_touched", "is_seen"), [((), False, True), ((), True, False), ((7,), False, False)]
)
def test_a_slot_that_was_never_filled_and_is_selected_is_seen(
    tmp_path: Any, marks: tuple[int, ...], is_touched: bool, is_seen: bool
) -> None:
    player, broken = selecting(tmp_path, lambda *_: None)
    player.is_touched = is_touched
    for filled in player.slots.values():
        filled |= set(marks)
    player._select()
    assert ["was never filled" in words for words in broken] == [True] * is_seen
    assert player.possible == {0, *marks}


def test_a_selection_that_is_refused_is_no_selection(tmp_path: Any) -> None:
    def refuse(*_: int) -> None:
        raise Refusal(RefusalReason.READ_ONLY, 1149, "no")

    player, broken = selecting(tmp_path, refuse)
    with pytest.raises(Refusal):
        player._select()
    assert (broken, player.asked, player.possible) == ([], None, {0})
