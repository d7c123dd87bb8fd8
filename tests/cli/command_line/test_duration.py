"""One notation of durations for every verb."""

import pytest

from gateway.cli.command_line.duration import parse_duration_s


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("10", 10.0),
        ("500ms", 0.5),
        ("90 s", 90.0),
        ("2min", 120.0),
        ("2m", 120.0),
        ("1.5h", 5400.0),
        (" .5d ", 43200.0),
    ],
)
def test_each_unit_is_taken_by_every_verb(text: str, seconds: float) -> None:
    assert parse_duration_s(text) == pytest.approx(seconds, rel=1e-12)


@pytest.mark.parametrize("text", ["", "s", "-1s", "1e3", "10 parsecs", "1.2.3", "2026-11-23", "٣s"])
def test_what_is_no_duration_is_none(text: str) -> None:
    assert parse_duration_s(text) is None
