"""What `force-gateway run` was asked for. Standard library only."""

import errno
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gateway import defaults

_ENDS: Final = (".yaml", ".yml", ".json")


@dataclass(frozen=True)
class RunOptions:
    """The options of the verb, by name. state None: $XDG_STATE_HOME/force-gateway/RIG."""

    rig: str = defaults.RIG
    simulate: bool = False
    bind: tuple[str, int] | None = None
    rtu: str | None = None  # the port of one more serial face, empty for a pseudo-terminal
    state: Path | None = None
    json: bool = False
    record: bool = False
    realtime: bool = False
    web: tuple[str, int] | None = None  # host empty: the usual address, or a free port where that is taken
    metrics: tuple[str, int] | None = None

    @property
    def state_directory(self) -> Path:
        """Directory that holds what the rig keeps between runs."""
        if self.state is not None:
            return self.state
        return default_state_root() / stem_of(self.rig)


def default_state_root() -> Path:
    """Return where the state directories of rigs are that were given none. OSError where this user has no home either, as in a
    container by a number alone."""
    try:
        home = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state")
    except RuntimeError:
        nowhere = "this user has no home directory for the state: set XDG_STATE_HOME, or give --state DIR"
        raise FileNotFoundError(errno.ENOENT, nowhere) from None
    return home / "force-gateway"


def stem_of(rig: str) -> str:
    """Return what a rig's state directory and service are called: its name, or its file's without the end. Another dot is its
    own: cell-1.2 is neither cell-1 nor does it take the calibrations of that."""
    name = Path(rig).name
    return next((name.removesuffix(end) for end in _ENDS if name.endswith(end) and name != end), name)
