"""`recordings`: what has been recorded, getting it out as CSV or Parquet, and which one is the rig's reference."""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gateway.cli.errors import already_exists
from gateway.cli.options import StateChoice, json_option, state_options

if TYPE_CHECKING:
    from gateway.recording import RecordingEntry
    from gateway.watch.reference_recording import ReferenceRecording


EXAMPLES = ("recordings list", "recordings export 1 --csv -o run.csv")


@click.group(name="recordings")
def command() -> None:
    """List and export recordings, and choose the reference."""


@command.command(name="list")
@state_options
@json_option
def list_command(*, state: StateChoice, as_json: bool) -> None:
    """List the recordings of a state directory."""
    from gateway.recording import list_recordings

    directory = state.directory
    entries = list_recordings(directory)
    if as_json:
        click.echo(json.dumps([_facts(entry) for entry in entries], indent=2))
        return
    if not entries:
        click.echo(f"no recordings in {directory / 'recordings'}; force-gateway record on, or run --record, makes one")
        return
    click.echo("  ID  started (UTC)             rig              duration      rows       size")
    for entry in entries:
        click.echo(_line(entry))


def _facts(entry: "RecordingEntry") -> dict[str, object]:
    return {
        "id": entry.number,
        "path": str(entry.path),
        "started_utc": entry.header.get("started_utc"),
        "rig": entry.header.get("rig"),
        "calibration": entry.header.get("calibration"),
        "plant": (entry.header.get("plant_in_use") or {}).get("number"),
        "rows": entry.rows,
        "duration_s": round(entry.duration_s, 6),
        "size_bytes": entry.size_bytes,
        "truncated": entry.truncated,
        "fault": entry.fault or None,
    }


def _line(entry: "RecordingEntry") -> str:
    if entry.fault:
        return f"{entry.number:>4}  unreadable: {entry.fault}"
    torn = "  torn tail dropped" if entry.truncated else ""
    return (
        f"{entry.number:>4}  {entry.header.get('started_utc', ''):<24}  {entry.header.get('rig', ''):<14} "
        f"{entry.duration_s:>8.1f} s {entry.rows:>9} {entry.size_bytes / 1e3:>7.1f} kB{torn}"
    )


@command.command(name="export")
@click.argument("number", metavar="ID", type=click.IntRange(min=1))
@click.option("--csv", "form", flag_value="csv", default="csv", help="CSV with # key: value lines (default).")
@click.option("--parquet", "form", flag_value="parquet", help="Parquet with the facts as metadata.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path, allow_dash=True), help="File to write; - is stdout (CSV)."
)
@click.option("--force", is_flag=True, help="Overwrite the file.")
@state_options
def export_command(*, number: int, form: str, output: Path | None, force: bool, state: StateChoice) -> None:
    """Export recording ID (a number of `recordings list`)."""
    from gateway import recording as room

    recording = room.read_recording(room.find_recording(state.directory, number))
    for note in recording.notes:
        click.echo(f"{recording.path}: {note}", err=True)
    if output == Path("-"):
        if form != "csv":
            raise click.UsageError("only CSV goes to stdout; give -o FILE")
        room.write_csv(recording, sys.stdout.buffer)
        return
    target = output or Path(f"{recording.header.get('rig', 'recording')}-{number:04d}.{form}")
    if target.exists() and not force:
        raise already_exists(target)
    (room.export_csv if form == "csv" else room.export_parquet)(recording, target)
    click.echo(f"wrote {recording.rows} rows to {target}", err=True)


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
    from gateway.cli.diagnosis.inputs import recording_path
    from gateway.cli.errors import CliError
    from gateway.processes import exit_codes
    from gateway.watch import reference_recording as reference

    path = recording_path(name, state.rig, state.path)
    if why := reference.why_no_reference(path):
        raise CliError(f"E523 {path} cannot be the reference: {why}", exit_codes.DATA)
    reference.keep_reference_recording(state.directory, path)


def _describe_reference(known: "ReferenceRecording | None") -> str:
    if known is None:
        return "no reference; force-gateway recordings reference RECORDING makes one, of the machine as it should be"
    why = "chosen" if known.is_chosen else f"the first good one with calibration {known.calibration}"
    return f"reference: {known.name}, {why}, kept {known.kept_utc}"
