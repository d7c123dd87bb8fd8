"""Two threads give the answers of one, in order; what goes wrong in either is told."""

import threading

import pytest

from gateway.side_by_side import one_after_another, side_by_side


@pytest.mark.parametrize("count", [0, 1, 2, 3, 8])
def test_answers_come_in_the_order_of_the_questions(count):
    assert side_by_side(lambda item: item * item, range(count)) == [item * item for item in range(count)]


def test_two_threads_work_at_once():
    both = threading.Barrier(2, timeout=10.0)
    assert len(set(side_by_side(lambda _: (both.wait(), threading.get_ident())[1], [1, 2]))) == 2


def test_a_call_within_a_call_waits_for_nobody():
    table = side_by_side(lambda row: side_by_side(lambda column: row * column, [1, 2, 3]), [1, 2, 3])
    assert table == [[1, 2, 3], [2, 4, 6], [3, 6, 9]]


@pytest.mark.parametrize("bad", [0, 1, 2])
def test_what_fails_in_either_thread_fails(bad):
    def divide(item):
        return 1 // (item - bad)

    with pytest.raises(ZeroDivisionError):
        side_by_side(divide, [0, 1, 2])


def test_who_must_not_be_felt_uses_one_thread():
    with one_after_another():
        assert set(side_by_side(lambda _: threading.get_ident(), range(6))) == {threading.get_ident()}
