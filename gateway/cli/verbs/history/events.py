"""`events`: what the gateway has said, from its state directory; it need not be running."""

import contextlib
import json
import select
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, Final

import click

from gateway.cli.command_line.completion_words import complete_codes
from gateway.cli.command_line.known_codes import entries_of
from gateway.cli.command_line.since_option import YoungerRecords, since_option
from gateway.cli.errors import no_state_directory
from gateway.cli.options import StateChoice, json_option, state_options
from gateway.plain_file import is_directory
from gateway.processes.event import SEVERITIES, EventRecord, format_event
from gateway.processes.event_file import EventReader

_POLL_S: Final = 0.25  # how often --follow reads the event file


EXAMPLES = ("events --since 10m", "events --severity warning --code W204")


@click.command()
@since_option
@click.option("--severity", type=click.Choice(SEVERITIES), default="info", help="This severity and worse.")
@click.option(
    "--code",
    "codes",
    multiple=True,
    metavar="CODE",
    shell_complete=complete_codes,
    help="Only this code or name, such as W204; may be repeated.",
)
@click.option("--follow", is_flag=True, help="Wait for more; Ctrl-C ends it.")
@json_option
@state_options
def command(*, after: str, follow: bool, as_json: bool, state: StateChoice, **filters: Any) -> None:
    """Show what the gateway has said: faults, refusals, restarts.

    Time (UTC), severity, cause, code, sentence. `force-gateway explain CODE` says what to do.
    """
    directory, wanted = state.directory, _event_filter(**filters)
    if not is_directory(directory):
        raise no_state_directory(directory)
    with EventReader(directory) as reader:
        _show(_events_of(reader, after, follow), wanted, as_json)


def _event_filter(severity: str, codes: tuple[str, ...]) -> Callable[[EventRecord], bool]:
    severities = SEVERITIES[SEVERITIES.index(severity) :]
    chosen = {entry.code for code in codes for entry in entries_of(code)}

    def is_wanted(event: EventRecord) -> bool:
        return event.severity in severities and (not chosen or event.code in chosen)

    return is_wanted


def _events_of(reader: EventReader, after: str, follow: bool) -> Iterator[EventRecord]:
    """Yield what is younger; what comes while we look is so, whatever the clock says meanwhile."""
    younger = YoungerRecords(after)
    yield from (event for event in reader.read_stored() if younger.includes(event.time))
    while follow and not _reader_goes_within(_POLL_S):
        yield from reader.read_new()


def _reader_goes_within(within_s: float) -> bool:
    """Wait, and return whether meanwhile or before whoever read our stdout has gone: behind `| grep -m1 A310` no further event
    may be wanted for days, and only a write would tell."""
    try:
        out = sys.stdout.fileno()
    except (AttributeError, OSError, ValueError):  # none, closed, or no file
        time.sleep(within_s)
        return False
    poll = select.poll()
    poll.register(out, 0)  # errors and hang-ups only
    return bool(poll.poll(within_s * 1e3))


def _show(events: Iterator[EventRecord], wanted: Callable[[EventRecord], bool], as_json: bool) -> None:
    with contextlib.suppress(KeyboardInterrupt):
        for event in filter(wanted, events):
            click.echo(json.dumps(event._asdict()) if as_json else format_event(event))
