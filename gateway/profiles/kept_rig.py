"""A rig as it was when the gateway was started, for every process that is forked later: what has become of its files meanwhile
(an editor that is half done, another limit) is for the next start. A process that is not forked from there, as those beside
control are not, reads the files again, and does without where they are others by now: a page that went by another lease than
control let each force that it asked for end in a fault.
"""

from typing import Final

from gateway.profiles.rigs.assembly import load_rig
from gateway.profiles.rigs.rig import Rig
from gateway.profiles.strict_yaml.faults import ProfileError

_kept: Final[dict[tuple[str, bool], Rig]] = {}
"""Filled in the process that the others are forked from; empty in one that is started by itself."""


def keep_rig(name: str, *, simulated: bool) -> None:
    """Read it now, for `kept_rig` later. ProfileError with every fault of its files."""
    _kept[name, simulated] = load_rig(name, simulated=simulated)


def kept_rig(name: str, *, simulated: bool) -> Rig:
    """Return the rig as it was kept; where none was, as its files are. ProfileError with every fault of these."""
    return _kept.get((name, simulated)) or load_rig(name, simulated=simulated)


class ChangedRigError(OSError):
    """The rig's files are others than those that the gateway was started with; its text is a sentence with its code."""


def unchanged_rig(name: str, fingerprint: str | None, *, simulated: bool) -> Rig:
    """Return the rig, read again. fingerprint: what it had at the start; None: whatever its files say. ChangedRigError where it
    is another one, or has faults."""
    try:
        rig = load_rig(name, simulated=simulated)
    except ProfileError as error:
        now = f"have faults now ({error.faults[0]})"
    else:
        if fingerprint in (None, rig.fingerprint):
            return rig
        now = "have changed"
    raise ChangedRigError(
        f"W247 the files of rig {name} {now}: this begins again with a new start, or with the files as they were"
    )
