"""A lease by itself: what renews it, when it is over, and what counts as a sign of life since a time."""

from math import inf

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.supervision.lease import Lease
from gateway.registers.command import NO_BEAT, Channel
from tests.control.bench import enabled, settings


def test_a_lease_is_over_behind_its_length_and_at_once_where_its_owner_has_gone() -> None:
    lease = Lease(0.5)
    lease.start(10.0)
    assert not lease.is_lost(10.5, True) and lease.is_lost(10.51, True)
    assert lease.is_lost(10.0, False)
    lease.observe(10.5, 7)
    assert not lease.is_lost(11.0, True) and lease.age_s(11.0) == 0.5
    lease.start(12.0)
    assert not lease.is_lost(12.4, True)


def block_of(who: str) -> tuple[str, Channel]:
    """A master, and the channel of its block."""
    return who, (who, who, 4001, 0, 26)


def test_the_first_0_is_no_beat() -> None:
    """A block that nobody has written yet reads 0."""
    lease = Lease(0.5)
    lease.observe(10.0, 0)
    assert lease.is_lost(10.0, True)


def test_without_a_lease_nobody_is_lost() -> None:
    lease = Lease(None)
    assert not lease.is_lost(1e6, False) and lease.is_fresh_since(1e6, 2e6) and lease.is_within(1e6, 2e6)


def test_only_another_heartbeat_renews_it() -> None:
    lease = Lease(0.5)
    lease.observe(10.0, 7)
    lease.observe(10.4, 7)
    assert lease.age_s(10.5) == 0.5
    lease.observe(10.6, 0, channel=NO_BEAT)
    assert lease.age_s(11.0) == 1.0
    lease.observe(10.8, 7)
    assert lease.age_s(11.0) == 1.0, "as before"
    lease.observe(11.0, 8)
    assert lease.age_s(11.0) == 0.0


def test_a_frame_that_is_sent_on_and_on_is_no_beat_behind_what_another_master_has_written() -> None:
    lease = Lease(0.5)
    plc, page = block_of("plc"), block_of("page")
    lease.observe(10.0, 7, *plc)
    lease.observe(10.2, 4711, *page)
    lease.observe(10.4, 7, *plc)
    assert lease.age_s(11.0) == pytest.approx(0.8)
    assert not lease.would_have_beaten_since(10.1, 10.5, 7, *plc)
    assert lease.would_have_beaten_since(10.1, 10.5, 8, *plc) and lease.would_have_beaten_since(10.1, 10.5, 4711, *page)
    lease.observe(10.6, 4712, *page)
    assert lease.age_s(11.0) == pytest.approx(0.4)


def test_the_masters_that_are_remembered_are_bounded_and_the_oldest_is_forgotten() -> None:
    lease = Lease(0.5)
    for number in range(100):
        lease.observe(float(number), number + 1, *block_of(str(number)))
    assert lease.would_have_beaten_since(99.5, 99.9, 1, *block_of("0")), "whoever is not known begins anew"
    assert not lease.would_have_beaten_since(99.5, 99.9, 99, *block_of("98"))


@pytest.mark.parametrize(
    ("since_s", "now_s", "is_fresh"),
    [(9.9, 10.2, True), (9.9, 10.5, True), (9.9, 10.6, False), (10.0, 10.2, False), (10.1, 10.2, False)],
)
def test_a_sign_of_life_is_one_that_came_later_and_within_one_length(
    since_s: float, now_s: float, is_fresh: bool
) -> None:
    lease = Lease(0.5)
    lease.observe(10.0, 7)
    assert lease.is_fresh_since(since_s, now_s) is is_fresh
    assert lease.would_be_fresh_since(since_s, now_s, 7) is is_fresh
    assert lease.would_be_fresh_since(since_s, now_s, 8)


@pytest.mark.parametrize(("since_s", "now_s", "is_fresh"), [(9.9, 10.4, True), (9.9, 10.6, False), (10.1, 10.2, False)])
def test_a_beat_of_a_refused_write_is_a_sign_of_life_for_one_length(
    since_s: float, now_s: float, is_fresh: bool
) -> None:
    lease = Lease(0.5)
    for at_s, heartbeat in ((8.0, 7), (10.0, 8), (10.0, 7)):
        lease.hear_refused(at_s, heartbeat, *block_of("a"))
    lease.pass_over(7, block_of("a")[1])
    assert lease.would_be_fresh_since(since_s, now_s, 7) is is_fresh


def test_a_rig_that_says_no_more_than_a_length_goes_to_the_safe_voltage_behind_it() -> None:
    bench = enabled(settings(lease_s=0.2))
    bench.force(12.0)
    bench.run(0.15)
    assert bench.last.voltage_v > 0.0
    output = bench.run(0.1)
    assert (output.fault, output.voltage_v) == (FaultCode.MASTER_LOST, 0.0)


def test_of_many_masters_those_are_known_that_have_beaten_last() -> None:
    """Memory is bounded: whose beat is forgotten would seem to beat with the frame that it has hung with."""
    lease = Lease(0.5)
    for number in range(64):
        lease.observe(10.0 + number, 1000 + number, *block_of(f"10.0.1.{number}"))
        lease.observe(
            10.0 + number, 2000 + number, *block_of("10.0.0.1")
        )  # who has the lease all the while, and hangs then
    lease.observe(100.0, 7, *block_of("10.0.0.9"))
    for beat, who in ((2063, "10.0.0.1"), (1062, "10.0.1.62"), (7, "10.0.0.9")):
        assert not lease.would_have_beaten_since(200.0, 200.0, beat, *block_of(who)), who
    assert lease.would_have_beaten_since(200.0, 200.0, 1000, *block_of("10.0.1.0")), "who has been forgotten"


def test_who_has_beaten_since_its_last_takeover_has_a_lease_of_its_own_at_the_next() -> None:
    lease = Lease(1.0)
    lease.take_over(0.0, "a")
    lease.observe(0.1, 5, "a")
    lease.take_over(0.5, "b")
    assert lease.would_start_for("a") and not lease.would_start_for("b")
    lease.take_over(0.8, "a")
    lease.take_over(0.9, "b")
    assert not lease.would_start_for("a"), "it has taken over again, and not beaten since"


def test_a_frame_moves_with_its_second_heartbeat_and_one_that_was_started_anew_has_to_move_again() -> None:
    lease, block, word = Lease(1.0), ("a", "a", 4001, 0, 26), ("a", "a", 4001, 4, 2)
    lease.observe(0.0, 7, "a", block)
    lease.start(0.0, "a")
    for now_s, heartbeat, channel, has_moved in (
        (0.1, 7, block, False),
        (0.2, 8, word, False),
        (0.3, 7, block, False),
        (0.4, 9, block, True),
    ):
        lease.observe(now_s, heartbeat, "a", channel)
        assert lease.has_moved is has_moved
    lease.start(0.5, "a")
    assert not lease.has_moved


def test_of_a_master_with_two_connections_the_last_heartbeat_is_none_once_more_by_the_other_one() -> None:
    """That one had brought the heartbeat before it last."""
    lease, here, there = Lease(0.5), ("a", "a", 4001, 4, 2), ("a", "a", 4002, 4, 2)
    for now_s, heartbeat, channel in ((10.0, 7, here), (10.1, 8, there), (10.2, 9, here), (10.3, 9, there)):
        lease.observe(now_s, heartbeat, "a", channel)
    assert lease.age_s(10.4) == pytest.approx(0.2)


def test_a_master_s_last_heartbeat_is_none_once_more_in_a_frame_that_comes_for_the_first_time() -> None:
    """Another one's stands by then."""
    lease = Lease(0.5)
    lease.observe(10.0, 7, *block_of("plc"))
    lease.observe(10.2, 4711, *block_of("page"))
    lease.observe(10.4, 7, "plc", ("plc", "plc", 4001, 4, 2))
    assert lease.age_s(11.0) == pytest.approx(0.8)


def test_a_heartbeat_that_toggles_in_a_frame_that_was_only_refused_so_far_is_a_beat() -> None:
    """Its other value stood, by another frame of its program: it was told that it stands still, for good."""
    lease, block = Lease(0.35), ("plc", "10.0.0.5", 4001, 0, 10)
    lease.hear_refused(1.0, 1, "plc", block)
    lease.observe(1.1, 0, "plc", ("plc", "10.0.0.5", 4001, 4, 2))
    lease.start(1.12, "plc")
    lease.stop(1.15, "page")
    assert not lease.would_have_beaten_since(-inf, 1.2, 1, "plc", block)
    assert lease.would_have_beaten_since(-inf, 1.2, 0, "plc", block)
