"""Opening what must be a plain file: whatever else has its name is refused at once, never waited for and never read to its end.
And writing one: what a disk refuses is told by its cause.

A pipe is waited for until somebody writes, a device may have no end (/dev/zero), and some act on being opened (a watchdog
begins to count). So a name is asked what it is before it is opened, and what was opened is asked again: it may have been
exchanged in between, and O_NONBLOCK keeps a pipe from being waited for even then.
Standard library only: the guardian uses this.
"""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import BinaryIO, Final, Literal

DIRECTORY: Final = "a directory"
_PROC: Final = "/proc"
_REASONS: Final = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "this user may store no more there",
    errno.EFBIG: "longer than a process may write here (ulimit -f, LimitFSIZE=) or this file system takes (FAT: 4 GiB)",
    errno.EROFS: "mounted so, or by the kernel after errors (dmesg)",
    errno.EIO: "the disk is broken, or gone (dmesg)",
}
_NOTHING: Final = frozenset((errno.ENOENT, errno.ENOTDIR, errno.ELOOP))
_WITH_PLACE: Final = frozenset((errno.EINVAL, errno.EISDIR))
_KINDS: Final = {
    stat.S_IFDIR: DIRECTORY,
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def expand_home(name: Path | str) -> Path:
    """Return the path that its user means: ~ is the home directory. `~nobody/cell`, where nobody of that name is known, is a
    name like another."""
    path = Path(name)
    with suppress(RuntimeError):
        return path.expanduser()
    return path


def exists(path: Path | str) -> bool:
    """Return whether anything has this name. OSError where that cannot be known, as from a broken disk or a folder of somebody
    else's: pathlib's own answer is no, from Python 3.14 on, and a run that may press still would have ended."""
    return bool(_mode_of(path))


def is_directory(path: Path | str) -> bool:
    """Return whether this is a directory. OSError where that cannot be known."""
    return stat.S_ISDIR(_mode_of(path))


def is_file(path: Path | str) -> bool:
    """Return whether this is a plain file. OSError where that cannot be known."""
    return stat.S_ISREG(_mode_of(path))


def _mode_of(path: Path | str) -> int:
    """What has this name, links followed: 0 for nothing."""
    try:
        return os.stat(path).st_mode  # noqa: PTH116
    except ValueError:  # no name at all: a zero byte is in it
        return 0
    except OSError as error:
        if error.errno in _NOTHING:
            return 0
        raise


def other_kind(path: Path | str) -> str:
    """Return what has this name where it is no plain file, such as "a pipe"; empty for a plain one. OSError without any."""
    return _other_kind(os.stat(path))  # noqa: PTH116


def check_plain(path: Path | str) -> None:
    """Do nothing for a plain file. OSError for what else is there, FileNotFoundError where nothing is."""
    _refuse_other(os.stat(path), path)  # noqa: PTH116


def open_plain(path: Path | str, flags: int = os.O_RDONLY, mode: int = 0o600, *, directory: int | None = None) -> int:
    """Return the descriptor of a plain file, opened as by os.open and not inherited. OSError for what else has its name.

    directory: descriptor of the folder that the name is in.
    """
    try:
        _refuse_other(os.stat(path, dir_fd=directory), path)
    except FileNotFoundError:
        if not flags & os.O_CREAT:
            raise
    descriptor = os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC, mode, dir_fd=directory)
    try:
        _refuse_other(os.fstat(descriptor), path)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


@contextmanager
def closing_descriptor(descriptor: int) -> Iterator[int]:
    """Yield an open descriptor, and close it behind the block, whatever happens in it."""
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def open_plain_stream(path: Path | str, mode: Literal["rb", "wb"] = "rb") -> BinaryIO:
    """Return a plain file, opened for reading or anew. OSError for what else has its name."""
    return open(path, mode, opener=open_plain)


def read_plain(path: Path | str) -> bytes:
    """Return all that a plain file holds. OSError for what else has its name."""
    with open_plain_stream(path) as stream:
        return stream.read()


def replaced_by(path: Path) -> Path:
    """Return the place of a file that is written beside it and renamed: where a link leads to. OSError where something else
    than a plain file stands: root would make a device such as /dev/null a file, for everybody; and where there is no folder,
    or one that takes no file, which would else be told by the name of the file beside it, that nobody has given."""
    place = Path(os.path.realpath(path))
    if not is_directory(place.parent):
        raise FileNotFoundError(errno.ENOENT, "no such directory", str(path.parent))
    if not os.access(place.parent, os.W_OK | os.X_OK):
        number = errno.EROFS if os.statvfs(place.parent).f_flag & os.ST_RDONLY else errno.EACCES
        raise OSError(number, os.strerror(number), str(path))
    with suppress(FileNotFoundError):
        check_plain(place)
    return place


def write_whole(descriptor: int, data: bytes | memoryview) -> None:
    """Write all of it. OSError says why where only a part is taken: a disk that is full, a quota and a limit on files all take
    what still fits, and say which they are when they are asked for the rest."""
    written = os.write(descriptor, data)
    if written < len(data):
        written += os.write(descriptor, data[written:])
    if written < len(data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def tell_refusal(error: OSError) -> str:
    """Return why a disk refuses, in the system's words and in ours, and of what is no plain file where it stands."""
    words = error.strerror or str(error)
    if error.errno in _WITH_PLACE and error.filename:
        return f"{error.filename}: {words}"
    reason = _REASONS.get(error.errno or 0, "")
    return f"{words}: {reason}" if reason else words


def tell_place_and_refusal(error: OSError) -> str:
    """As tell_refusal, behind the name that was refused, where the error knows it."""
    words = tell_refusal(error)
    return f"{error.filename}: {words}" if error.filename and not words.startswith(f"{error.filename}") else words


def _other_kind(status: os.stat_result) -> str:
    if stat.S_ISREG(status.st_mode):  # /proc/kmsg says that it is a file, and is waited for as a pipe is
        return "a part of /proc" if status.st_dev == _device_of_proc() else ""
    return _KINDS.get(stat.S_IFMT(status.st_mode), "something else")


@cache
def _device_of_proc() -> int:
    try:  # of what is in it: the folder alone stands in a bare chroot, too, on the disk of all files
        return os.stat(f"{_PROC}/self").st_dev  # noqa: PTH116
    except OSError:
        return -1


def _refuse_other(status: os.stat_result, path: Path | str) -> None:
    if kind := _other_kind(status):
        number = errno.EISDIR if stat.S_ISDIR(status.st_mode) else errno.EINVAL
        raise OSError(number, f"it is {kind}, and no file: move it away, or name another", str(path))
