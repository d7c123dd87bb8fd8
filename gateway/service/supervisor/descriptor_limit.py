"""How many files, ports and connections our processes may have open at a time (`ulimit -n`).

Too few are no fault of any one part, and each meets them elsewhere: a port that does not open, a helper that is started again
only after half a minute, a master that is not accepted. So it is told once, at the start, and where only the soft limit is low
it is raised first: children have what the guardian has. Standard library only.
"""

import contextlib
import resource
from typing import Final

NEEDED: Final = 128
"""Some 40 of control's own with page, telemetry and TLS; 32 masters; 32 callers of its socket; room for files and a restart."""
WANTED: Final = 1024
"""As systems give by themselves: a rig may allow 256 masters."""


def raise_descriptor_limit() -> str:
    """Raise the soft limit as far as wanted and allowed; return a sentence where it stays too low, else an empty one."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    allowed = _finite(hard)
    if _finite(soft) < WANTED:
        with contextlib.suppress(OSError, ValueError):  # it stays as it is, and is told by what it is
            resource.setrlimit(resource.RLIMIT_NOFILE, (min(WANTED, allowed), hard))
            soft = min(WANTED, allowed)
    if _finite(soft) >= NEEDED:
        return ""
    observation = f"a process may have {soft} files, ports and connections open here, {NEEDED} are needed"
    return f"A411 {observation}: raise the limit (ulimit -n, LimitNOFILE= of a unit) and start again"


def _finite(limit: int) -> int:
    return 1 << 30 if limit == resource.RLIM_INFINITY else limit
