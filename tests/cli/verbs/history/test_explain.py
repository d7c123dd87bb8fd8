"""Every code that a user can meet can be explained, offline."""

import json

import pytest

from gateway.codes.all_codes import CATALOGUE


@pytest.mark.parametrize("code", "E101 E102 E103 E110 E111 E120 W201 W202 W203 W204 A301 A302 A303 A310 E401".split())
def test_the_codes_of_the_first_hour_are_there(code: str, call) -> None:
    answer = call("explain", code)
    assert answer.exit_code == 0
    assert answer.output.startswith(code)
    for heading in ("seen", "probably", "do"):
        assert f"\n  {heading} " in answer.output


@pytest.mark.parametrize(("word", "code"), [("e110", "E110"), ("over-force", "A313"), ("CELL_LOST", "A318")])
def test_codes_are_found_by_name_and_in_any_case(word: str, code: str, call) -> None:
    assert call("explain", word).output.startswith(code)


def test_without_a_code_all_are_listed(call) -> None:
    lines = call("explain").output.splitlines()
    assert len(lines) == len(CATALOGUE)
    assert lines[0].startswith("E101")


def test_an_unknown_code_gets_a_proposal(call) -> None:
    answer = call("explain", "E119")
    assert answer.exit_code == 2
    assert "did you mean E1" in answer.stderr
    assert call("explain", "nonsense").exit_code == 2


def test_json_has_the_same_fields(call) -> None:
    assert set(json.loads(call("explain", "A301", "--json").output)[0]) == {
        "code",
        "title",
        "seen",
        "probably",
        "do",
        "name",
    }
