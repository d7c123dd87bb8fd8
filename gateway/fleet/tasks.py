"""Which recordings a fleet's work is about, and what one row is.

A task is one file: its path, its cell and date by the folders that it lies in (`cell=7/date=2026-11-23/press.parquet`, as
Hive and Parquet's own tools name them), and the hash of its bytes, by which a row that was computed before is known again.
"""

import glob
import re
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import date
from hashlib import file_digest
from pathlib import Path
from typing import Any, Final

from gateway.plain_file import exists, is_file, tell_place_and_refusal
from gateway.recording.errors import RecordingError

Row = dict[str, Any]
"""One recording's answer: values that JSON has, by column. Columns common to all: file, cell, date, sha256, value_n (what
is watched for drift, N), causes (list of {name, gain_n, ...}), error_code and error (both empty where it worked)."""

_KEY: Final = re.compile(r"([A-Za-z_][\w-]*)=(.+)")
_CODED: Final = re.compile(r"([EWA]\d{3}) (.+)", re.S)
_LONGEST_ERROR: Final = 500
INTERNAL: Final = "A499"
UNREADABLE: Final = "E403"


@dataclass(frozen=True, slots=True, order=True)
class Task:
    """path: as the glob found it; sha256: of the file, empty where it could not be read."""

    path: str
    cell: str
    date: str
    sha256: str

    @property
    def head(self) -> Row:
        """The columns that every row begins with."""
        return {"file": self.path, "cell": self.cell, "date": self.date, "sha256": self.sha256}


def find_tasks(patterns: Iterable[str]) -> list[Task]:
    """Return a task for each file that a pattern finds, in the order of their paths, nothing twice. A link that leads nowhere,
    as to a store that is not mounted, is one that cannot be read: left out, its day would be missing without a word."""
    # a pattern may be absolute, which Path.glob refuses
    found = {path for pattern in patterns for path in glob.glob(pattern, recursive=True)}  # noqa: PTH207
    return [_task_of(path) for path in sorted(found) if is_file(path) or not exists(path)]


def _task_of(path: str) -> Task:
    keys = {match[1]: match[2] for part in Path(path).parts[:-1] if (match := _KEY.fullmatch(part))}
    try:
        with Path(path).open("rb") as stream:
            own = file_digest(stream, "sha256").hexdigest()
    except OSError:
        own = ""
    return Task(path, keys.get("cell", ""), _spelt_one_way(keys.get("date", "")), own)


def _spelt_one_way(text: str) -> str:
    """Return a day with its dashes, for 20261101 is the same, and days are put in order as texts; what is no day as it is."""
    try:
        return date.fromisoformat(text).isoformat()
    except ValueError:
        return text


def error_row(task: Task, error: BaseException | str) -> Row:
    """Return the row of a recording that has no answer."""
    told = tell_place_and_refusal(error) if isinstance(error, OSError) else str(error)
    text = told or type(error).__name__
    match = _CODED.match(text)
    known = isinstance(error, (OSError, ValueError, RecordingError, str))
    code, sentence = match.groups() if match else (UNREADABLE if known else INTERNAL, text)
    return {**task.head, "error_code": code, "error": sentence.removeprefix(f"{task.path}: ")[:_LONGEST_ERROR]}
