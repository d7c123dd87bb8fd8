"""Sentences with several open texts: which part is whose, and that no line takes long to be refused."""

import time

import pytest

from gateway.devices.template import compile_template
from gateway.devices.template_codecs.unread_line import _other_unit

FOUR = "{date:s} {time:s} {id:s} {gross:s} {force:.2f}kg"


def test_texts_part_where_their_marks_are() -> None:
    values = {"date": "27-11", "time": "06:43", "id": "7", "gross": "G", "force": 12.5}
    assert compile_template(FOUR).decode(b"27-11 06:43 7 G 12.50kg") == values
    assert compile_template(FOUR).encode(values) == b"27-11 06:43 7 G 12.50kg"


def test_the_last_two_texts_may_hold_the_mark_behind_them() -> None:
    decoded = compile_template("{id:s} {gross:s} {force:.2f}").decode(b"7 GROSS WT 12.50")
    assert decoded == {"id": "7", "gross": "GROSS WT", "force": 12.5}
    decoded = compile_template(FOUR).decode(b"27-11 06:43 7 GROSS WT 12.50kg")
    assert decoded == {"date": "27-11", "time": "06:43", "id": "7", "gross": "GROSS WT", "force": 12.5}


def test_another_unit_behind_several_texts_is_told() -> None:
    assert _other_unit(compile_template(FOUR), b"27-11 06:43 7 G 12.50lb") == ("lb", "kg")


@pytest.mark.parametrize("line", [b" " * 128, b"a " * 64, b" 1" * 64])
def test_no_line_takes_long_to_be_refused(line: bytes) -> None:
    """Each way to part 128 blanks was tried: 300 ms, in which the guardian takes the loop for dead."""
    template, took_s = compile_template(FOUR), []
    for _ in range(3):
        began_s = time.process_time()
        assert template.decode(line) is None
        assert _other_unit(template, line[:80]) is None
        took_s.append(time.process_time() - began_s)
    assert min(took_s) < 0.02
