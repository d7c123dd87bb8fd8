"""How a process of ours is started: with the modules of the one that starts it, and with no others.

`python -m` looks into the current folder first. Somebody's serial.py or json.py there was taken for the real one: the gateway
did not start, or, where the file came later, did not start again. Whoever may write there had the wire. Standard library only.
"""

import sys
from pathlib import Path


def module_command(module: str) -> list[str]:
    """Return the words that run this module. The current folder counts where it does for this process (`python -m gateway` in
    a checkout)."""
    return [sys.executable, *(() if _is_current_folder_searched() else ("-P",)), "-m", module]


def _is_current_folder_searched() -> bool:
    try:
        return not {"", str(Path.cwd())}.isdisjoint(sys.path)
    except OSError:  # it has been removed
        return "" in sys.path
