"""`--since`: what is younger than a duration, or than a time."""

import time
from datetime import UTC, datetime

import click

from gateway.cli.command_line.duration import parse_duration_s
from gateway.processes.event import utc_text


class YoungerRecords:
    """Told of the records of a file in their order. Behind a first one of between then and now all are younger, whatever
    their times say: a clock that was set back gives them earlier ones. One of later than now is of a clock that was ahead
    once, and says nothing of those behind it. after: as the option gives it."""

    def __init__(self, after: str) -> None:
        self._after, self._now = after, utc_text(time.time())
        self._reads_on = False

    def includes(self, written: str) -> bool:
        """Decide whether a record of this time is younger."""
        self._reads_on = self._reads_on or self._after <= written <= self._now
        return self._reads_on or written >= self._after


def _parse_since(context: click.Context, parameter: click.Parameter, value: str | None) -> str:
    """Return the time that the option means, as events write it; empty where it is not given.

    value: a duration before now, such as 10m, 2h or 1.5d, or an ISO 8601 time (without a zone: UTC).
    """
    if value is None:
        return ""
    if not value.strip().isdecimal() and (ago_s := parse_duration_s(value)) is not None:  # a bare number may be a date
        return utc_text(max(0.0, time.time() - ago_s))
    try:
        moment = datetime.fromisoformat(value.strip())
        moment = moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)
        return utc_text(moment.timestamp())
    except (ValueError, OverflowError):
        raise click.BadParameter(f"{value} is neither 90s, 10m, 2h, 1d nor a time such as 2026-11-22T10:30") from None


since_option = click.option(
    "--since",
    "after",
    callback=_parse_since,
    metavar="10m|TIME",
    help="Only what is younger: 90s, 10m, 2h, 1d, or a time (UTC unless it says otherwise).",
)
