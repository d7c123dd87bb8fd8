"""`recordings`: what has been recorded and what happened in it, a picture of it, getting it out as CSV or Parquet, which ones
stay and go, and which one is the rig's reference."""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from gateway.cli.command_line.byte_count import ByteCount
from gateway.cli.command_line.completion_words import complete_recording_numbers
from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.listed_number import ListedNumber
from gateway.cli.command_line.numbers import Quantity
from gateway.cli.errors import CliError, already_exists
from gateway.cli.options import StateChoice, json_option, state_options
from gateway.cli.recordings.named_recording import LAST, numbered_recording
from gateway.cli.subcommands import SubcommandGroup
from gateway.plain_file import exists
from gateway.processes import exit_codes
from gateway.processes.state_directory import RECORDINGS

if TYPE_CHECKING:
    from gateway.watch.reference_recording import ReferenceRecording


_WORKBOOKS: Final = frozenset((".xlsx", ".xlsm", ".xls", ".ods"))
EXAMPLES = (
    "recordings list",
    "recordings show 1",
    "recordings plot 1 -o run.svg",
    "recordings keep 1",
    "recordings export 1 --csv -o run.csv",
    "recordings prune --dry-run --days 30",
)
_number = click.argument(
    "number", metavar="N|last", type=ListedNumber("recordings", word=LAST), shell_complete=complete_recording_numbers
)
_yes = click.option("--yes", is_flag=True, help="Do not ask.")


@click.group(name="recordings", cls=SubcommandGroup)
def command() -> None:
    """List, show, plot, keep and export recordings.

    Delete them, and choose the reference.
    """


@command.command(name="list")
@state_options
@json_option
def list_command(*, state: StateChoice, as_json: bool) -> None:
    """List the recordings of a state directory, and what happened in each."""
    from gateway.cli.diagnosis.progress_line import show_progress
    from gateway.cli.recordings.listing import facts_of, lines_of, marks_of, reference_name
    from gateway.recording.care.summaries import list_summaries

    directory = state.directory
    with show_progress("list"):
        summaries, reference = list_summaries(directory), reference_name(directory)
    marked = [(one, marks_of(Path(one["path"]), reference)) for one in summaries]
    if as_json:
        click.echo(json.dumps([facts_of(*one) for one in marked], indent=2))
        return
    if not marked:
        click.echo(f"no recordings in {directory / RECORDINGS}; force-gateway record on, or run --record, makes one")
        return
    click.echo("\n".join(line for one in marked for line in lines_of(*one)))


@command.command(name="show")
@_number
@state_options
@json_option
def show_command(*, number: int | str, state: StateChoice, as_json: bool) -> None:
    """Show recording N: what it is called, what happened in it, what it was made with."""
    from gateway.cli.recordings.listing import describe, facts_of, marks_of, reference_name
    from gateway.recording.care.summaries import summary_of

    path = numbered_recording(number, state.directory)
    summary = {"path": str(path), **summary_of(path)}
    marks = marks_of(path, reference_name(state.directory))
    if as_json:
        click.echo(json.dumps(facts_of(summary, marks), indent=2))
        return
    click.echo("\n".join(describe(summary, marks)))


@command.command(name="plot")
@_number
@click.option("-o", "--output", type=GivenPath(dir_okay=False), help="FILE.html or FILE.svg.")
@click.option("--force", is_flag=True, help="Overwrite the file.")
@state_options
def plot_command(*, number: int | str, output: Path | None, force: bool, state: StateChoice) -> None:
    """Draw recording N: forces and the command against time."""
    from gateway.cli.diagnosis.outputs import write_all
    from gateway.recording import read_recording
    from gateway.reports.recording_plot import recording_page, recording_svg, why_no_picture

    path = numbered_recording(number, state.directory)
    target = output or Path(f"recording-{path.stem}.html")
    draw = {".html": recording_page, ".svg": recording_svg}.get(target.suffix.lower())
    if draw is None:
        raise click.UsageError(f"{target}: a plot is FILE.html or FILE.svg")
    if exists(target) and not force:
        raise already_exists(target)
    recording = read_recording(path)
    if why := why_no_picture(recording):
        raise CliError(f"E403 recording {int(path.stem)} {why}", exit_codes.DATA)
    write_all({target: draw(recording)})
    click.echo(f"wrote {target}", err=True)


@command.command(name="keep")
@_number
@click.option("--no", "lets_go", is_flag=True, help="Keep it no longer.")
@state_options
def keep_command(*, number: int | str, lets_go: bool, state: StateChoice) -> None:
    """Keep recording N: neither `delete` nor the retention takes it."""
    from gateway.recording.care.keeping import keep_recording, let_recording_go

    path = numbered_recording(number, state.directory)
    (let_recording_go if lets_go else keep_recording)(path)
    click.echo(f"recording {int(path.stem)} is kept{' no longer' if lets_go else ''}")


@command.command(name="delete")
@click.argument("number", metavar="N", type=ListedNumber("recordings"), shell_complete=complete_recording_numbers)
@_yes
@state_options
def delete_command(*, number: int, yes: bool, state: StateChoice) -> None:
    """Delete recording N; not one that is kept, the reference, or one that is being recorded."""
    from gateway.cli.recordings.removal import delete_recording

    click.echo(f"deleted {delete_recording(state.directory, number, asks=not yes)}")


@command.command(name="prune")
@click.option("--dry-run", is_flag=True, help="Only say what would go.")
@click.option("--days", type=Quantity(0, above=True), help="Delete older ones  [default: as the rig says]")
@click.option(
    "--bytes",
    "most_bytes",
    type=ByteCount(),
    metavar="SIZE",
    help="Of all together (20G, 500MB)  [default: as the rig says]",
)
@_yes
@state_options
def prune_command(*, dry_run: bool, yes: bool, state: StateChoice, days: float | None, most_bytes: int | None) -> None:
    """Delete the oldest recordings, as the rig's `recordings: retention` says; the gateway does so every hour."""
    from gateway.cli.recordings.removal import prune_recordings, retention_of

    gone = prune_recordings(state.directory, retention_of(state, days, most_bytes), dry_run=dry_run, asks=not yes)
    for one in gone:
        click.echo(f"{'would delete' if dry_run else 'deleted'} {one.path}: {one.why}")
    if not gone:
        click.echo("nothing to delete")


@command.command(name="export")
@_number
@click.option("--csv", "form", flag_value="csv", help="CSV with # key: value lines (default).")
@click.option(
    "--parquet", "form", flag_value="parquet", help="Parquet with the facts as metadata (for -o FILE.parquet, too)."
)
@click.option("-o", "--output", type=GivenPath(allow_dash=True), help="File to write; - is stdout (CSV).")
@click.option("--force", is_flag=True, help="Overwrite the file.")
@state_options
def export_command(
    *, number: int | str, form: str | None, output: Path | None, force: bool, state: StateChoice
) -> None:
    """Export recording N (a number of `recordings list`), or the last one."""
    from gateway import recording as room

    form = _form_of(form, output)
    path = numbered_recording(number, state.directory)
    recording = room.read_recording(path)
    for note in recording.notes:
        click.echo(f"{recording.path}: {note}", err=True)
    if output == Path("-"):
        if form != "csv":
            raise click.UsageError("only CSV goes to stdout; give -o FILE")
        room.write_csv(recording, sys.stdout.buffer)
        return
    target = output or Path(room.export_name(recording, int(path.stem), form))
    if exists(target) and not force:
        raise already_exists(target)
    (room.export_csv if form == "csv" else room.export_parquet)(recording, target)
    click.echo(f"wrote {recording.rows} rows to {target}", err=True)


def _form_of(form: str | None, output: Path | None) -> str:
    """Return csv or parquet. UsageError where the file's name says another: what opens it goes by that."""
    ending = output.suffix.lower() if output else ""
    if ending in _WORKBOOKS:
        raise click.UsageError(f"{output}: an export is CSV or Parquet: a spreadsheet opens FILE.csv")
    named = {".csv": "csv", ".parquet": "parquet"}.get(ending)
    if form and named and form != named:
        raise click.UsageError(f"{output}: --{form} writes FILE.{form}")
    return form or named or "csv"


@command.command(name="reference")
@click.argument("recording", metavar="[RECORDING]", required=False)
@click.option("--none", "no_reference", is_flag=True, help="Have no reference any more.")
@state_options
@json_option
def reference_command(*, recording: str | None, no_reference: bool, state: StateChoice, as_json: bool) -> None:
    """Show the rig's reference recording, or make RECORDING (a number or a file) the reference.

    The residual watch reports what differs from it, and `diagnose NEW --against reference` compares with it.
    """
    from gateway.watch import reference_recording as reference

    if recording and no_reference:
        raise click.UsageError("RECORDING or --none, not both")
    if no_reference:
        was_there = reference.drop_reference_recording(state.directory)
        click.echo(json.dumps({"reference": None}) if as_json else "no reference" + (" any more" if was_there else ""))
        return
    if recording:
        _keep_reference(state, recording)
    known = reference.read_reference_recording(state.directory)
    click.echo(json.dumps({"reference": known and asdict(known)}) if as_json else _describe_reference(known))


def _keep_reference(state: StateChoice, name: str) -> None:
    """Make this recording the reference. CliError (65) for one that cannot describe a machine."""
    from gateway.cli.recordings.named_recording import recording_path
    from gateway.watch import reference_recording as reference

    path = recording_path(name, state.rig, state.path)
    if why := reference.why_no_reference(path):
        raise CliError(f"E523 {path} cannot be the reference: {why}", exit_codes.DATA)
    reference.keep_reference_recording(state.directory, path)
    if doubt := _doubt_of_machine(path, state):
        click.echo(f"{doubt}: if it shows another machine, `force-gateway recordings reference --none`", err=True)


def _doubt_of_machine(path: Path, state: StateChoice) -> str:
    """Return why a reference may show another machine than this rig's, as the begin of a sentence; empty where it does not."""
    from gateway.recording import read_table
    from gateway.service.supervisor.run_options import stem_of

    named, meant = read_table(path).header.get("rig"), stem_of(state.rig)
    if not named:
        return f"{path.name} does not say which rig it is of"
    return f"{path.name} is of rig {named}, and this is {meant}" if named != meant else ""


def _describe_reference(known: "ReferenceRecording | None") -> str:
    if known is None:
        return "no reference; force-gateway recordings reference RECORDING makes one, of the machine as it should be"
    why = "chosen" if known.is_chosen else f"the first good one with calibration {known.calibration}"
    return f"reference: {known.name}, {why}, kept {known.kept_utc}"
