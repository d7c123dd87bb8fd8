"""A rig as it was when the gateway was started: what has become of its files meanwhile (an editor that is half done, another
limit) is for the next start. Control has it from the process that it is forked from, which has read it once; where that one is
gone, from memory that the guardian keeps: else its death would put other files to use, without a word, or end the gateway.
A process beside control takes it from there, too. Where nothing is kept it reads the files again, and does without where they
are others by now: a page that went by another lease than control let each force that it asked for end in a fault.
"""

import contextlib
import os
import pickle
from collections.abc import Mapping
from typing import Any, Final

from gateway.profiles.rigs.assembly import load_rig
from gateway.profiles.rigs.rig import Rig
from gateway.profiles.strict_yaml.faults import ProfileError

_kept: Final[dict[tuple[str, bool], Rig]] = {}
"""Filled in the process that the others are forked from; empty in one that is started by itself."""
_LENGTH_BYTES: Final = 8


def keep_rig(name: str, *, simulated: bool) -> None:
    """Read it now, for `kept_rig` later. ProfileError with every fault of its files."""
    _kept[name, simulated] = load_rig(name, simulated=simulated)


def kept_rig(name: str, *, simulated: bool, memory: int | None = None) -> Rig:
    """Return the rig as the gateway was started with it; where nobody has kept that, as its files are. memory: descriptor of
    memory without a name that every control process of one gateway is given; the first one leaves the rig in it.
    ProfileError with every fault of the files."""
    if memory is not None and (rig := _recall(memory)):
        return rig
    rig = _kept.get((name, simulated)) or load_rig(name, simulated=simulated)
    if memory is not None:
        _remember(memory, rig)
    return rig


def _recall(memory: int) -> Rig | None:
    """Return what is in the memory; None where nobody has come to the end of writing it. It is our own: nobody else has it."""
    length = int.from_bytes(os.pread(memory, _LENGTH_BYTES, 0))
    rig: Rig | None = pickle.loads(os.pread(memory, length, _LENGTH_BYTES)) if length else None
    return rig


def _remember(memory: int, rig: Rig) -> None:
    """Its length goes last: whoever dies before that has kept nothing. Without room for it a restart goes by what is left."""
    text = pickle.dumps(rig)
    with contextlib.suppress(OSError):
        if os.pwrite(memory, text, _LENGTH_BYTES) == len(text):
            os.pwrite(memory, len(text).to_bytes(_LENGTH_BYTES), 0)


class ChangedRigError(OSError):
    """The rig's files are others than those that the gateway was started with; its text is a sentence with its code."""


def rig_as_started(options: Mapping[str, Any]) -> Rig:
    """Return the rig that runs, in a process beside control. options: as the guardian gives them. ChangedRigError as below."""
    memory = options.get("kept_rig")
    return unchanged_rig(options["rig"], options["fingerprint"], simulated=options["simulated"], memory=memory)


def unchanged_rig(name: str, fingerprint: str | None, *, simulated: bool, memory: int | None = None) -> Rig:
    """Return the rig that runs. fingerprint: what it had at the start; None: whatever its files say. memory: as above; it is
    read again where nothing is kept there. ChangedRigError where it is another one then, or has faults."""
    if memory is not None and (rig := _recall(memory)) and rig.fingerprint == fingerprint:
        return rig
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
