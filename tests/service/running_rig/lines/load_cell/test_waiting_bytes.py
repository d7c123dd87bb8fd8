"""How old the bytes are that a loop reads behind a standstill, in one piece or in several."""

import pytest

from gateway.devices import cell_device, cell_host
from gateway.devices.messages import ForceSample
from gateway.ports.port import CHUNK_BYTES
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from gateway.service.running_rig.lines.waiting_bytes import WaitingBytes
from tests.profile_files import load_device

STALL_S = 0.1


class Stream:
    """A cell that talks by itself, and a loop that ticks every 10 ms but where it stands still."""

    def __init__(self, stall_s: float = STALL_S) -> None:
        profile = load_device("stream-st-gs")
        self.exchange = CellExchange(cell_host(profile), lambda _: None, profile, stall_s)
        self.frame, self.now_s = cell_device(profile).frame(1.0), 10.0
        self.exchange.tick(self.now_s)
        self.exchange.receive(self.frame, self.now_s)

    def tick_for(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.01)):
            self.now_s += 0.01
            self.exchange.tick(self.now_s)

    def ages_s(self, chunk: bytes) -> set[float]:
        """How old the samples in this piece are taken to be."""
        found = self.exchange.receive(chunk, self.now_s)
        return {round(self.now_s - one.time_s, 6) for one in found if isinstance(one, ForceSample)}


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


@pytest.mark.parametrize(("stall_s", "age_s"), [(0.1, 0.3), (0.2, 0.3), (0.4, 0.0)])
def test_a_reading_is_as_old_as_the_standstill_before_it_where_that_is_one_by_the_rig(
    stall_s: float, age_s: float
) -> None:
    stream = Stream(stall_s)
    stream.now_s += 0.3
    whole = stream.frame * (CHUNK_BYTES // len(stream.frame) + 1)
    assert stream.ages_s(whole[:CHUNK_BYTES]) == {age_s}
    assert stream.ages_s(whole[CHUNK_BYTES:]) == {age_s}, "the rest of it, which is read in the next turn"
    assert stream.ages_s(stream.frame) == {0.0}


def test_a_slow_cell_s_reading_is_new_while_the_loop_ticks() -> None:
    stream = Stream()
    stream.tick_for(0.3)
    assert stream.ages_s(stream.frame) == {0.0}
