"""The audit in the state directory: `audit/000000000001.jsonl` and so on, each named by the number of its first line.

Lines are only ever added. A full file is left as it is and the next one begun, and the chain goes on in it; of files beyond
those that are kept the oldest goes, and a line says which lines went and what their last hash was. After each sync `audit/head`
is replaced: number and hash of the last line that is on the disk. So lines that were cut off at the end are missed, and a
power cut, after which the files may hold more than the head says but never less, is told apart from that. A new audit begins
with a head of no line, and a new file's name is on the disk before its first line is.

Lines are written as they come, and synced behind: what a killed process has written the kernel keeps, also on a disk whose
sync takes seconds. What a killed writer has left of a line, and what a power cut has left of lines that were not synced, is
cut off at the next start, and the first line after it quotes it. A file that is removed or replaced while it is written takes
no more lines, for nobody would find them: the chain goes on in another one, and tells of it. Everything here waits for the
disk: it runs in threads beside the loop.
"""

import contextlib
import errno
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

from gateway.audit.chain import NO_HASH, BrokenLine, ChainEnd, open_line, seal_line
from gateway.audit.file_lines import count_lines, read_end, read_line
from gateway.audit.unsynced_lines import cut_unsynced
from gateway.plain_file import exists, is_directory, open_plain, open_plain_stream, other_kind
from gateway.processes.durable_file import make_directory, read_object, sync_path
from gateway.processes.state_directory import AUDIT

HEAD: Final = "head"
LONGEST_BYTES: Final = 8 << 20
KEPT: Final = 32
"""Files, the one that is written among them: 256 MiB, years of a cell's edges and of summaries of its setpoints."""
BROKEN: Final = "chain broken"
_NO_HEAD: Final = (errno.ENOENT, errno.ENOTDIR, errno.EFBIG)
Fields = Mapping[str, Any]


def audit_files(folder: Path) -> list[Path]:
    """Return the files of the chain, oldest first. OSError for a folder that may not be read: it is not an empty one."""
    try:
        paths = sorted(folder.iterdir())
    except (FileNotFoundError, NotADirectoryError):
        return []
    return [path for path in paths if path.suffix == ".jsonl" and path.stem.isdecimal()]


def read_head(folder: Path) -> ChainEnd | None:
    """Return what the head says; None where there is none that says anything. OSError where the disk does not give it now: it
    may be whole."""
    path = folder / HEAD
    try:
        fields = {} if other_kind(path) else read_object(path)
        return ChainEnd(int(fields["n"]), str(fields["sha256"]))
    except OSError as error:
        if error.errno not in _NO_HEAD:
            raise
    except (ValueError, KeyError, TypeError, OverflowError):
        pass
    return None


def first_number(path: Path) -> int:
    """Return the number of a file's first line, which is its name."""
    return int(path.stem)


def _line_at(path: Path, number: int) -> ChainEnd | None:
    """Return number and hash of a line of this file; None where it is not there, or not as it was written."""
    try:
        return open_line(read_line(path, number - first_number(path)))[1]
    except (BrokenLine, IndexError):
        return None


class Place(NamedTuple):
    """How far a file goes, bytes, and the chain with it."""

    size: int = 0
    end: ChainEnd = ChainEnd()


class Written(NamedTuple):
    """What a write has done. place: what `sync` is to be given; found: what was found broken, told once."""

    place: Place
    found: tuple[str, ...] = ()


class AuditFile:
    """The writer of one state directory. `write` before `sync`; neither twice at a time, one beside the other."""

    def __init__(self, state: Path, longest_bytes: int = LONGEST_BYTES, kept: int = KEPT) -> None:
        self._folder = state / AUDIT
        self._longest_bytes, self._kept = longest_bytes, kept
        self._head, self._fresh_head = self._folder / HEAD, self._folder / f"{HEAD}.new"
        self._path, self._descriptor = self._folder, -1
        self._written = self._synced = Place()  # one assignment each: the other thread reads them
        self._is_open = self._is_torn = False
        self._found: tuple[str, ...] = ()
        self._untold: list[Fields] = []

    def write(self, records: Iterable[Fields], *, again: bool = False) -> Written | None:
        """Put these records at the end, all or none: a killed process has left them, a power cut may take them until `sync` has
        come back. Return None, and nothing is written, where another file is to be begun and what is written must be synced
        before. OSError when the disk does not take them.

        again: whatever has not been synced is among them, and is taken out first. No sync is under way then.
        """
        if again:
            self._take_back()
        if self._written == self._synced:
            self._begin()
        elif self._is_full or self._is_removed():
            return None
        self._add(records)
        found, self._found = self._found, ()
        return Written(self._written, found)

    def sync(self, place: Place) -> None:
        """Have what was written up to this place outlive a power cut, and the head name it. OSError when the disk does not keep
        it: no more counts as synced than whoever asks will be told of."""
        os.fsync(self._descriptor)
        with contextlib.suppress(OSError):  # an old head is no fault: it promises less than there is
            self._write_head(place.end)
        self._synced = place  # last: from here on another file may be begun

    def close(self) -> None:
        """Close the file."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    @property
    def _is_full(self) -> bool:
        return self._written.size >= self._longest_bytes

    def _begin(self) -> None:
        """Make ready for more lines, in this file or another one, while nobody syncs."""
        self._cut_torn()
        if not self._is_open:
            self._start()
        elif self._is_removed():
            self._go_on_elsewhere()
        elif self._is_full:
            self._rotate()
        if self._untold:
            self._add_durably(self._untold)
            self._untold.clear()

    def _is_removed(self) -> bool:
        """Decide whether the path of the file leads elsewhere than to the one that is written, or nowhere."""
        try:
            return not os.path.samestat(self._path.stat(), os.fstat(self._descriptor))
        except (FileNotFoundError, NotADirectoryError):
            return True

    def _go_on_elsewhere(self) -> None:
        """Begin another file behind the last line; what comes first in it tells of the one that is gone. OSError where the
        folder cannot be made again, as where the whole state directory was moved away."""
        if not is_directory(self._folder.parent):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(self._folder.parent))
        make_directory(self._folder)
        gone = f"{self._path.name} was removed or replaced while it was written"
        self._open(self._path_behind(self._written.end), self._written.end)
        text = f"A352 {gone}: lines up to {self._written.end.number} of the audit may be gone"
        self._untold.append({"what": BROKEN, "text": text})
        self._found = (text,)

    def _start(self) -> None:
        """Continue the chain that is there: what is torn goes, and a line tells of it, and of what is broken."""
        make_directory(self._folder)
        files, head = audit_files(self._folder), read_head(self._folder)
        end, found = ChainEnd(first_number(files[-1]) - 1 if files else 0), list[Fields]()
        if files:
            end, found = self._continue(files[-1], end, head)
        if (text := self._doubt(head, files, end)) and not any(each["what"] == BROKEN for each in found):
            found.append({"what": BROKEN, "text": f"A352 {text}"})
            # number and hash that were there, or none: verify finds the gap
            end = head if head and head.number >= end.number else ChainEnd(end.number, NO_HASH)
        if not files and head is None:
            self._write_head(end)
            sync_path(self._folder)
        goes_on = files and (files[-1].stat().st_size or first_number(files[-1]) == end.number + 1)
        self._open(files[-1] if goes_on else self._path_behind(end), end)
        self._is_open = True
        self._untold += found
        self._found = tuple(str(each["text"]) for each in found if each["what"] == BROKEN)

    def _doubt(self, head: ChainEnd | None, files: list[Path], end: ChainEnd) -> str:
        """Return what the head does not find; empty where the files hold what it names, and perhaps more. The next batch
        replaces it, so it is asked now."""
        if head is None:
            return (
                "the audit has lines and no head that can be read: lines at its end may have been removed"
                if files
                else ""
            )
        if head.number > end.number:
            return f"the audit ends with line {end.number}, it had {head.number}: lines at its end were removed"
        holding = [path for path in files if first_number(path) <= head.number]
        if not holding or _line_at(holding[-1], head.number) == head:
            return ""  # or of a file that is not kept any more
        return f"line {head.number} of the audit is another than its head names: it was written anew"

    def _continue(self, path: Path, before: ChainEnd, head: ChainEnd | None) -> tuple[ChainEnd, list[Fields]]:
        """Return the end of the chain in its newest file, before where it has no line, and what is found wrong there."""
        found: list[Fields] = []
        if torn := cut_unsynced(path, head):
            found.append({"what": "torn line", "text": torn.text, "torn": torn.quote})
        if last := read_end(path).last:
            try:
                return open_line(last)[1], found
            except BrokenLine as broken:
                count = count_lines(path)
                found.append({"what": BROKEN, "text": f"A352 {path.name} line {count} {broken}"})
                return ChainEnd(first_number(path) + count - 1, NO_HASH), found
        older = [each for each in audit_files(self._folder) if first_number(each) < first_number(path)]
        if older:  # begun, and killed before its first line: the end is in the file before
            end, found_before = self._continue(older[-1], before, head)
            return end, found_before + found
        return before, found

    def _add(self, records: Iterable[Fields]) -> None:
        lines, (size, end) = [], self._written
        for fields in records:
            line, end = seal_line(fields, end)
            lines.append(line)
        data = b"".join(lines)
        self._cut_torn()
        self._is_torn = True  # until all of it is written
        try:
            written = 0
            while written < len(data):
                written += os.write(self._descriptor, data[written:])
        except OSError:
            with contextlib.suppress(OSError):  # else the next batch, or the next start, cuts it off
                self._cut_torn()
            raise
        self._is_torn = False
        self._written = Place(size + len(data), end)

    def _add_durably(self, records: Iterable[Fields]) -> None:
        self._add(records)
        try:
            self.sync(self._written)
        except OSError:
            self._take_back()
            raise

    def _take_back(self) -> None:
        if self._written != self._synced:
            self._written, self._is_torn = self._synced, True

    def _cut_torn(self) -> None:
        if self._is_torn:
            os.ftruncate(self._descriptor, self._written.size)
            self._is_torn = False

    def _write_head(self, end: ChainEnd) -> None:
        text = json.dumps({"n": end.number, "sha256": end.sha256})
        with open_plain_stream(self._fresh_head, "wb") as stream:
            stream.write(text.encode("ascii"))
            stream.flush()
            os.fsync(stream.fileno())
        self._fresh_head.replace(self._head)

    def _rotate(self) -> None:
        with contextlib.suppress(OSError):  # the file grows a little longer then
            os.fsync(self._descriptor)  # of a process that was killed before its sync
            self._open(self._path_behind(self._written.end), self._written.end)
            self._drop_oldest()

    def _drop_oldest(self) -> None:
        *full, newest = audit_files(self._folder)
        files = [path for path in full if path.stat().st_size] + [newest]  # none that was begun only, and could not go
        for path in files[: max(0, len(files) - self._kept)]:
            try:
                _, end = open_line(read_end(path).last)
            except BrokenLine:  # somebody has altered it: it stays, as evidence
                continue
            text = (
                f"lines {first_number(path)} to {end.number} were dropped with {path.name}: {self._kept} files are kept"
            )
            dropped = {"what": "dropped", "text": text, "dropped_to": end.number, "dropped_sha256": end.sha256}
            self._add_durably([dropped])
            path.unlink()

    def _path_behind(self, end: ChainEnd) -> Path:
        return self._folder / f"{end.number + 1:012d}.jsonl"

    def _open(self, path: Path, end: ChainEnd) -> None:
        is_new = not exists(path)
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT
        descriptor = open_plain(path, flags, 0o600)
        try:
            if is_new:
                sync_path(self._folder)
        except OSError:
            os.close(descriptor)
            with contextlib.suppress(OSError):
                path.unlink()
            raise
        self.close()
        self._path, self._descriptor = path, descriptor
        self._written = self._synced = Place(os.fstat(descriptor).st_size, end)
