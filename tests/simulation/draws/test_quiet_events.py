"""Whether the schedules of a gate with few events draw what they may, and leave all others as they were."""

from dataclasses import replace

from tests.simulation.draws.behaviours import draw_paths
from tests.simulation.draws.event import Event
from tests.simulation.draws.quiet_events import BEGUN, BLOWS, BY_MASTERS, BY_PEOPLE, EVERY, QUIET, draw_quiet_events
from tests.simulation.draws.rigs import draw_rig
from tests.simulation.test_schedules import KEPT, PUSH_SEEDS, SECONDS

SEEDS = range(QUIET, PUSH_SEEDS, EVERY)


def without_time(event: Event) -> Event:
    return replace(event, at_s=0.0)


def test_each_thing_that_may_begin_or_fall_upon_it_does_in_one_gate() -> None:
    drawn = {without_time(event) for seed in SEEDS for event in draw_quiet_events(seed, SECONDS)}
    assert {event for event, _ in BEGUN} <= drawn
    assert len(drawn & set(BLOWS)) > 0.8 * len(set(BLOWS))
    assert len(drawn & {*BY_MASTERS, *BY_PEOPLE}) > 0.8 * len({*BY_MASTERS, *BY_PEOPLE})


def test_events_come_in_their_order_and_in_time() -> None:
    for seed in SEEDS:
        times_s = [event.at_s for event in draw_quiet_events(seed, SECONDS)]
        assert times_s == sorted(times_s) and times_s[-1] < SECONDS


def test_there_are_rigs_with_two_buses_and_with_little_room_for_masters() -> None:
    rigs = [draw_rig(seed).rig for seed in SEEDS]
    assert {len(rig.fieldbus) for rig in rigs} == {0, 1, 2}
    assert {rig.network.connections for rig in rigs} == {9, 32}
    assert {rig.network.idle_s for rig in rigs} == {2.0, 60.0} and {rig.network.requests_per_s for rig in rigs} == {
        25.0,
        200.0,
    }


def test_there_are_rigs_whose_plant_has_more_than_their_calibration_and_masters_that_write_a_path() -> None:
    compensations = [draw_rig(seed).rig.compensation for seed in SEEDS]
    assert {bool(one.cell) for one in compensations} == {bool(one.command) for one in compensations} == {True, False}
    drawn = [event for seed in range(PUSH_SEEDS) for event in draw_paths(seed)]
    assert {event.what for event in drawn} == {"take", "follow", "hold"}


def test_a_kept_schedule_has_the_machine_that_it_was_found_on() -> None:
    kept = [draw_rig(seed).rig for seed, _ in KEPT]
    assert all(len(rig.fieldbus) < 2 and rig.network.connections == 32 for rig in kept)
    assert {rig.control.supervision.lease_s for rig in kept} <= {None, 0.2}
