"""Recordings that go: one that somebody names, and those that the rig has no room for."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

from gateway.cli.command_line.questions import is_confirmed
from gateway.cli.errors import CliError
from gateway.cli.options import StateChoice, count_of
from gateway.cli.recordings.listing import reference_name
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.profiles.recordings_section import Retention
    from gateway.recording.care.keeping import Prunable


def delete_recording(state: Path, number: int, *, asks: bool) -> Path:
    """Delete one recording. CliError (65) where it must stay, or somebody says no."""
    from gateway.recording import find_recording
    from gateway.recording.care.keeping import delete_recording, why_protected

    path, reference = find_recording(state, number), reference_name(state)
    why = why_protected(path, reference)
    if not why and asks and not is_confirmed(f"delete recording {number} ({path})?"):
        raise CliError("nothing was deleted")
    if why := why or delete_recording(path, reference):
        raise CliError(f"E407 recording {number} was not deleted: {why}{_cure(why, path)}", exit_codes.DATA)
    return path


def _cure(why: str, path: Path) -> str:
    from gateway.recording import read_entry

    if "kept" in why:
        return f"; force-gateway recordings keep {int(path.stem)} --no lets it go"
    if "being recorded" not in why:
        return ""
    is_of_run = not read_entry(path).header.keys().isdisjoint(("ladder", "experiment"))
    return "; the run that makes it ends it" if is_of_run else "; force-gateway record off ends it"


def retention_of(state: StateChoice, days: float | None, most_bytes: int | None) -> "Retention":
    """Return what the options say, else the rig. CliError (78) where neither limits anything."""
    from gateway.profiles import read_rig
    from gateway.profiles.recordings_section import Retention

    given = Retention(days=days, bytes=most_bytes)
    retention = read_rig(state.rig).retention if given.is_unlimited else given
    if retention.is_unlimited:
        raise CliError(
            f"rig {state.rig} retains everything: give --days or --bytes, or have "
            "`recordings: {retention: {days: 30}}` in its file",
            exit_codes.CONFIGURATION,
        )
    return retention


def prune_recordings(state: Path, retention: "Retention", *, dry_run: bool, asks: bool) -> list["Prunable"]:
    """Delete what there is no room for, or only say what it would be; return it."""
    from gateway.calibrations.kept_ladders import kept_ladders
    from gateway.recording import recording_paths
    from gateway.recording.care.keeping import choose_prunable, prune_recordings

    reference, needed = reference_name(state), kept_ladders(state)
    chosen = choose_prunable(recording_paths(state), retention, reference, time.time(), needed)
    if dry_run or not chosen:
        return chosen
    if asks and not is_confirmed(f"delete {count_of(chosen, 'recording')}?"):
        raise CliError("nothing was deleted")
    return prune_recordings(state, retention, reference, needed)
