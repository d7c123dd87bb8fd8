"""What is no whole number is told what is allowed, and in whose words."""

import pytest

OPTIONS = (
    ("fleet fit x --workers", "1 .. 256"),
    ("certs here --days", "1 .. 7300"),
    ("upload demo --slot", "0 .. 7"),
    ("read state --unit", "0 .. 255"),
    ("read state --baud", "at least 0"),
    ("calibrate --groups", "1 .. 100"),
)


@pytest.mark.parametrize(("words", "allowed"), OPTIONS)
@pytest.mark.parametrize("given", ["1,5", "two", "1e999", "nan"])
def test_what_is_no_whole_number_is_told_the_bounds(words: str, allowed: str, given: str, call) -> None:
    """'two' is not a valid integer range, said a library."""
    answer = call(*words.split(), given)
    assert (answer.exit_code, f"{given} is not a whole number: allowed {allowed}\n" in answer.stderr) == (2, True)


def test_a_number_of_thousands_of_digits_is_cut(call) -> None:
    answer = call("read", "state", "--unit", "9" * 5000)
    assert answer.exit_code == 2 and f": {'9' * 40} is not a whole number: allowed 0 .. 255\n" in answer.stderr


@pytest.mark.parametrize(("words", "allowed"), OPTIONS)
def test_one_beyond_the_bounds_is_told_them(words: str, allowed: str, call) -> None:
    answer = call(*words.split(), "-1")
    assert answer.exit_code == 2 and f": -1: allowed {allowed}\n" in answer.stderr
