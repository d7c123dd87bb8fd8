"""What is no whole number is told what is allowed, and in whose words."""

import click
import pytest

from gateway.cli.command_line.byte_count import ByteCount

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


@pytest.mark.parametrize(
    ("given", "size"),
    [("17", 17), ("500k", 500_000), ("1MB", 10**6), ("2 G", 2 * 10**9), ("1.5kB", 1500), ("3T", 3 * 10**12), ("0", 0)],
)
def test_a_size_is_counted_in_thousands_as_on_the_label_of_a_disk(given: str, size: int) -> None:
    """20 GB that were 21.5 would fill a disk of 21."""
    assert ByteCount().convert(given, None, None) == size


@pytest.mark.parametrize("given", ["", "k", "-1", "1e6", "1 KiB", "٣k"])
def test_what_is_no_size_is_refused(given: str) -> None:
    with pytest.raises(click.BadParameter, match="is no size such as 500k"):
        ByteCount().convert(given, None, None)
