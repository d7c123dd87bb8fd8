"""What a request of a local socket may be, and what its answer is: bounded, and JSON by its standard."""

import json
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest

from gateway.processes.json_socket.messages import (
    encode_answer,
    error_answer,
    has_huge_number,
    refuse_constant,
    why_path_too_long,
    why_too_large,
)
from gateway.processes.json_socket.server import JsonLineServer


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


@pytest.mark.parametrize("number", ["9" * 4299, "-" + "1" * 601, "0." + "3" * 700])
def test_a_number_of_very_many_digits_is_told_before_it_is_read(number: str) -> None:
    assert has_huge_number(f'{{"do": "x", "a": [1, {number}]}}'.encode())


def test_the_longest_numbers_that_mean_something_are_read() -> None:
    request = {"do": "modbus", "pdu": "0" * 506, "a": [-1.7976931348623157e308] * 3000}
    assert not has_huge_number(json.dumps(request).encode())


def test_a_server_answers_a_huge_number_without_asking_its_handler(tmp_path: Path) -> None:
    asked: list[object] = []

    def take(request: dict[str, Any]) -> dict[str, Any]:
        asked.append(request)
        return {}

    server = JsonLineServer(tmp_path / "s.sock", {"x": take})
    answer = server.answer(b'{"do": "x", "a": ' + b"9" * 4000 + b"}\n")
    assert isinstance(answer, bytes)
    assert b"more digits" in answer
    assert not asked


def test_a_path_has_as_many_bytes_as_an_address_and_a_sentence_no_page() -> None:
    assert why_path_too_long(Path("ä" * 53 + "x")) == ""
    assert why_path_too_long(Path("ä" * 54)).startswith("108 bytes of path, a socket takes 107")
    assert error_answer("x" * 500)["error"] == "x" * 500
    assert error_answer("x" * 501)["error"] == "x" * 500 + " ..."
