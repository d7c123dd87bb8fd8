"""Every call that Python code makes to the disk beneath one folder, seen before it is made: whoever watches may refuse it.

The doors are `os.open`, `os.write`, `os.rename` and their like, and `open` itself, whose files are made so that each read and
write of theirs goes through the same doors. `stat` is no door: what is asked of names alone is not watched.
"""

import builtins
import io
import os
import shutil
import tarfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest

CHANGING: Final = frozenset(("create", "write", "fsync", "rename", "unlink", "mkdir", "rmdir", "truncate"))
ON_TWO_NAMES: Final = frozenset(("rename", "replace"))
ON_A_NAME: Final = {"unlink": "unlink", "remove": "unlink", "mkdir": "mkdir", "rmdir": "rmdir", "truncate": "truncate"}
ON_DESCRIPTORS: Final = {
    "write": "write",
    "read": "read",
    "fsync": "fsync",
    "fdatasync": "fsync",
    "ftruncate": "truncate",
}
ON_FOLDERS: Final = ("listdir", "scandir")


@dataclass(frozen=True, slots=True)
class Call:
    """what: "open", "create" (open, of a file that may be changed), "read", "write", "list" and so on; path: the file, of a
    rename the old name; to: its new name; data: what is written; size: what is cut to; descriptor: where there is one."""

    what: str
    path: str
    to: str = ""
    data: bytes = b""
    size: int = 0
    descriptor: int = -1
    flags: int = 0


class WatchedDisk:
    """Watches one folder. Subclasses refuse (`before` raises OSError), cut a write short, or note what was done (`after`)."""

    def __init__(self, folder: Path) -> None:
        self.folder = str(folder)
        self.calls: list[Call] = []

    def before(self, call: Call) -> None:
        """About to be done; OSError refuses it."""

    def length_of(self, call: Call) -> int:
        """How many bytes a write takes."""
        return len(call.data)

    def after(self, call: Call, result: Any) -> None:
        """Done."""

    def is_beneath(self, path: str) -> bool:
        return path == self.folder or path.startswith(self.folder + os.sep)

    def go(self, call: Call, door: Callable[[], Any]) -> Any:
        """One call, if it is ours."""
        if not self.is_beneath(call.path) and not self.is_beneath(call.to):
            return door()
        self.calls.append(call)
        self.before(call)
        result = door()
        self.after(call, result)
        return result


def path_of(name: Any, directory: int | None = None) -> str:
    """The absolute path of what a call names: a descriptor, or a name beneath a directory's descriptor."""
    if isinstance(name, int):
        return str(Path(f"/proc/self/fd/{name}").readlink())
    if isinstance(name, Path) and name.is_absolute():
        return str(name)
    base = Path.cwd() if directory is None else Path(f"/proc/self/fd/{directory}").readlink()
    return str(base / os.fspath(name))


def _open_door(disk: WatchedDisk, real: Callable[..., int]) -> Callable[..., int]:
    def door(name: Any, flags: int, mode: int = 0o777, *, dir_fd: int | None = None) -> int:
        what = "create" if flags & (os.O_WRONLY | os.O_RDWR) else "open"
        call = Call(what, path_of(name, dir_fd), flags=flags)
        return int(disk.go(call, lambda: real(name, flags, mode, dir_fd=dir_fd)))

    return door


def _descriptor_door(disk: WatchedDisk, what: str, real: Callable[..., Any]) -> Callable[..., Any]:
    def door(descriptor: int, *rest: Any) -> Any:
        if what != "write":
            size = rest[0] if what == "truncate" else 0
            call = Call(what, path_of(descriptor), size=size, descriptor=descriptor)
            return disk.go(call, lambda: real(descriptor, *rest))
        call = Call(what, path_of(descriptor), data=bytes(rest[0]), descriptor=descriptor)
        return disk.go(call, lambda: real(descriptor, call.data[: disk.length_of(call)]))

    return door


def _name_door(disk: WatchedDisk, what: str, real: Callable[..., Any]) -> Callable[..., Any]:
    def door(name: Any, *rest: Any, dir_fd: int | None = None, **options: Any) -> Any:
        more = options if dir_fd is None else options | {"dir_fd": dir_fd}
        size = rest[0] if what == "truncate" else 0
        return disk.go(Call(what, path_of(name, dir_fd), size=size), lambda: real(name, *rest, **more))

    return door


def _two_names_door(disk: WatchedDisk, real: Callable[..., Any]) -> Callable[..., Any]:
    def door(old: Any, new: Any, *, src_dir_fd: int | None = None, dst_dir_fd: int | None = None) -> Any:
        call = Call("rename", path_of(old, src_dir_fd), path_of(new, dst_dir_fd))
        return disk.go(call, lambda: real(old, new, src_dir_fd=src_dir_fd, dst_dir_fd=dst_dir_fd))

    return door


def _list_door(disk: WatchedDisk, real: Callable[..., Any]) -> Callable[..., Any]:
    def door(name: Any = ".") -> Any:
        return disk.go(Call("list", path_of(name)), lambda: real(name))

    return door


class WatchedFile(io.FileIO):
    """An open file whose every read and write goes through the doors of `os`."""

    def write(self, data: Any) -> int:
        return os.write(self.fileno(), data)

    def readinto(self, buffer: Any) -> int:
        data = os.read(self.fileno(), len(buffer))
        buffer[: len(data)] = data
        return len(data)

    def readall(self) -> bytes:
        return b"".join(iter(lambda: os.read(self.fileno(), 1 << 20), b""))

    def read(self, size: int | None = -1) -> bytes:
        return self.readall() if size is None or size < 0 else os.read(self.fileno(), size)

    def truncate(self, size: int | None = None) -> int:
        size = self.tell() if size is None else size
        os.ftruncate(self.fileno(), size)
        return size


def _opening(disk: WatchedDisk, real: Callable[..., Any]) -> Callable[..., Any]:
    """Stands for `open`: of a file in the folder, one of ours; any other is none of our business."""

    def opening(file: Any, mode: str = "r", buffering: int = -1, *texts: Any, **options: Any) -> Any:
        if isinstance(file, int) or not disk.is_beneath(path_of(file)):
            return real(file, mode, buffering, *texts, **options)
        opener = options.pop("opener", None) or (lambda name, flags: os.open(name, flags, 0o666))
        plain = WatchedFile(file, mode.replace("b", "").replace("t", ""), opener=opener)
        if buffering == 0:
            return plain
        try:
            kind = io.BufferedRandom if "+" in mode else io.BufferedReader if "r" in mode else io.BufferedWriter
            buffered = kind(plain)  # type: ignore[arg-type]
            return buffered if "b" in mode else io.TextIOWrapper(buffered, *texts, **options)
        except BaseException:
            plain.close()
            raise

    return opening


def _doors(disk: WatchedDisk) -> Iterator[tuple[str, Callable[..., Any]]]:
    yield "open", _open_door(disk, os.open)
    yield from ((name, _two_names_door(disk, getattr(os, name))) for name in ON_TWO_NAMES)
    yield from ((name, _name_door(disk, what, getattr(os, name))) for name, what in ON_A_NAME.items())
    yield from ((name, _descriptor_door(disk, what, getattr(os, name))) for name, what in ON_DESCRIPTORS.items())
    yield from ((name, _list_door(disk, getattr(os, name))) for name in ON_FOLDERS)


@contextmanager
def watching(disk: WatchedDisk) -> Iterator[WatchedDisk]:
    """Everything beneath the disk's folder goes through it meanwhile."""
    real = io.open
    with pytest.MonkeyPatch.context() as patch:
        for name, door in tuple(_doors(disk)):
            patch.setattr(os, name, door)
        for module, name in ((io, "open"), (builtins, "open"), (tarfile, "bltn_open")):
            patch.setattr(module, name, _opening(disk, real))
        patch.setattr(shutil, "_USE_CP_SENDFILE", False)  # it would copy behind our back
        yield disk
