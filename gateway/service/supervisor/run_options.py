"""What `force-gateway run` was asked for. Standard library only."""

import os
from dataclasses import dataclass
from pathlib import Path

from gateway import defaults


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
        return default_state_root() / Path(self.rig).stem


def default_state_root() -> Path:
    """Return where the state directories of rigs are that were given none."""
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "force-gateway"
