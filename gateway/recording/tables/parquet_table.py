"""Reads a Parquet table, written by `recordings export` or by another program: numbers as float64, null as NaN, facts from
the schema's metadata.

Time stamps and durations are seconds from the table's first (float64 seconds since 1970 would keep a quarter of a
microsecond, and a recording counts from its first row anyhow).
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gateway.extras import import_library
from gateway.recording.errors import RecordingError
from gateway.recording.foreign.headers import TableHeaders
from gateway.recording.reader import Recording
from gateway.recording.tables.column_mapping import (
    ColumnMapping,
    SelectedColumn,
    describe_understood,
    factors_of,
    join_names,
    select_columns,
    unit_facts,
)
from gateway.recording.tables.csv_table import refuse_too_large

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MAGIC: Final = b"PAR1"
_NOT_FACTS: Final = ("pandas", "ARROW:schema", "huggingface", "columns")
_TICKS_PER_S: Final = {"s": 1.0, "ms": 1.0e3, "us": 1.0e6, "ns": 1.0e9}


def read_parquet(path: Path, mapping: ColumnMapping | None) -> Recording:
    """Return the columns and facts of a Parquet file.

    RecordingError when the file is damaged or a contract column holds no numbers, MissingExtraError without pyarrow.
    """
    import_library("pyarrow")
    import pyarrow as pa
    from pyarrow import parquet

    try:
        with pa.OSFile(str(path)) as source, parquet.ParquetFile(source) as file:  # a damaged one leaves no file open
            names = file.schema_arrow.names
            headers = TableHeaders.of(names, stamps=_stamps(file.schema_arrow))
            chosen = select_columns(names, mapping, str(path), headers)
            refuse_too_large(path, file.metadata.num_rows, len(chosen))
            table = file.read(columns=list({names[pick.index]: None for pick in chosen}))
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:  # the last: names of columns that are no text
        raise RecordingError(f"{path} is a damaged Parquet file: {str(error).splitlines()[0]}") from error
    columns, words = _columns(path, table, chosen, names)
    facts = _facts(table.schema.metadata or {}) | unit_facts(headers, chosen, mapping)
    dropped = facts.pop("dropped", [])
    notes = [str(note) for note in dropped] if isinstance(dropped, list) else [str(dropped)]
    notes += describe_understood(names, chosen, mapping)
    notes += [f"columns that hold no numbers: {join_names(words)}"] if words else []
    return Recording(
        path,
        facts,
        columns,
        table.num_rows,
        bool(dropped),
        tuple(notes),
        suggestion=headers.suggest(),
        factors=factors_of(chosen),
    )


def _stamps(schema: Any) -> list[int]:
    """Return the places of columns whose type is a time."""
    import pyarrow as pa

    return [
        k for k, field in enumerate(schema) if pa.types.is_timestamp(field.type) or pa.types.is_duration(field.type)
    ]


def _columns(
    path: Path, table: Any, chosen: Sequence[SelectedColumn], headers: Sequence[str]
) -> "tuple[dict[str, NDArray[np.float64]], list[str]]":
    """Return the columns by name, and the names of those that hold no numbers."""
    columns: dict[str, NDArray[np.float64]] = {}
    words: list[str] = []
    for pick in chosen:
        column = _column_at(table, headers, pick.index)
        values = _numbers(column)
        if values is None and pick.is_contract:
            raise RecordingError(
                f"{path}: column {pick.name} holds {column.type}, not numbers: convert it (pandas: astype(float)), or write CSV"
            )
        if values is None:
            words.append(pick.name)
        else:
            columns[pick.name] = (
                values if (pick.factor, pick.offset) == (1.0, 0.0) else values * pick.factor + pick.offset
            )
    return columns, words


def _column_at(table: Any, headers: Sequence[str], index: int) -> Any:
    """Return the column at this place of the file; another one may have its name, and is read with it."""
    name = headers[index]
    places = [place for place, read in enumerate(table.column_names) if read == name]
    return table.column(places[list(headers[:index]).count(name)])


def _numbers(column: Any) -> "NDArray[np.float64] | None":
    """Return the column as float64 with NaN for null; None where its type holds no numbers."""
    import numpy as np
    import pyarrow as pa

    kind, per_s = column.type, 1.0
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
        per_s, column = _TICKS_PER_S[kind.unit], column.cast(pa.int64())
        first = next((value.as_py() for value in column if value.is_valid), 0)
        column = pa.compute.subtract(column, first)
    elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or _is_castable(kind)):
        return None
    values = np.array(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
    return values if per_s == 1.0 else values / per_s


def _is_castable(kind: Any) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_boolean(kind) or pa.types.is_decimal(kind))


def _facts(metadata: dict[bytes, bytes]) -> dict[str, Any]:
    """Return the schema's metadata as facts, without the keys that pandas and Arrow keep there; values that are JSON are
    parsed."""
    texts = {key.decode(errors="replace"): value.decode(errors="replace") for key, value in metadata.items()}
    return {key: _fact(text) for key, text in texts.items() if key not in _NOT_FACTS}


def _fact(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text
