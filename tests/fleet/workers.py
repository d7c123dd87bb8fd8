"""What workers compute in these tests: importable by any process."""

import os
from pathlib import Path

from gateway.fleet.tasks import Row, Task


def count_bytes(task: Task) -> Row:
    """A row without any diagnosis: cheap, and different for each file."""
    text = Path(task.path).read_text()
    if "unreadable" in text:
        raise ValueError("E403 no recording")
    return {**task.head, "value_n": float(len(text)), "causes": [], "error_code": "", "error": ""}


def die_at_some(task: Task) -> Row:
    """`deadly` kills whoever computes it, `once` only the first one who does."""
    text = Path(task.path).read_text()
    told = Path(f"{task.path}.told")
    if "deadly" in text or ("once" in text and not told.exists()):
        told.touch()
        os._exit(9)
    return count_bytes(task)
