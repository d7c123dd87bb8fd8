"""What a request of a local socket may be, and what its answer is: bounded, and JSON by its standard."""

import json
from math import inf, nan
from typing import Any

import pytest

from gateway.processes.json_socket.messages import encode_answer, refuse_constant, why_too_large


def nested(depth: int) -> Any:
    value: Any = 1
    for _ in range(depth):
        value = [value]
    return value


@pytest.mark.parametrize(("depth", "is_told"), [(1, False), (9, False), (10, True), (500, True)])
def test_a_request_may_be_nested_so_deep_and_no_deeper(depth: int, is_told: bool) -> None:
    assert bool(why_too_large(nested(depth))) is is_told


@pytest.mark.parametrize(("each", "is_told"), [(900, False), (1100, True)])
def test_the_values_of_a_request_count_together_wherever_they_stand(each: int, is_told: bool) -> None:
    request = {"a": [0] * each, "b": [[0] * each, [[0] * each]]}
    assert bool(why_too_large(request)) is is_told


def test_an_object_has_few_short_keys() -> None:
    assert not why_too_large({f"key {k}": 0 for k in range(64)})
    assert why_too_large({f"key {k}": 0 for k in range(65)})
    assert why_too_large([{"k" * 101: 0}])


@pytest.mark.parametrize("pack", [list, tuple, lambda values: {"in": values}, lambda values: {"in": [tuple(values)]}])
def test_what_is_no_number_is_null_wherever_it_stands(pack: Any) -> None:
    """JSON has no NaN: one in an answer would end its reader."""
    text = encode_answer({"all": pack([1.0, nan, inf])})
    json.loads(text, parse_constant=refuse_constant)
    assert text.count("null") == 2
