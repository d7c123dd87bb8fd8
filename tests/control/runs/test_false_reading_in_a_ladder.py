"""One false reading of the load cell, by a disturbed digit or a spike, spoils no ladder: not at rest, not on a stair."""

from dataclasses import replace
from functools import cache

import pytest

from gateway.control.runs.ladder_run import LadderRow
from gateway.devices.messages import ForceSample
from tests.control.bench import Bench
from tests.control.runs.test_ladder_run import SHORT, roomy, rows_of

AT_REST_S, ON_A_STAIR_S, NEAR_THE_TOP_S = 0.8, 5.3, 10.0


@cache
def clean(every_ms: int) -> list[LadderRow]:
    return rows_of(slow(every_ms), SHORT)


def slow(every_ms: int) -> Bench:
    control = roomy()
    bench = Bench(replace(control, supervision=replace(control.supervision, sample_timeout_s=0.25)), seed=3)
    bench.sample_every_ms = every_ms
    return bench


@pytest.mark.sampled
@pytest.mark.parametrize("at_s", [AT_REST_S, ON_A_STAIR_S, NEAR_THE_TOP_S])
@pytest.mark.parametrize("said_n", [58.0, -20.0])
@pytest.mark.parametrize("every_ms", [10, 100])
def test_a_ladder_goes_on_as_if_it_had_not_been(every_ms: int, said_n: float, at_s: float) -> None:
    bench, left_n = slow(every_ms), [said_n]

    def spoil(sample: ForceSample) -> ForceSample:
        if not left_n or bench.now_s < at_s:
            return sample
        return replace(sample, raw=left_n[0], force_n=left_n.pop())

    bench.alter_sample = spoil
    rows = rows_of(bench, SHORT)
    assert not left_n
    assert [row.stair for row in rows] == [row.stair for row in clean(every_ms)]
    assert all(row.settled for row in rows)
    assert not [event for event in bench.events if event.startswith("A350")]
    off_n = max(abs(row.force_n - before.force_n) for row, before in zip(rows, clean(every_ms), strict=True))
    assert off_n < 0.3
    assert rows[0].rest_n == pytest.approx(0.0, abs=0.1)
