"""Recordings as CSV and Parquet, for every other tool. Whole files or none, on the disk when they
have their name.

CSV follows the recording contract of the diagnosis: UTF-8, `# key: value` lines, one header row, one row per sample;
values that are not there read `nan`. What is no plain word or number in the header stands as JSON on its one line.
"""

import json
import re
from pathlib import Path
from typing import IO, Any

from gateway.extras import import_library, is_installed
from gateway.processes.durable_file import replacing_file
from gateway.recording.reader import Recording


def export_name(recording: Recording, number: int, form: str) -> str:
    """Return the usual name of the file. The rig of a foreign recording may have any name, a path elsewhere among them."""
    rig = re.sub(r"[^\w.-]", "_", str(recording.header.get("rig") or "recording"))
    return f"{rig}-{number:04d}.{form}"


def export_csv(recording: Recording, target: Path) -> None:
    """Write `recording` as CSV; OSError when target cannot be written."""
    with replacing_file(target) as stream:
        write_csv(recording, stream)


def write_csv(recording: Recording, stream: IO[bytes]) -> None:
    """Write the CSV's bytes to a stream that stays open."""
    for key, value in _comments(recording):
        stream.write(f"# {key}: {value}\n".encode())
    stream.write((",".join(recording.columns) + "\n").encode())
    if not is_installed("pyarrow"):
        _write_rows(recording, stream)
        return
    from pyarrow import csv

    options = csv.WriteOptions(include_header=False, quoting_style="none")
    csv.write_csv(_table(recording), stream, write_options=options)


def _write_rows(recording: Recording, stream: IO[bytes]) -> None:
    """Write the same rows, slower: each number in the fewest digits that give it back."""
    for row in zip(*(column.tolist() for column in recording.columns.values()), strict=True):
        stream.write((",".join(repr(value).removesuffix(".0") for value in row) + "\n").encode())


def export_parquet(recording: Recording, target: Path) -> None:
    """Write `recording` as Parquet; the header stands in the schema's metadata, one JSON value per key.

    MissingExtraError without pyarrow.
    """
    import_library("pyarrow")
    from pyarrow import parquet

    with replacing_file(target) as stream:
        parquet.write_table(_table(recording), stream, compression="zstd")


def _table(recording: Recording) -> Any:
    import pyarrow as pa

    facts = recording.header | ({"dropped": list(recording.notes)} if recording.truncated else {})
    metadata = {key: json.dumps(value) for key, value in facts.items()}
    return pa.table(dict(recording.columns)).replace_schema_metadata(metadata)


def _comments(recording: Recording) -> list[tuple[str, str]]:
    facts = {key: value for key, value in recording.header.items() if key != "columns"}
    lines = [(key, _one_line(value)) for key, value in facts.items()]
    return lines + [("dropped", note) for note in recording.notes]


def _one_line(value: Any) -> str:
    if isinstance(value, str) and "\n" not in value and "\r" not in value:
        return value
    return json.dumps(value)
