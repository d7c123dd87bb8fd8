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
    found: dict[int, Holder] = {}
    for pid, descriptor in _descriptors(processes):
        if _device(descriptor) == device and device:
            is_locking = _locks(processes / str(pid) / "fdinfo" / descriptor.name)
            if pid not in found or is_locking:
                found[pid] = Holder(pid, _name(processes / str(pid)), is_locking)
    return list(found.values())


def _descriptors(processes: Path) -> Iterator[tuple[int, Path]]:
    for process in _entries(processes):
        if process.name.isdigit():
            for descriptor in _entries(process / "fd"):
                yield int(process.name), descriptor


def _entries(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError:  # ended meanwhile, or another user's
        return []


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
