"""One notation of durations for every verb."""

import time
from collections.abc import Iterator

import click
import pytest

from gateway.cli.command_line.duration import parse_duration_s
from gateway.cli.command_line.since_option import _parse_since


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


@pytest.fixture
def far_east(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TZ", "JST-9")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.usefixtures("far_east")
@pytest.mark.parametrize(
    ("given", "utc"),
    [
        ("2026-11-22T11:55", "2026-11-22T11:55:00.000Z"),
        ("2026-11-22T11:55:00Z", "2026-11-22T11:55:00.000Z"),
        ("2026-11-22T11:55+01:00", "2026-11-22T10:55:00.000Z"),
    ],
)
def test_a_time_without_a_zone_is_utc_wherever_the_machine_stands(given: str, utc: str) -> None:
    """As the lines that it is compared with: in Japan the last nine hours would have been left out."""
    assert _parse_since(click.Context(click.Command("events")), click.Option(["--since"]), given) == utc
