"""Small files that are there whole or not at all, also after kill -9, a power cut or a full disk.

A new file is written beside its name, fsynced, renamed, and its directory is fsynced; only then is it said to be there.
Names are used once where they carry a number that grows, so that taking a failed write back is one unlink; where a file has
a name of its own (`replace_durably`) the one before stays until the rename, and a failed write never takes it away. Nothing
is ever written in place: that tore 193 of 300 files in a trial. The first line of a numbered file holds the CRC-32
of the rest. An open descriptor of the directory is both its lock (flock, between threads and processes alike) and what
its fsync needs.
"""

import contextlib
import errno
import fcntl
import json
import os
import stat
import time
from collections.abc import Iterator
from glob import escape
from itertools import count
from pathlib import Path
from typing import Any, BinaryIO, Final
from zlib import crc32

from gateway.plain_file import closing_descriptor, exists, open_plain, open_plain_stream, replaced_by, write_whole

_FRESH: Final = ".new"
_BESIDE: Final = ".part"
_READER_BOUND_S: Final = 2.0
_WRITER_BOUND_S: Final = 10.0  # the fsyncs of another one on a slow disk
_LOCK_POLL_S: Final = 0.01
_SEAL: Final = b"# crc32 %08x of all that follows\n"
LONGEST_DOCUMENT: Final = 16 << 20
"""Bytes; a calibration with all its points has a hundredth of that."""


@contextlib.contextmanager
def lock_directory(directory: Path, *, shared: bool = False) -> Iterator[int]:
    """Yield the directory's descriptor, while no other holder changes it. FileNotFoundError when there is none.

    A holder that does not let go (stopped by Ctrl-Z, a hung disk) changes nothing either: who reads goes on without the lock,
    who would change something gets an OSError.
    """
    with closing_descriptor(os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)) as descriptor:
        _lock(descriptor, directory, shared=shared)
        yield descriptor


def _lock(descriptor: int, directory: Path, *, shared: bool) -> None:
    kind, bound_s = (fcntl.LOCK_SH, _READER_BOUND_S) if shared else (fcntl.LOCK_EX, _WRITER_BOUND_S)
    ends_s = time.monotonic() + bound_s
    while True:
        try:
            fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= ends_s:
                break
            time.sleep(_LOCK_POLL_S)
        else:
            return
    if not shared:
        raise OSError(
            errno.EBUSY, f"another program has kept it locked for {bound_s:g} s: stopped, or hung?", str(directory)
        )


def make_directory(directory: Path) -> None:
    """Make the directory, durably. OSError, and it is not there unless it was before, when that fails. The name of one that is
    there may not be on the disk yet: who made it was killed, or is at it now."""
    make_path(directory.parent)
    try:
        directory.mkdir(mode=0o700)
    except FileExistsError:
        sync_path(directory.parent)
        return
    try:
        _make_owner_s(directory)
        sync_path(directory.parent)
    except OSError:
        with contextlib.suppress(OSError):
            directory.rmdir()
        raise


def make_path(directory: Path, mode: int = 0o700) -> None:
    """Make the directory and those above it, and have the names of those that were made on the disk: what is stored durably in
    one whose own name is lost is lost with it. OSError where that is refused; some may be there then."""
    made = [each for each in (directory, *directory.parents) if not exists(each)]
    directory.mkdir(parents=True, exist_ok=True, mode=mode)
    for each in made:
        sync_path(each.parent)


def _make_owner_s(directory: Path) -> None:
    if os.geteuid():
        return
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
    with (
        closing_descriptor(os.open(directory, flags | os.O_NOFOLLOW)) as made,
        closing_descriptor(os.open(directory.parent, flags)) as folder,
    ):
        give_to_owner(made, directory.name, folder)


def write_durably(directory: int, name: str, data: bytes) -> None:
    """Write a new file durably: `name` in this directory holds `data`. OSError, and it is not there, when that fails: not for
    a name that may be there already."""
    try:
        replace_durably(directory, name, data)
    except OSError:
        remove_if_possible(directory, name)
        raise


def replace_durably(directory: int, name: str, data: bytes, mode: int = 0o640) -> None:
    """Write a file durably in place of the one that may be there. OSError when that fails: it holds the old data then, or,
    where only the directory's fsync was refused, the new ones."""
    try:
        _write(directory, name + _FRESH, data, mode)
        os.rename(name + _FRESH, name, src_dir_fd=directory, dst_dir_fd=directory)
        os.fsync(directory)
    except OSError:
        remove_if_possible(directory, name + _FRESH)
        raise


def replace_text(target: Path, text: str) -> None:
    """Write a file of people's durably in place of the one that may be there. OSError, and what was there stays."""
    with replacing_file(target) as stream:
        stream.write(text.encode())


def create_text(target: Path, text: str) -> None:
    """Write a new file of people's durably. FileExistsError where there is one; OSError, and there is none, where the disk
    refuses."""
    with closing_descriptor(os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)) as descriptor:
        try:
            write_whole(descriptor, text.encode())
            os.fsync(descriptor)
        except OSError as error:  # of the descriptor it knows no name
            target.unlink()
            raise OSError(error.errno, error.strerror, str(target)) from None
    sync_path(target.parent)


@contextlib.contextmanager
def replacing_file(target: Path, mode: int = 0o666) -> Iterator[BinaryIO]:
    """Yield a stream for a file of people's: behind the block, durably, it stands in place of the one that may be there.
    OSError, and what was there stays; only where the folder's fsync alone is refused is the new one there. mode: as of open."""
    target = replaced_by(target)
    beside, descriptor = open_beside(target, mode)
    with open(beside, "wb", opener=lambda name, flags: descriptor) as stream:
        try:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
            beside.replace(target)
        except BaseException:
            beside.unlink(missing_ok=True)  # still locked: it is nobody else's
            raise
    sync_path(target.parent)


def open_beside(target: Path, mode: int) -> tuple[Path, int]:
    """Return path and descriptor of an empty file beside a target that nobody else writes: the first whose lock is free. One
    that a killed process has left is used again, further ones are removed. OSError where there is none."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW
    for number in count():
        beside = target.with_name(f".{target.name}.{number}{_BESIDE}")
        descriptor = open_plain(beside, flags, mode)
        try:
            if _is_ours(descriptor, beside):
                os.ftruncate(descriptor, 0)
                _remove_left(beside, target)
                return beside, descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)
    raise AssertionError("numbers have no end")


def _remove_left(ours: Path, target: Path) -> None:
    """Remove what others that were killed have left beside the target, whose locks are free."""
    for path in target.parent.glob(f".{escape(target.name)}.*{_BESIDE}"):
        if path != ours and path.name[len(target.name) + 2 : -len(_BESIDE)].isdecimal():
            with contextlib.suppress(OSError), closing_descriptor(open_plain(path, os.O_WRONLY)) as descriptor:
                if _is_ours(descriptor, path):
                    path.unlink()


def _is_ours(descriptor: int, path: Path) -> bool:
    """Lock it. False where somebody else has it, or had it and has given it its name, or removed it, a moment ago."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except (BlockingIOError, FileNotFoundError):
        return False
    except OSError:  # some file systems have no locks
        return True


def read_regular(path: Path) -> bytes:
    """Return what a document's file holds. OSError for what else may have its name: a pipe would be waited for, a device has no
    end, and a file of gigabytes (a hole that a broken file system has left) would be all of a start's time and memory."""
    with open_plain_stream(path) as stream:
        if (size := os.fstat(stream.fileno()).st_size) > LONGEST_DOCUMENT:
            raise OSError(errno.EFBIG, f"it has {size} bytes, no document has {LONGEST_DOCUMENT}", str(path))
        return stream.read()


def read_object(path: Path) -> dict[str, Any]:
    """Return the JSON object in a file of ours. OSError where it is not to be read, ValueError where it is none, whatever has
    become of it."""
    try:
        content = json.loads(read_regular(path))
    except RecursionError:
        raise ValueError(f"{path} is nested too deeply") from None
    if not isinstance(content, dict):
        raise ValueError(f"{path} holds no JSON object")
    return content


def remove_if_possible(directory: int, name: str) -> None:
    """Remove a file that means nothing; if it cannot be removed it stays."""
    with contextlib.suppress(OSError):
        os.unlink(name, dir_fd=directory)


def give_to_owner(made: int, name: str, folder: int) -> None:
    """Have what root makes in the folder of somebody, such as a service's user, belong to that one, who could not read it else:
    what an administrator had put in use was passed over. Nothing that a link of theirs led to. made, folder: descriptors."""
    facts, owner = os.fstat(made), os.fstat(folder)
    if os.geteuid() or not owner.st_uid or facts.st_uid or (facts.st_nlink > 1 and not stat.S_ISDIR(facts.st_mode)):
        return
    if os.path.samestat(facts, os.stat(name, dir_fd=folder, follow_symlinks=False)):
        with contextlib.suppress(PermissionError):  # of a network's file system, which gives root nothing
            os.fchown(made, owner.st_uid, owner.st_gid)


def give_all_to_owner(directory: Path) -> None:
    """Have all that root has made in the directory of somebody belong to that one; it itself to whose folder it is in."""
    if os.geteuid():
        return
    with contextlib.suppress(OSError):
        _give_by_name(directory.name, os.open(directory.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC))
        for _, folders, files, descriptor in os.fwalk(directory) if directory.stat().st_uid else ():
            for name in (*folders, *files):
                _give_by_name(name, os.dup(descriptor))


def _give_by_name(name: str, folder: int) -> None:
    """folder: a descriptor, closed behind it. A link, a pipe or a device is not opened."""
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    with closing_descriptor(folder), contextlib.suppress(OSError):
        facts = os.stat(name, dir_fd=folder, follow_symlinks=False)
        if not facts.st_uid and (stat.S_ISREG(facts.st_mode) or stat.S_ISDIR(facts.st_mode)):
            with closing_descriptor(os.open(name, flags, dir_fd=folder)) as made:
                give_to_owner(made, name, folder)


def add_checksum(text: str) -> bytes:
    """Return the text with the CRC-32 of its bytes in a line before it."""
    data = text.encode()
    return _SEAL % crc32(data) + data


def verify_checksum(data: bytes) -> bytes:
    """Return what `add_checksum` was given. ValueError with a sentence for a torn, altered or foreign file."""
    first, _, rest = data.partition(b"\n")
    if first + b"\n" == _SEAL % crc32(rest):
        return rest
    if not data:
        raise ValueError("is empty")
    if not first.startswith(_SEAL[:8]):
        raise ValueError("does not begin with its crc32")
    raise ValueError(f"is damaged: its {len(rest)} bytes have crc32 {crc32(rest):08x}, its first line says otherwise")


def _write(directory: int, name: str, data: bytes, mode: int) -> None:
    """A whole new file on the disk, under a name that nobody reads; what a killed writer left there goes."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC
    with closing_descriptor(open_plain(name, flags, mode, directory=directory)) as descriptor:
        write_whole(descriptor, data)
        give_to_owner(descriptor, name, directory)
        os.fsync(descriptor)


def sync_path(path: Path) -> None:
    """Have a file's data, or a directory's names, put on the disk. OSError where it refuses; a pipe in its place is not waited
    for."""
    with closing_descriptor(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)) as descriptor:
        os.fsync(descriptor)
