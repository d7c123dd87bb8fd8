"""Give memory back that the watch has no use for until the next look.

Two things stay resident for nothing: what the allocator keeps of a search, and the compiler's machine code (llvmlite, 50 MB),
which is needed while loops are loaded and never again. Linux only; elsewhere nothing happens.
"""

import ctypes
import resource
from collections.abc import Iterator
from functools import cache
from math import nan
from pathlib import Path
from typing import Any, Final

_DONT_NEED: Final = 4  # MADV_DONTNEED, sys/mman.h: of a file's unchanged pages nothing is lost, they are read again
_MMAP_THRESHOLD: Final = -3  # M_MMAP_THRESHOLD, malloc.h
_LARGE_BYTES: Final = 512 * 1024
_COMPILER: Final = "libllvmlite"
_MAPS: Final = Path("/proc/self/maps")
_STATM: Final = Path("/proc/self/statm")


def give_large_arrays_back_at_once() -> None:
    """Have the allocator take each large array from the kernel and return it when it is freed.

    Left to itself it raises the size from which it does so with each one that is freed, up to 32 MB: what a search has
    freed then stays between what it still holds, and its peak grows by a fifth.
    """
    try:
        _libc().mallopt(_MMAP_THRESHOLD, _LARGE_BYTES)
    except (OSError, AttributeError):
        pass


def return_memory() -> None:
    """Return freed memory and the compiler's code to the kernel; some milliseconds."""
    try:
        libc = _libc()
        libc.malloc_trim(0)
        for first, last in _code_of(_COMPILER, _MAPS.read_text()):
            libc.madvise(ctypes.c_void_p(first), ctypes.c_size_t(last - first), _DONT_NEED)
    except (OSError, AttributeError):
        pass


@cache
def _libc() -> Any:
    return ctypes.CDLL(None)


def resident_mb() -> float:
    """Return how much memory this process has in the machine, MB; NaN where nobody says."""
    try:
        return int(_STATM.read_text().split()[1]) * resource.getpagesize() / 1e6
    except OSError:
        return nan


def _code_of(library: str, maps: str) -> Iterator[tuple[int, int]]:
    """Yield first and last address of a library's code, which nobody has written to (proc_pid_maps(5))."""
    for line in maps.splitlines():
        addresses, rights, *rest = line.split(maxsplit=5)
        if rights == "r-xp" and len(rest) == 4 and library in Path(rest[3]).name:
            first, _, last = addresses.partition("-")
            yield int(first, 16), int(last, 16)
