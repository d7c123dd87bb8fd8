"""A state directory in one file, and back: nothing half, nothing outside, nothing overwritten.

The archive is a tar.gz: `backup.json` (what this is) and `state/...`. Sockets, the lock and the running flag belong to a
running gateway and are left out. Restoring extracts beside the target and then renames, so a full disk or a damaged
archive changes nothing; what was there before is kept under another name, not deleted.
"""

import contextlib
import errno
import gzip
import io
import json
import os
import shutil
import tarfile
import zlib
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from gateway import VERSION
from gateway.audit.audit_file import HEAD
from gateway.plain_file import check_plain, exists, is_directory, is_file, open_plain_stream
from gateway.processes import state_lock
from gateway.processes.durable_file import lock_directory, make_path, replacing_file, sync_path
from gateway.processes.state_directory import CONTROL_SOCKET, RUNNING, place_before_restore, place_of_restore

_MANIFEST: Final = "backup.json"
_TOP: Final = "state"
_LEFT_OUT: Final = {CONTROL_SOCKET, state_lock.NAME, RUNNING}
_FORMAT: Final = 1
_LONGEST_MANIFEST: Final = 1 << 16
_OWNER_READS: Final = 0o600
_MOST_MODE: Final = 0o744  # nobody else writes, whatever the archive says


class ArchiveError(Exception):
    """A file that is no backup, or a damaged one."""


_DAMAGE: Final = (tarfile.TarError, gzip.BadGzipFile, zlib.error, EOFError, ValueError, OverflowError)
"""What reading a damaged archive raises: numbers, times and names that cannot be are the last two."""


def pack_state(state: Path, target: Path) -> list[str]:
    """Write everything of `state` to `target`; the names packed. OSError when either cannot be used."""
    files: list[Path] = []
    with (
        replacing_file(target, _OWNER_READS) as stream,
        gzip.GzipFile("", "wb", fileobj=stream, mtime=0) as packed,  # of a clock beyond 2106 it has no room
        tarfile.open(fileobj=packed, mode="w", dereference=True) as archive,  # a second name is a file, too
    ):
        _add_manifest(archive, state)
        for path in (path for path in _files(state) if _is_kept(path, state)):
            with contextlib.suppress(FileNotFoundError):  # an event file that has got its next name meanwhile
                _add(archive, path, f"{_TOP}/{path.relative_to(state)}")
                files.append(path)
    return [str(path.relative_to(state)) for path in files if not is_directory(path)]


def links_in(state: Path) -> list[str]:
    """Return the names of the links below a state directory, which a backup leaves out; OSError where it cannot be read."""
    return sorted(str(path.relative_to(state)) for path in state.rglob("*") if path.is_symlink())


def names_in(source: Path) -> list[str]:
    """Return the files of an archive, after every check that `unpack` makes; ArchiveError with the reason."""
    check_plain(source)
    with _damage_told(source):
        _read_to_the_end(source)
        with tarfile.open(source, "r:gz") as archive:
            members = archive.getmembers()
            _check(archive, members)
            return [member.name.removeprefix(f"{_TOP}/") for member in members if member.isfile()][1:]


def rig_in(source: Path) -> str:
    """Return the name of the state directory that was packed, which is its rig's unless --state had named another; empty
    where it is no name of a directory. For an archive that was checked."""
    with tarfile.open(source, "r:gz") as archive:
        manifest = archive.extractfile(_MANIFEST)
        assert manifest, "which was checked"
        name = json.loads(manifest.read(_LONGEST_MANIFEST)).get("rig")
    is_name = isinstance(name, str) and name.isprintable() and Path(name).name == name and not name.startswith(".")
    return name if is_name else ""


def unpack_state(source: Path, state: Path) -> Path | None:
    """Put the archive's content where `state` is, or leads, at once; where the previous content is kept, None if there was
    none."""
    names_in(source)
    state = state.resolve()  # by a link it is on another disk, and stays there
    make_path(state.parent, 0o777)
    with _beside(state) as beside:
        with _damage_told(source), tarfile.open(source, "r:gz") as archive:
            _extract(archive, beside)
        fresh = beside / _TOP
        fresh.mkdir(exist_ok=True)
        fresh.chmod(0o700)
        _give_to_owner(fresh, state if exists(state) else state.parent)
        _sync_all(fresh)
        return _put_in_place(fresh, state)


@contextlib.contextmanager
def _beside(state: Path) -> Iterator[Path]:
    """Yield an empty directory beside the state, gone behind the block. It has one name, so that what a killed restore has
    left, a whole state, goes with the next one; while another restore is at work on it, OSError."""
    beside = place_of_restore(state)
    with contextlib.suppress(FileNotFoundError), lock_directory(beside):
        shutil.rmtree(beside)
    beside.mkdir(mode=0o700)
    with lock_directory(beside) as descriptor:
        if not os.path.samestat(os.fstat(descriptor), beside.stat()):
            raise OSError(errno.EBUSY, "another restore is at work there", str(state))
        try:
            yield beside
        finally:
            shutil.rmtree(beside, ignore_errors=True)


def _extract(archive: tarfile.TarFile, folder: Path) -> None:
    """Write files and directories of an archive that was checked. Not by `extractall`: its filter, without which it gives files
    away to whoever had them before, is missing in the first Pythons 3.11, Debian's among them."""
    for member in archive.getmembers():
        path = folder / member.name
        if member.isdir():
            path.mkdir(parents=True, exist_ok=True)
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        content = archive.extractfile(member)
        assert content, f"{member.name} is no file, which was checked"
        with content, path.open("xb") as file:
            shutil.copyfileobj(content, file)
        path.chmod(_OWNER_READS | member.mode & _MOST_MODE)
        os.utime(path, (member.mtime, member.mtime))


def _give_to_owner(fresh: Path, before: Path) -> None:
    """Have what root restores belong to whose it was, such as a service's user, who could not open it else. before: what it
    takes the place of, or the folder that it comes into."""
    owner = before.stat()
    if os.geteuid() == 0 and owner.st_uid:
        with contextlib.suppress(PermissionError):  # of a root that may not, as in some containers
            for path in (*_files(fresh), fresh):
                os.chown(path, owner.st_uid, owner.st_gid, follow_symlinks=False)


def _sync_all(folder: Path) -> None:
    """Have what was extracted on the disk before it stands where the state was."""
    for path in (*_files(folder), folder):
        sync_path(path)


def _put_in_place(fresh: Path, state: Path) -> Path | None:
    """Exchange the two; OSError, and what was there is there again, where the disk refuses. What `put_back` knows a killed
    restore by is on the disk before."""
    sync_path(state.parent)
    previous = _set_aside(state)
    try:
        fresh.rename(state)
    except OSError as error:
        if previous:
            try:
                previous.rename(state)
            except OSError:
                raise OSError(error.errno, f"{error.strerror}; what was there is in {previous}", str(state)) from None
        raise
    sync_path(state.parent)
    return previous


@contextlib.contextmanager
def _damage_told(source: Path) -> Iterator[None]:
    try:
        yield
    except _DAMAGE as error:
        raise ArchiveError(f"{source} is damaged, or no archive of `force-gateway backup` (tar.gz): {error}") from None


def _read_to_the_end(source: Path) -> None:
    """The checksum of a gzip file stands at its end, and tarfile does not look that far."""
    with gzip.open(source) as stream:
        while stream.read(1 << 20):
            pass


def _files(state: Path) -> Iterator[Path]:
    """Directories and plain files, parents first; links and sockets stay behind. The audit's head goes before anybody looks
    which files of lines there are: those that come meanwhile are beyond it, else it would name some that are not there. OSError
    for a directory that may not be read: a backup without it would be taken for a whole one."""
    if is_file(head := state / HEAD) and not head.is_symlink():
        yield head
    for path in sorted(state.iterdir()):
        if path == head or path.is_symlink() or not (is_directory(path) or is_file(path)):
            continue
        yield path
        if is_directory(path):
            with contextlib.suppress(FileNotFoundError):  # removed meanwhile
                yield from _files(path)


def _is_kept(path: Path, state: Path) -> bool:
    """Decide whether a file is of the state, and not of a gateway that runs on it."""
    return path.parent != state or path.name not in _LEFT_OUT


def _add(archive: tarfile.TarFile, path: Path, name: str) -> None:
    """Add one. A file is opened before it is measured: one that is replaced in between would be cut, or end the backup."""
    if is_directory(path):
        archive.add(path, name, recursive=False)
        return
    with open_plain_stream(path) as stream:
        archive.addfile(archive.gettarinfo(arcname=name, fileobj=stream), stream)


def _add_manifest(archive: tarfile.TarFile, state: Path) -> None:
    facts = {"format": _FORMAT, "force-gateway": VERSION, "rig": state.name, "made_utc": datetime.now(UTC).isoformat()}
    text = json.dumps(facts).encode()
    member = tarfile.TarInfo(_MANIFEST)
    member.size = len(text)
    archive.addfile(member, io.BytesIO(text))


def _check(archive: tarfile.TarFile, members: list[tarfile.TarInfo]) -> None:
    """ArchiveError for what `pack` does not write; each name stands for one thing, so that each can be extracted."""
    first = archive.extractfile(members[0]) if members and members[0].name == _MANIFEST else None
    form = None if first is None else _format_of(first.read(_LONGEST_MANIFEST))
    if form is None:
        raise ArchiveError(f"{archive.name!s} was not made by `force-gateway backup`")
    if form != _FORMAT:
        raise ArchiveError(f"{archive.name!s} has format {form}; this version reads {_FORMAT}")
    folders, seen = {_TOP}, set[str]()
    for member in members[1:]:
        parent, _, name = member.name.rpartition("/")
        is_new = member.name not in seen and bool(name) and parent in folders
        if not is_new or name in (".", "..") or not (member.isfile() or member.isdir()) or _is_left_out(parent, name):
            raise ArchiveError(f"{archive.name!s} holds {member.name}, which no backup does: refused as a whole")
        seen.add(member.name)
        if member.isdir():
            folders.add(member.name)


def _format_of(manifest: bytes) -> object:
    """Return what a manifest says its format is; None for one that is none."""
    try:
        facts = json.loads(manifest)
    except (ValueError, RecursionError):
        return None
    return facts.get("format") if isinstance(facts, dict) else None


def _is_left_out(parent: str, name: str) -> bool:
    """Decide whether a running gateway makes it: from an archive it would say that one runs, or did not end well."""
    return parent == _TOP and name in _LEFT_OUT


def _set_aside(state: Path) -> Path | None:
    """Rename what is there; an empty directory stays, for another one may take its name."""
    if not exists(state) or not any(state.iterdir()):
        return None
    number = 1
    while exists(previous := place_before_restore(state, number)):
        number += 1
    return state.rename(previous)
