"""Reads the audit of a state directory, and judges its chain from the first line that is kept to the head.

A gateway may be writing meanwhile: a last line without its newline is no fault, and lines beyond the head are those since.
"""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from gateway.audit.audit_file import BROKEN, HEAD, audit_files, first_number, read_head
from gateway.audit.chain import BrokenLine, ChainEnd, check_link, open_line
from gateway.audit.file_lines import iterate_lines
from gateway.processes.state_directory import AUDIT


class AuditBreak(NamedTuple):
    """The first place where the chain does not hold. line: in its file, from 1; 0 for the file as a whole."""

    file: str
    line: int
    text: str


class AuditVerdict(NamedTuple):
    """lines: how many hold, from the first; end: the last of them; notes: what is as it should be, and worth knowing."""

    lines: int
    end: ChainEnd
    broken: AuditBreak | None
    notes: tuple[str, ...] = ()


def read_audit(state: Path, on_left_out: Callable[[], None] = lambda: None) -> Iterator[dict[str, Any]]:
    """Yield what the lines say, oldest first, whether or not the chain holds; what is no line is passed over. on_left_out:
    called at each whole line that is none of ours, such as one that was changed."""
    for path in audit_files(state / AUDIT):
        with contextlib.suppress(FileNotFoundError):  # the oldest may go meanwhile
            for line in iterate_lines(path):
                try:
                    fields, _ = open_line(line.text)
                except BrokenLine:
                    if line.is_whole:
                        on_left_out()
                    continue
                yield fields


def verify_audit(state: Path) -> AuditVerdict:
    """Follow the chain to its first break. FileNotFoundError where there is no audit, OSError where it cannot be read."""
    folder = state / AUDIT
    head, files = read_head(folder), audit_files(folder)  # in this order: the files may grow meanwhile
    if files and head is None:  # it may begin just now
        head, files = read_head(folder), audit_files(folder)
    if not files and head is None:
        raise FileNotFoundError(folder)
    walk = _ChainWalk(head)
    try:
        for path in files:
            try:
                walk.read(path, is_last=path == files[-1])
            except FileNotFoundError:
                if walk.count:
                    raise BrokenLine("is gone, or leads nowhere") from None  # else the oldest, which may go meanwhile
            except BrokenLine as broken:
                if not walk.may_be_unsynced or path != files[-1]:
                    raise
                walk.note_unsynced(broken)
        walk.check_ends(files[0].name if files else AUDIT)
    except BrokenLine as broken:
        return AuditVerdict(walk.count, walk.end, AuditBreak(walk.file, walk.line, str(broken)), tuple(walk.notes))
    return AuditVerdict(walk.count, walk.end, None, tuple(walk.notes))


class _ChainWalk:
    """One way along the chain; raises BrokenLine where it ends, `file` and `line` say where that is."""

    def __init__(self, head: ChainEnd | None) -> None:
        self.count, self.end = 0, ChainEnd()
        self.file, self.line = "", 0
        self.notes: list[str] = []
        self._head, self._is_head_met = head, head is not None and head.number == 0
        self._begins_after: ChainEnd | None = None
        self._dropped: set[ChainEnd] = set()

    def read(self, path: Path, *, is_last: bool) -> None:
        """Follow one file."""
        self.file, self.line = path.name, 0
        for line in iterate_lines(path):
            self.line += 1
            if line.is_whole:
                self._take(line.text, path)
            elif is_last:
                cause = "a kill, a power cut, or it is being written"
                self.notes.append(f"{path.name} ends in an incomplete line ({line.length} bytes): {cause}")
            else:
                raise BrokenLine("is incomplete, and a file follows")

    @property
    def may_be_unsynced(self) -> bool:
        """Decide whether what is read now stands behind all that was synced: the head's line has been met."""
        return self._is_head_met

    def note_unsynced(self, broken: BrokenLine) -> None:
        """Note that the chain ends behind the head, and something follows."""
        cause = "a power cut took what was not synced, or it is being written; a start cuts it off"
        self.notes.append(f"{self.file} line {self.line} {broken}: it stands behind the head: {cause}")

    def check_ends(self, first_file: str) -> None:
        """Check that nothing is missing before the first line that is kept, and after the last."""
        begin = self._begins_after or ChainEnd()
        if begin.number and begin not in self._dropped:
            self.file, self.line = first_file, 1
            self.count, self.end = 0, ChainEnd()  # those that hold stand behind the break
            raise BrokenLine(f"is number {begin.number + 1}, and no line says that those before it were dropped")
        self.file, self.line = HEAD, 0
        if self._head is None:
            raise BrokenLine("is missing or damaged: lines at the end may have been removed")
        if not self._is_head_met and self._head.number > begin.number:  # else its line was dropped meanwhile
            raise BrokenLine(
                f"names line {self._head.number}, the last that is there is {self.end.number}: the end was removed"
            )

    def _check_link(self, fields: Mapping[str, Any]) -> None:
        """A start that cannot go on with the chain says why in its first line, and that is what is broken."""
        try:
            check_link(fields, self.end)
        except BrokenLine:
            if fields.get("what") == BROKEN:
                text = str(fields.get("text")).removeprefix("A352 ")
                raise BrokenLine(f"tells what the start behind it has found: {text}") from None
            raise

    def _take(self, line: bytes, path: Path) -> None:
        fields, own = open_line(line)
        if self._begins_after is None:
            self._begins_after = self.end = ChainEnd(own.number - 1, str(fields.get("prev")))
        self._check_link(fields)
        if self.line == 1 and own.number != first_number(path):
            raise BrokenLine(f"has number {own.number}, its file is named by {first_number(path)}")
        if self._head and own.number == self._head.number:
            if own != self._head:
                raise BrokenLine("is another line than the one that head names: it was written anew")
            self._is_head_met = True
        if fields.get("what") == "dropped":
            dropped_to = fields.get("dropped_to")
            if isinstance(dropped_to, int):
                self._dropped.add(ChainEnd(dropped_to, str(fields.get("dropped_sha256"))))
        self.count, self.end = self.count + 1, own
