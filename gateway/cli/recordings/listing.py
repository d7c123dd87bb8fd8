"""Recordings on the terminal, folded at its width: nothing is cut."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gateway.cli.command_line.folding import fold, fold_entry
from gateway.recording.care.keeping import is_being_recorded, is_kept
from gateway.recording.care.summaries import Summary


def marks_of(path: Path, reference: str) -> dict[str, bool]:
    """Return what is true of a recording at this moment. reference: the rig's, by its file's name."""
    try:
        recorded = is_being_recorded(path)
    except OSError:  # gone, or not ours to read
        recorded = False
    return {"kept": is_kept(path), "reference": path.name == reference, "being_recorded": recorded}


def reference_name(state: Path) -> str:
    """Return the file name of the rig's reference; empty where there is none."""
    from gateway.watch.reference_recording import read_reference_recording

    reference = read_reference_recording(state)
    return reference.name if reference else ""


def facts_of(summary: Summary, marks: dict[str, bool]) -> dict[str, Any]:
    """Return what --json has of a recording."""
    same = ("path", "name", "note", "started_utc", "rig", "calibration", "plant", "rows", "size_bytes", "truncated")
    return {
        "id": summary["number"],
        **{key: summary[key] for key in same},
        "duration_s": round(summary["duration_s"], 6),
        "fault": summary["fault"] or None,
        "happened": summary["happened"],
        **summary["facts"],
        **marks,
    }


def lines_of(summary: Summary, marks: dict[str, bool]) -> list[str]:
    """Return the lines of a list for one recording."""
    return fold_entry(summary["number"], _sentences(summary, marks))


def describe(summary: Summary, marks: dict[str, bool]) -> list[str]:
    """Return everything that is known of one recording, a line for each fact."""
    told = {
        "name": summary["name"],
        "note": summary["note"],
        "unreadable": summary["fault"],
        "started": _moment(summary["started_utc"]),
        "duration": "" if summary["fault"] else f"{_duration(summary['duration_s'])}, {summary['rows']} rows",
        "what happened": summary["happened"],
        "rig": summary["rig"],
        "calibration": summary["calibration"],
        "plant": summary["plant"],
        "file": f"{summary['path']} ({summary['size_bytes'] / 1e3:.1f} kB)",
        "is": ", ".join(mark.replace("_", " ") for mark, holds in marks.items() if holds),
    }
    lines = []
    for key, value in told.items():
        if value not in ("", None):
            lines += fold(f"{key + ':':<15}{value}", 15)
    return lines


def _sentences(summary: Summary, marks: dict[str, bool]) -> Iterator[str]:
    if summary["fault"]:
        yield f"unreadable: {summary['fault']}"
        return
    parts = [
        _moment(summary["started_utc"]),
        summary["rig"] or "",
        _duration(summary["duration_s"]),
        f"{summary['rows']} rows",
        f"{summary['size_bytes'] / 1e3:.1f} kB",
        *(mark.replace("_", " ") for mark, holds in marks.items() if holds),
        "torn tail dropped" if summary["truncated"] and not marks["being_recorded"] else "",
    ]
    yield "  ".join(part for part in parts if part)
    if said := ": ".join(part for part in (summary["name"], summary["note"]) if part):
        yield said
    yield summary["happened"] or "no rows yet"


def _moment(started_utc: object) -> str:
    return f"{str(started_utc)[:19].replace('T', ' ')} UTC" if started_utc else ""


def _duration(duration_s: float) -> str:
    if duration_s < 120.0:
        return f"{duration_s:.1f} s"
    minutes, seconds = divmod(round(duration_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {seconds:02d} s"
