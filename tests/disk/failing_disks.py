"""Disks that fail at the n-th call: once, or from then on, as one does that is full, has become read-only, or is broken."""

import errno
import os
from pathlib import Path
from typing import Any, Final

from tests.disk.watched_disk import CHANGING, Call, WatchedDisk

_FAILED_CALLS: Final = {"once": 1, "for a while": 3}
GROWING: Final = frozenset(("create", "write", "mkdir"))


class FailingDisk(WatchedDisk):
    """kind: "once" (EIO of one call, whatever it is), "for a while" (of three calls, where the first is a write after half of
    it), "broken" (of all from there on), "full" (ENOSPC of whatever needs room from there on, half of the first write fits),
    "read-only" (EROFS of every change from there on)."""

    KINDS: Final = ("once", "for a while", "full", "read-only", "broken")

    def __init__(self, folder: Path, kind: str, fail_at: int) -> None:
        super().__init__(folder)
        self.kind, self._fail_at = kind, fail_at
        self.refused: list[Call] = []
        self._is_half_written = False

    @property
    def has_failed(self) -> bool:
        """Whether any call was refused, or cut short."""
        return bool(self.refused) or self._is_half_written

    def before(self, call: Call) -> None:
        number = self._error(call, len(self.calls))
        if number:
            self.refused.append(call)
            raise OSError(number, os.strerror(number), call.path)

    def length_of(self, call: Call) -> int:
        begins = len(self.calls) >= self._fail_at if self.kind == "full" else len(self.calls) == self._fail_at
        if self.kind in ("full", "for a while") and begins and not self._is_half_written:
            self._is_half_written = True
            return len(call.data) // 2
        return len(call.data)

    def _error(self, call: Call, count: int) -> int:
        if count < self._fail_at:
            return 0
        first_write = call.what == "write" and not self._is_half_written and len(call.data) > 1
        if self.kind == "for a while" and count == self._fail_at and first_write:
            return 0
        if self.kind in _FAILED_CALLS:
            return errno.EIO if count < self._fail_at + _FAILED_CALLS[self.kind] else 0
        if self.kind == "full":
            return errno.ENOSPC if _needs_room(call) and not first_write else 0
        if self.kind == "read-only":
            return errno.EROFS if call.what in CHANGING - {"fsync"} else 0
        return errno.EIO


def _needs_room(call: Call) -> bool:
    """A file that is there can be opened on a full disk."""
    if call.what == "create":
        return bool(call.flags & os.O_CREAT) and not os.path.lexists(call.path)
    return call.what in GROWING and bool(call.data or call.what != "write")


def describe(disk: Any) -> str:
    """What a failed assertion should tell: the call that failed first."""
    first = disk.refused[0] if disk.refused else None
    what = f"{first.what} {Path(first.path).name} {first.to}" if first else "half a write"
    place = disk.calls.index(first) + 1 if first else 0
    return f"{disk.kind}, call {place} of {len(disk.calls)} refused: {what}"
