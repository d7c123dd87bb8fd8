"""Whether a start that was refused and comes on and on is seen by the judge, and drawn often enough to be met."""

from dataclasses import replace
from math import inf

import pytest

from tests.simulation.draws.behaviours import draw_refused
from tests.simulation.draws.event import Event
from tests.simulation.judges.lease_judge import LeaseJudge
from tests.simulation.judges.observer import Bounds, Observer
from tests.simulation.masters.spelling import coil_pdu, write_one_pdu, write_pdu
from tests.simulation.schedule import run_schedule

BOUNDS = Bounds(8.5, 40.0, 0.125, 0.1, 0.2, 0.05, output_timeout_s=0.2)
FRAME = write_pdu(0, 1, 1200, 0, 0, 7)


@pytest.mark.parametrize(
    ("lease_s", "taken", "at_s", "is_seen"),
    [
        (0.2, FRAME, 1.1, True),
        (0.2, FRAME, 5.0, False),
        (0.2, write_pdu(0, 1, 1200, 0, 0, 8), 1.1, False),
        (0.2, write_one_pdu(4, 7), 1.1, False),
        (inf, FRAME, 1.1, False),
    ],
)
def test_who_begins_by_the_frame_that_was_refused_is_seen(
    lease_s: float, taken: bytes, at_s: float, *, is_seen: bool
) -> None:
    observer = Observer(replace(BOUNDS, lease_s=lease_s))
    judge = LeaseJudge(observer)
    for moment_s in (0.9, 1.0):
        judge.note_start(FRAME, moment_s, is_taken=False, host="10.0.0.1")
    judge.note_start(FRAME, 1.0, is_taken=True, host="10.0.0.2")
    judge.note_start(taken, at_s, is_taken=True, host="10.0.0.1")
    assert bool(observer.broken) is is_seen
    judge.note_start(FRAME, 6.0, is_taken=False, host="10.0.0.1")
    judge.forget(2.0)
    judge.note_start(FRAME, 6.1, is_taken=True, host="10.0.0.1")
    assert len(observer.broken) == is_seen


def test_programs_that_hang_while_they_are_refused_are_drawn_by_every_face() -> None:
    scenes = [scene for seed in range(600) if (scene := list(draw_refused(seed)))]
    assert 60 < len(scenes) < 120
    assert {scene[1].way for scene in scenes} == {"block", "floats", "singles", "coils"}
    assert sum(scene[-2].what == "hang" for scene in scenes) > 50


def test_a_cell_that_is_plugged_in_again_lets_no_program_press_that_hung_meanwhile() -> None:
    events = [
        Event(2.0, "world", "cell-cut", (1.0,)),
        Event(2.5, "worker", "hold", (30.0,)),
        Event(3.0, "worker", "hang"),
        Event(3.5, "world", "cell-cut", (0.0,)),
    ]
    outcome = run_schedule(90029, events, 6.0)
    assert outcome.broken == () and outcome.largest_v > 0.0


def test_two_frames_that_hang_beside_each_other_renew_no_lease_for_gateway_or_judge() -> None:
    events = [Event(1.0, "worker", "take", (30.0,)), Event(2.5, "worker", "hang", (30000.0,))]
    outcome = run_schedule(90020, events, 3.5)
    assert outcome.broken == () and outcome.largest_v > 3.0
    observer, frames = Observer(replace(BOUNDS, lease_s=0.2)), (FRAME, write_one_pdu(4, 30000))
    judge = LeaseJudge(observer)
    observer.hear(b"SET 0\r\nSET 300\r\n", 1.0)
    observer.note_accepted(1, 1.0)
    for tick in range(20):
        judge.note_write(frames[tick % 2], 1.0 + 0.1 * tick, is_answered=True, host="10.0.0.1")
        judge.look(1.0 + 0.1 * tick)
    assert [told.partition(" at ")[0] for told in observer.broken][-1] == "I3 heartbeat"


@pytest.mark.parametrize("ends", ["dies", "is lost, then dies", "ends"])
def test_behind_a_restart_no_frame_presses_of_two_that_hang_beside_each_other(ends: str) -> None:
    late_s = 0.3 if ends == "dies" else 1.0
    events = [
        Event(1.0, "worker", "take", (30.0,)),
        Event(2.5, "worker", "hang", (30000.0,)),
        Event(2.5 + late_s, "machine", "terminate" if ends == "ends" else "kill", (0.1, 0.0)),
    ]
    outcome = run_schedule(90020, events, 7.0)
    assert outcome.broken == () and outcome.largest_v > 3.0


@pytest.mark.parametrize(
    ("later", "is_seen"),
    [(FRAME, True), (write_pdu(0, 1, 1200, 0, 0, 8), False), (write_one_pdu(4, 8), False), (write_pdu(0, 0), False)],
)
@pytest.mark.parametrize(("died_s", "is_all"), [(1.2, False), (1.2, True), (1.05, False)])
def test_who_begins_by_a_frame_of_before_a_death_is_seen(
    later: bytes, died_s: float, is_all: bool, is_seen: bool
) -> None:
    """But for one that came first when the next tick, which would have told of it, was to come."""
    observer = Observer(replace(BOUNDS, lease_s=0.2))
    judge = LeaseJudge(observer)
    judge.note_write(FRAME, 1.0, is_answered=True, host="10.0.0.1")
    judge.forget(died_s, is_all=is_all)
    for pdu in (later, FRAME):
        judge.note_start(pdu, 1.5, is_taken=pdu == FRAME, host="10.0.0.1")
    assert bool(observer.broken) is (is_seen and not is_all and died_s == 1.2)


def test_what_a_frame_has_brought_just_before_a_death_nobody_has_told_the_next_process() -> None:
    """As seed 277393 drew it: its second frame had brought another heartbeat 40 ms before, with the next tick to come."""
    observer = Observer(replace(BOUNDS, lease_s=0.2))
    judge = LeaseJudge(observer)
    for pdu, at_s in ((write_one_pdu(4, 2), 0.5), (FRAME, 1.0), (write_one_pdu(4, 43536), 1.16)):
        judge.note_write(pdu, at_s, is_answered=True, host="10.0.0.1")
    judge.forget(1.2)
    for pdu in (write_one_pdu(4, 43536), FRAME):
        judge.note_start(pdu, 1.5, is_taken=True, host="10.0.0.1")
    assert observer.broken == []


@pytest.mark.parametrize(("refused_s", "host", "is_seen"), [(1.14, "10.0.0.1", False), (1.14, "10.0.0.2", True)])
def test_who_is_refused_just_before_the_gateway_is_told_to_stop_is_there(
    refused_s: float, host: str, is_seen: bool
) -> None:
    """As seed 261928 drew it, whose master had enabled by a coil."""
    observer = Observer(replace(BOUNDS, lease_s=0.2))
    judge = LeaseJudge(observer)
    observer.hear(b"SET 0\r\nSET 300\r\n", 1.0)
    observer.note_accepted(1, 1.0)
    judge.note_write(coil_pdu(0, on=True), 1.0, is_answered=True, host="10.0.0.1")
    judge.note_start(write_pdu(0, 17), refused_s, is_taken=False, host=host)
    judge.note_ending()
    judge.look(1.38)
    assert any(told.startswith("I3") for told in observer.broken) is is_seen
