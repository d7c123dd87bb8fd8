"""The sample ring: what a reader sees is whole, in order and the newest, whatever the writer does meanwhile."""

import os
import struct
import subprocess
import sys
import time
from itertools import pairwise

import pytest

from gateway.recording.ring import CAPACITY, RingReader, SampleRing

COLUMNS = ("time_s", "force_n", "command_v")


@pytest.fixture
def descriptor():
    number = os.memfd_create("ring")
    yield number
    os.close(number)


def rows_of(data: bytes) -> list[tuple[float, ...]]:
    return list(struct.iter_unpack("<3d", data))


def filled(descriptor, rows, capacity=16):
    ring = SampleRing(descriptor, COLUMNS, capacity)
    for number in range(rows):
        ring.append((float(number), 2.0 * number, -float(number)))
    return ring


@pytest.mark.parametrize("written", range(40))
def test_a_reader_sees_the_newest_whole_rows_in_order(descriptor, written):
    filled(descriptor, written)
    reader = RingReader(descriptor)
    found = rows_of(reader.newest(100))
    assert reader.rows_written == written
    assert reader.columns == COLUMNS
    newest = max(0, written - 1)
    assert [row[0] for row in found] == [float(k) for k in range(max(0, written - 15), newest)]
    assert all(row == (row[0], 2.0 * row[0], -row[0]) for row in found)
    assert rows_of(reader.newest(3)) == found[-3:]


def test_a_restarted_writer_goes_on_behind_what_is_there(descriptor):
    filled(descriptor, 10).close()
    ring = SampleRing(descriptor, COLUMNS, 16)
    ring.append((10.0, 0.0, 0.0))
    ring.append((11.0, 0.0, 0.0))
    assert [row[0] for row in rows_of(RingReader(descriptor).newest(100))] == [float(k) for k in range(11)]


def test_the_count_tells_of_a_row_that_is_there(descriptor):
    """The count goes up behind the row: a row that could not be written is never told of."""
    ring = filled(descriptor, 5)
    with pytest.raises(struct.error):
        ring.append((5.0,))
    assert RingReader(descriptor).rows_written == 5
    ring.append((5.0, 10.0, -5.0))
    assert RingReader(descriptor).rows_written == 6


def test_other_columns_begin_a_new_ring(descriptor):
    filled(descriptor, 10).close()
    SampleRing(descriptor, (*COLUMNS, "pressure_kpa"), 16)
    reader = RingReader(descriptor)
    assert (reader.rows_written, len(reader.columns)) == (0, 4)


def test_other_columns_that_take_as_much_room_begin_a_new_ring_too(descriptor):
    filled(descriptor, 5).close()
    ring = SampleRing(descriptor, ("time_s", "force_n", "temperature_c"), 16)
    reader = RingReader(descriptor)
    assert (reader.rows_written, reader.columns) == (0, ("time_s", "force_n", "temperature_c"))
    reader.close()
    ring.close()


def test_before_there_is_a_ring_a_reader_waits(descriptor):
    reader = RingReader(descriptor)
    assert (reader.is_ready, reader.rows_written, reader.newest(5)) == (False, 0, b"")
    filled(descriptor, 3)
    assert len(rows_of(reader.newest(5))) == 2


def test_a_reader_cannot_write(descriptor):
    filled(descriptor, 3)
    reader = RingReader(descriptor)
    assert reader.is_ready
    with pytest.raises(TypeError):
        reader._head[0] = 0


def test_a_reader_beside_a_fast_writer_gets_no_torn_row(descriptor):
    """Another process overwrites a small ring as fast as it can."""
    code = (
        "import sys; from gateway.recording.ring import SampleRing\n"
        f"ring = SampleRing({descriptor}, {COLUMNS!r}, 64)\n"
        "for n in range(200000): ring.append((float(n), 2.0 * n, -float(n)))\n"
    )
    SampleRing(descriptor, COLUMNS, 64)
    writer = subprocess.Popen([sys.executable, "-c", code], pass_fds=(descriptor,))
    reader, seen = RingReader(descriptor), 0
    while writer.poll() is None:
        rows = rows_of(reader.newest(64))
        assert all(row == (row[0], 2.0 * row[0], -row[0]) for row in rows)
        assert all(after[0] == before[0] + 1.0 for before, after in pairwise(rows))
        seen += len(rows)
    assert writer.wait() == 0
    assert seen


def test_a_row_costs_the_loop_microseconds(descriptor):
    ring = SampleRing(descriptor, tuple(f"c{k}" for k in range(13)))
    row = tuple(float(k) for k in range(13))
    best_s = 1.0
    for _ in range(20):
        began_s = time.perf_counter()
        for _ in range(200):
            ring.append(row)
        best_s = min(best_s, (time.perf_counter() - began_s) / 200)
    print(f"{best_s * 1e6:.2f} us a row, ring of {CAPACITY} rows")
    assert best_s < 20e-6
