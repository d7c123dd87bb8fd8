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
