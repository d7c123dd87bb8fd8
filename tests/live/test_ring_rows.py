"""Rows of the ring as columns: each new one once, and never more than asked for."""

import os
from collections.abc import Iterator

import pytest

from gateway.live.ring_rows import RingRows
from gateway.recording.ring import RingReader, SampleRing


@pytest.fixture
def descriptor() -> Iterator[int]:
    number = os.memfd_create("ring")
    yield number
    os.close(number)


def test_each_new_row_comes_once_and_the_newest_are_kept_where_there_are_too_many(descriptor: int) -> None:
    rows = RingRows(descriptor)
    assert rows.newest(5) == {} and rows.fresh(5) == {}, "before control has laid the ring out"
    ring = SampleRing(descriptor, ("time_s", "force_n"), 16)
    seen: list[float] = []
    for number in range(40):
        ring.append((float(number), 2.0 * number))
        if number % 3 == 0:
            seen += list(rows.fresh(10).get("time_s", ()))
    assert seen == [float(number) for number in range(39)]
    for number in range(40, 50):
        ring.append((float(number), 2.0 * number))
    assert list(rows.fresh(4)["force_n"]) == [90.0, 92.0, 94.0, 96.0]
    assert rows.fresh(4) == {}
    assert list(rows.newest(2)["time_s"]) == [47.0, 48.0]
    rows.close()
    ring.close()


def test_behind_another_ring_its_rows_are_new(descriptor: int) -> None:
    """Control was started again with other columns: its ring begins at 0."""
    ring = SampleRing(descriptor, ("time_s", "force_n"), 16)
    for number in range(12):
        ring.append((float(number), 0.0))
    rows = RingRows(descriptor)
    assert len(rows.fresh(16)["time_s"]) == 11
    rows.close()
    ring.close()
    os.ftruncate(descriptor, 0)
    ring = SampleRing(descriptor, ("time_s", "force_n"), 16)
    rows._ring = RingReader(descriptor)
    for number in range(4):
        ring.append((100.0 + number, 0.0))
    assert list(rows.fresh(16)["time_s"]) == [100.0, 101.0, 102.0]
    rows.close()
    ring.close()
