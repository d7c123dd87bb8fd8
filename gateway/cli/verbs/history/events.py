"""`events`: what the gateway has said, from its state directory; it need not be running."""

import json
import time
from collections.abc import Callable
from typing import Any, Final

import click

from gateway.cli.command_line.completion_words import complete_codes
from gateway.cli.command_line.known_codes import entries_of
from gateway.cli.command_line.since_option import since_option
from gateway.cli.errors import no_state_directory
from gateway.cli.options import StateChoice, json_option, state_options
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
def command(*, follow: bool, as_json: bool, state: StateChoice, **filters: Any) -> None:
    """Show what the gateway has said: faults, refusals, restarts.

    Time (UTC), severity, cause, code, sentence. `force-gateway explain CODE` says what to do.
    """
    directory, wanted = state.directory, _event_filter(**filters)
    if not directory.is_dir():
        raise no_state_directory(directory)
    with EventReader(directory) as reader:
        _show(reader, wanted, follow, as_json)


def _event_filter(after: str, severity: str, codes: tuple[str, ...]) -> Callable[[EventRecord], bool]:
    severities = SEVERITIES[SEVERITIES.index(severity) :]
    chosen = {entry.code for code in codes for entry in entries_of(code)}

    def is_wanted(event: EventRecord) -> bool:
        return event.time >= after and event.severity in severities and (not chosen or event.code in chosen)

    return is_wanted


def _show(reader: EventReader, wanted: Callable[[EventRecord], bool], follow: bool, as_json: bool) -> None:
    events = reader.read_stored()
    try:
        while True:
            for event in filter(wanted, events):
                click.echo(json.dumps(event._asdict()) if as_json else format_event(event))
            if not follow:
                return
            time.sleep(_POLL_S)
            events = reader.read_new()
    except KeyboardInterrupt:
        return
