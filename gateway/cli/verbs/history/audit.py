"""`audit`: who wrote what of consequence, and whether anybody has altered the record; the gateway need not be running."""

import json
from typing import Any

import click

from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.cli.command_line.since_option import YoungerRecords, since_option
from gateway.cli.errors import CliError, no_state_directory
from gateway.cli.options import StateChoice, json_option, state_options
from gateway.cli.subcommands import SubcommandGroup
from gateway.plain_file import exists, is_directory, other_kind
from gateway.processes import exit_codes
from gateway.processes.state_directory import AUDIT

EXAMPLES = ("audit show --since 1h", "audit verify")


@click.group(name="audit", cls=SubcommandGroup)
def command() -> None:
    """Show and verify the record of writes."""


@command.command(name="show")
@since_option
@click.option("--peer", metavar="TEXT", help="Only of peers with this in their address or certificate's name.")
@json_option
@state_options
def show_command(*, after: str, peer: str | None, as_json: bool, state: StateChoice) -> None:
    """Show who has written what, accepted and refused.

    Number, time (UTC), result, peer and role, register, old and new value. What came in streams is summed up: how many
    writes in how many seconds, and the values between which they were. A line that was changed is left out, and told of.
    """
    _directory_of(state)
    left_out: list[None] = []
    younger = YoungerRecords(after)
    for record in read_audit(state.directory, lambda: left_out.append(None)):
        if younger.includes(str(record.get("time", ""))) and (peer is None or peer in str(record.get("peer", ""))):
            click.echo(json.dumps(record) if as_json else format_record(record))
    if left_out:
        lines = "1 line was" if len(left_out) == 1 else f"{len(left_out)} lines were"
        click.echo(f"E170 {lines} changed or damaged, and left out: `force-gateway audit verify` says where", err=True)


@command.command(name="verify")
@json_option
@state_options
def verify_command(*, as_json: bool, state: StateChoice) -> None:
    """Follow the chain of hashes; exit code 1 at its first break.

    A changed byte, and a line removed, added or moved are found; what a power cut leaves behind the last line that was
    on the disk for certain (audit/head names it) is told apart. Who may write the directory can write a whole new
    chain: keep the last hash elsewhere where that matters.
    """
    _directory_of(state)
    try:
        verdict = verify_audit(state.directory)
    except FileNotFoundError:
        raise _no_audit(state) from None
    held = "1 line holds" if verdict.lines == 1 else f"{verdict.lines} lines hold"
    if as_json:
        broken = verdict.broken._asdict() if verdict.broken else None
        facts = {"lines": verdict.lines, "last": verdict.end._asdict(), "broken": broken, "notes": verdict.notes}
        click.echo(json.dumps(facts, indent=2))
    elif not verdict.broken:
        click.echo(f"{held}, up to line {verdict.end.number}, sha256 {verdict.end.sha256}")
    for note in () if as_json else verdict.notes:
        click.echo(note)
    if verdict.broken:
        where = f"{verdict.broken.file} line {verdict.broken.line}" if verdict.broken.line else verdict.broken.file
        raise CliError(f"E170 {where} {verdict.broken.text}; before it {held if verdict.lines else 'nothing holds'}")


def format_record(record: dict[str, Any]) -> str:
    """Return one record for people; as JSON where it is none of ours, though its hash fits."""
    try:
        return _in_words(record)
    except (TypeError, ValueError, KeyError):
        return json.dumps(record)


def _in_words(record: dict[str, Any]) -> str:
    who = f"{record.get('peer', '')} {record.get('role', '')}".strip()
    words = [str(record.get("n", "")).rjust(6), record.get("time", ""), f"{record.get('result', '-'):<8}", who]
    words.append(str(record.get("what", "")))
    old, new = record.get("old"), record.get("new")
    is_owner = record.get("what") == "owner" and "count" not in record  # the one of which None is a value: nobody
    if is_owner or not isinstance(old, str | None):
        unit = f" {record['unit']}" if "unit" in record else ""
        words.append(f"{_value(old)} -> {_value(new)}{unit}")
    elif new is not None and not record.get("text"):
        words.append(f"{f'{old} -> ' if old is not None else ''}{_value(new)}")
    if "count" in record and "seconds" in record:
        span = f", {_value(record['min'])} .. {_value(record['max'])}" if record.get("min") is not None else ""
        words.append(f"({record['count']} writes in {record['seconds']:g} s{span})")
    if text := record.get("text"):
        words.append(str(text))
    extra = {key: record[key] for key in ("rig", "calibration", "plant", "version", "after") if record.get(key)}
    words += [f"{key} {value}" for key, value in extra.items()]
    return "  ".join(word for word in words if word)


def _value(value: Any) -> str:
    return "nobody" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _directory_of(state: StateChoice) -> None:
    if not is_directory(state.directory):
        raise no_state_directory(state.directory)
    place = state.directory / AUDIT
    if is_directory(place):
        return
    if not (exists(place) or place.is_symlink()):
        raise _no_audit(state)
    kind = (other_kind(place) or "a file") if exists(place) else "a link to what is not there"
    raise CliError(f"E106 {place}: it is {kind}, and no directory: a gateway can keep no audit there", exit_codes.DATA)


def _no_audit(state: StateChoice) -> CliError:
    return CliError(f"E106 {state.directory}: no audit there yet; a gateway that runs keeps one", exit_codes.DATA)
