"""Rows as they come, durably: what is finished is never computed again, whatever ends the command.

One JSON line a row behind a line that says what was asked; a file of another question is begun anew. A line that was cut by
a power cut or a kill is passed over: its recording is computed once more.
"""

import contextlib
import json
import os
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from gateway.fleet.tasks import Row, Task
from gateway.plain_file import read_plain
from gateway.processes.durable_file import replace_text

FORMAT: Final = 1


class KeptRows:
    """question: everything that an answer depends on besides the file, such as the rig's fingerprint; values that JSON has."""

    def __init__(self, path: Path, question: dict[str, Any]) -> None:
        self._path = path
        self._head = {"format": FORMAT, **question}
        self._descriptor: int | None = None

    def known(self, tasks: list[Task]) -> dict[Task, Row]:
        """Return the rows that are kept for these tasks: of files that have not changed since, without an error."""
        by_place = {(row.get("file"), row.get("sha256")): row for row in self._read() if not row.get("error_code")}
        return {task: by_place[task.path, task.sha256] for task in tasks if (task.path, task.sha256) in by_place}

    def __enter__(self) -> Self:
        """Go on behind what is kept, without a cut last line, or begin anew. OSError where the folder takes no file."""
        kept = self._read()
        self._path.parent.mkdir(parents=True, exist_ok=True)
        replace_text(self._path, "".join(_line(each) for each in (self._head, *kept)))
        self._descriptor = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CLOEXEC)
        return self

    def keep(self, row: Row) -> None:
        """Keep one more row, on the disk when this returns."""
        assert self._descriptor is not None, "within the block only"
        os.write(self._descriptor, _line(row).encode())
        os.fsync(self._descriptor)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def _read(self) -> list[Row]:
        try:
            lines = read_plain(self._path).decode(errors="replace").split("\n")[:-1]
        except FileNotFoundError:
            return []
        read: list[Row] = []
        for line in lines:
            with contextlib.suppress(ValueError):
                if isinstance(row := json.loads(line), dict):
                    read.append(row)
        return read[1:] if read and read[0] == self._head else []


def _line(values: dict[str, Any]) -> str:
    return json.dumps(values, allow_nan=False) + "\n"
