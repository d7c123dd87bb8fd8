"""A rig as it was when the gateway was started, for every process that is forked later: what has become of its files meanwhile
(an editor that is half done, another limit) is for the next start.
"""

from typing import Final

from gateway.profiles.rigs.assembly import load_rig
from gateway.profiles.rigs.rig import Rig

_kept: Final[dict[tuple[str, bool], Rig]] = {}
"""Filled in the process that the others are forked from; empty in one that is started by itself."""


def keep_rig(name: str, *, simulated: bool) -> None:
    """Read it now, for `kept_rig` later. ProfileError with every fault of its files."""
    _kept[name, simulated] = load_rig(name, simulated=simulated)


def kept_rig(name: str, *, simulated: bool) -> Rig:
    """Return the rig as it was kept; where none was, as its files are. ProfileError with every fault of these."""
    return _kept.get((name, simulated)) or load_rig(name, simulated=simulated)
