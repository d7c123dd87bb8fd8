"""Where compiled loops are kept: beside Python's bytecode, else in the user's cache, else nowhere.

An installed package may belong to root, and a service may have no home: both must work, the second by compiling anew. Never
in a folder that all users share, for what lies there is loaded and run.
"""

import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

_NAME: Final = "force-gateway"


def find_folder(chosen: str, package: Path, environment: Mapping[str, str] = os.environ) -> Path | None:
    """Return the first folder of `folders` that takes files; None where none does. It is made."""
    return next((folder for folder in folders(chosen, package, environment) if _takes_files(folder)), None)


def folders(chosen: str, package: Path, environment: Mapping[str, str]) -> Iterator[Path]:
    """Yield what comes into question: NUMBA_CACHE_DIR alone where that is chosen; the package's own bytecode folder; what
    systemd gives a service (CacheDirectory=); the user's cache (XDG Base Directory Specification).
    """
    if chosen:
        yield Path(chosen)
        return
    yield package / "__pycache__"
    if given := environment.get("CACHE_DIRECTORY"):
        yield Path(given.partition(":")[0])
    if (cache := environment.get("XDG_CACHE_HOME", "")).startswith("/"):
        yield Path(cache) / _NAME
    elif (home := environment.get("HOME", "")).startswith("/"):
        yield Path(home) / ".cache" / _NAME


def _takes_files(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
