"""Which processes have a serial port open: what `fuser` says, from /proc. Off Linux nobody is named."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Holder:
    """A process with the port open; is_locking: it holds the exclusive lock."""

    pid: int
    name: str
    is_locking: bool

    def __str__(self) -> str:
        return f"{self.name} (pid {self.pid})" if self.pid != os.getpid() else "this very process"


def holders_of(path: str, processes: Path = Path("/proc")) -> list[Holder]:
    """Return who has it open, each process once. Processes of other users stay hidden from all but root."""
    try:
        device = Path(path).stat().st_rdev
    except OSError:
        return []
    holders: dict[int, Holder] = {}
    for pid, descriptor in _descriptors(processes):
        if _device(descriptor) == device and device:
            is_locking = _locks(processes / str(pid) / "fdinfo" / descriptor.name)
            if pid not in holders or is_locking:
                holders[pid] = Holder(pid, _name(processes / str(pid)), is_locking)
    return list(holders.values())


def describe_holders(path: str) -> str:
    """Return the sentence about a port that does not open because another process holds it."""
    holders = holders_of(path)
    holders = [holder for holder in holders if holder.is_locking] or holders
    if not holders:
        return f"{path} is held by another process, of another user (sudo fuser {path} names it); stop that one first"
    return f"{path} is held by {', '.join(str(holder) for holder in holders)}; stop that one first"


def list_folder(folder: Path) -> list[Path]:
    """Return the entries of a folder of /proc, /sys or /dev; none where it is gone or another user's."""
    try:
        return list(folder.iterdir())
    except OSError:
        return []


def _descriptors(processes: Path) -> Iterator[tuple[int, Path]]:
    for process in list_folder(processes):
        if process.name.isdigit():
            for descriptor in list_folder(process / "fd"):
                yield int(process.name), descriptor


def _device(descriptor: Path) -> int:
    try:
        return descriptor.stat().st_rdev
    except OSError:
        return 0


def _locks(information: Path) -> bool:
    try:
        return "FLOCK" in information.read_text()
    except OSError:
        return False


def _name(process: Path) -> str:
    try:
        return (process / "comm").read_text().strip()
    except OSError:
        return "a process that has just ended"
