"""bdSeq of the Sparkplug edge node, kept in the state directory, so that it goes on where the process before has ended.

A host tells by it to which birth a death belongs: one that began at 0 again after each start could take the death of the
process before, which the broker tells late, for that of the new one (Sparkplug 3.0, section 6.4.5, "bdSeq").
"""

import contextlib
import json
import os
from pathlib import Path
from typing import Final

from gateway.plain_file import closing_descriptor
from gateway.processes.durable_file import read_object, replace_durably

_FILE: Final = "sparkplug.json"
_ROUND: Final = 256


class KeptBdSeq:
    """state: the gateway's state directory."""

    def __init__(self, state: Path) -> None:
        self._path = state / _FILE
        self._last = self._kept = self._read()
        self._is_tried = False

    def next(self) -> int:
        """Return the number of a new connection, 0 .. 255 and round; it counts also where the disk does not take it. It is kept
        before it is told. Of those that follow without a connection, every two seconds while a broker is away for weeks, the
        broker has heard none, and the disk is spared them."""
        self._last = (self._last + 1) % _ROUND
        if not self._is_tried:
            self._is_tried = True
            self._keep()
        return self._last

    def note_connected(self) -> None:
        """Keep the number with which there is a connection now: the next process goes on behind it."""
        self._is_tried = False
        if self._kept != self._last:
            self._keep()

    def _keep(self) -> None:
        """Without a lock: the state directory's is the guardian's for as long as it runs, and nobody else writes this file."""
        with (
            contextlib.suppress(OSError),
            closing_descriptor(os.open(self._path.parent, os.O_RDONLY | os.O_DIRECTORY)) as descriptor,
        ):
            replace_durably(descriptor, _FILE, json.dumps({"bdSeq": self._last}).encode())
            self._kept = self._last

    def _read(self) -> int:
        try:
            last = read_object(self._path)["bdSeq"]
            return int(last) % _ROUND
        except (OSError, ValueError, KeyError, TypeError, OverflowError):
            return _ROUND - 1
