"""What a host keeps up, was refused or was lost with, by itself: how long it counts, what ends it, and who is told."""

import pytest

from gateway import defaults
from gateway.registers.writes.held_starts import HeldEnables, StartFrame

HOST, CHANNEL = "10.0.0.1", ("10.0.0.1", "10.0.0.1", 40000, 0, 12)


def frame(beat: int | None, setpoint: bytes = b"\x04\xb0", *, takes: bool = False) -> StartFrame:
    return StartFrame(CHANNEL, (0, setpoint), beat, takes)


def refused(beat: int = 7) -> HeldEnables:
    held = HeldEnables()
    held.note_refused(HOST, frame(beat), standing=beat, now_s=100.0)
    return held


@pytest.mark.parametrize(
    ("sent", "repeats"),
    [
        (frame(7), True),
        (frame(7, b"\0\0"), True),  # another setpoint, by a program that stands still in another place
        (StartFrame((*CHANNEL[:3], 1, 2), (1, b"\0\0"), 7), True),  # in another frame of its
        (frame(8, b"\0\0"), False),
        (frame(None, b"\0\0"), True),  # of who beats, a frame without one tells nothing
        (frame(7, takes=True), True),  # its setpoint was out of range, which hid that it takes over
        (frame(7, b"\0\x09", takes=True), False),  # who is refused is told to take over
    ],
)
def test_a_start_repeats_the_refused_one_by_its_heartbeat_or_its_words(sent: StartFrame, repeats: bool) -> None:
    assert refused().repeats(HOST, sent, 100.5) is repeats
    assert not refused().repeats("10.0.0.2", sent, 100.5)


@pytest.mark.parametrize("beat", [7, None])
def test_a_frame_that_comes_on_and_on_is_the_refused_one_for_as_long_as_it_comes(beat: int | None) -> None:
    held = refused()
    assert all(held.repeats(HOST, frame(beat), 100.0 + 2.0 * k) for k in range(1, 6))
    assert not held.repeats(HOST, frame(beat), 113.5), "who has waited for three seconds has looked"


@pytest.mark.parametrize(
    ("sent", "at_s"),
    [(frame(7), 100.9), (frame(8), 100.5), (frame(7, b"\0\0"), 100.5), (frame(7, b"\0\x09", takes=True), 100.5)],
)
def test_who_writes_enable_as_0_begins_anew_and_is_lost_to_the_next_process(sent: StartFrame, at_s: float) -> None:
    told = list[dict[str, list[int]]]()
    held = refused()
    held.on_lost = told.append
    held.note_lost(HOST, 7)
    held.let_go(HOST, 100.1)
    assert told == [{HOST: [7]}], "a program beside it may hang"
    held.hear(HOST, 8, CHANNEL) if sent.heartbeat == 8 else None
    assert not held.repeats(HOST, sent, at_s)


def test_behind_a_0_a_refused_frame_that_comes_again_within_a_cycle_is_of_a_program_beside_who_wrote_it() -> None:
    """Each of its frames: the last that was refused is the heartbeat's."""
    held, beat = refused(), StartFrame((*CHANNEL[:3], 4, 2), (4, b"\0\x09"), 9)
    held.note_refused(HOST, beat, standing=9, now_s=100.0)
    held.let_go(HOST, 100.0)
    assert (
        held.repeats(HOST, frame(7), 100.7) and held.repeats(HOST, beat, 101.4) and held.repeats(HOST, frame(7), 102.1)
    )
    assert not held.repeats(HOST, frame(7), 102.9)


@pytest.mark.parametrize("is_refused", [True, False])
def test_beside_a_program_that_connects_anew_for_each_frame_the_last_one_of_another_is_known(is_refused: bool) -> None:
    """It was forgotten for the connections of the other one, and behind that one's 0 it began (seed 59728). Where their frames
    were taken all connections were kept, so that each write looked at tens of thousands of them."""
    held = refused()
    for k in range(20 * defaults.MOST_FRAMES):
        anew = StartFrame((HOST, HOST, 50000 + k, 1, 8), (1, bytes(8)), 7)
        if is_refused:
            held.note_refused(HOST, anew, standing=7, now_s=100.0)
        else:
            assert held.repeats(HOST, anew, 100.0)
        assert len(held._refused[HOST, False].sent) <= defaults.MOST_FRAMES
    held.let_go(HOST, 100.0)
    assert held.repeats(HOST, frame(7), 100.7)


def test_of_too_many_frames_of_a_host_the_one_is_forgotten_that_has_not_come_for_longest() -> None:
    held = refused()
    others = [StartFrame((*CHANNEL[:3], k, 2), (k, b"\0\x09"), 7) for k in range(1, 1 + defaults.MOST_FRAMES)]
    for sent in (*others[:-1], frame(7), others[-1]):
        held.note_refused(HOST, sent, standing=7, now_s=100.0)
    held.let_go(HOST, 100.0)
    assert held.repeats(HOST, frame(7), 100.7) and not held.repeats(HOST, others[0], 100.7)


def test_who_was_lost_in_the_process_before_begins_behind_another_heartbeat_and_not_by_the_one_of_then() -> None:
    held = HeldEnables()
    held.restore({}, {HOST: [7]}, 100.0)
    assert held.repeats(HOST, frame(7), 100.5) and held.repeats(HOST, frame(None), 100.5)
    held.hear(HOST, 7, CHANNEL)
    assert held.repeats(HOST, frame(7), 100.5)
    held.hear(HOST, 8, CHANNEL)
    assert not held.repeats(HOST, frame(8), 100.5) and not held.knows(HOST)


@pytest.mark.parametrize(("ago_s", "is_held"), [(-1.0, False), (0.0, True), (12.9, True), (13.1, False)])
def test_what_was_held_in_the_process_before_counts_for_as_long_as_a_start_may_take(
    ago_s: float, is_held: bool
) -> None:
    """Of a machine that was started anew its clock was another one: what lies ahead of now is of that."""
    held = HeldEnables()
    held.restore({HOST: 100.0 - ago_s}, {}, 100.0)
    assert held.holds(HOST, 100.0) is is_held


def test_the_next_process_is_told_of_a_held_enable_once_a_second_and_of_a_new_one_at_once() -> None:
    told, held = list[dict[str, float]](), HeldEnables()
    held.on_change = told.append
    for k in range(21):
        held.note(HOST, 100.0 + 0.1 * k)
    held.note("10.0.0.2", 102.1)
    assert [list(one.values()) for one in told] == [[100.0], [pytest.approx(101.0)], [pytest.approx(102.0)],
                                                    [pytest.approx(102.0), 102.1]]  # fmt: skip


def test_of_who_connects_anew_for_each_frame_the_latest_heartbeat_is_told() -> None:
    """Its older ones, told again beside it, pushed it out."""
    told = list[dict[str, list[int]]]()
    held, last = HeldEnables(), 3 * defaults.MOST_FRAMES
    held.on_lost, held.beats_of = told.append, lambda host: range(1000, 1000 + defaults.MOST_FRAMES)
    for beat in range(1, last + 1):
        held.frames.note((HOST, HOST, 40000 + beat, 0, 12), beat)
        for _ in range(3):
            held.note_lost(HOST, beat)
            assert beat in told[-1][HOST] and len(told[-1][HOST]) == defaults.MOST_FRAMES
    assert len(told) == last, "once for each"
