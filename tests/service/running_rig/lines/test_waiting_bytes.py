"""How old the bytes are that a loop reads behind a standstill, in one piece or in several."""

import pytest

from gateway.service.running_rig.lines.waiting_bytes import WaitingBytes

STALL_S = 0.1


@pytest.mark.parametrize("is_tick_first", [True, False])
@pytest.mark.parametrize("is_tick_between", [True, False])
def test_the_rest_of_what_has_waited_is_as_old_as_its_first_piece(is_tick_first: bool, is_tick_between: bool) -> None:
    """A loop reads so much at once; what it read in its second turn looked as if it had come just then."""
    waiting = WaitingBytes(STALL_S)
    waiting.note_tick(10.0)
    if is_tick_first:
        waiting.note_tick(10.5)
    came_s = [waiting.came_s(10.5, is_rest_left=True)]
    for turn in (1, 2):
        if is_tick_between:
            waiting.note_tick(10.5 + 0.001 * turn)
        came_s.append(waiting.came_s(10.5 + 0.001 * turn, is_rest_left=turn == 1))
    assert came_s == [10.0] * 3
    assert waiting.came_s(10.51) == 10.51, "nothing is left"


def test_a_full_piece_is_as_old_as_it_is_where_nothing_stood_still() -> None:
    waiting = WaitingBytes(STALL_S)
    for turn in range(5):
        now_s = 10.0 + 0.004 * turn
        waiting.note_tick(now_s)
        assert waiting.came_s(now_s, is_rest_left=True) == now_s
