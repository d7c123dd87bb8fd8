"""A disk whose power may be cut after any call: what it may hold then, without a second machine and without root.

This is the model of a file system image that is frozen at some write. Every change beneath a folder is noted in order: data
of a file, names in a directory, and what was synced. After a cut, what was synced before it is there; of what was not, any
part may be: data lost, torn in the middle, or there while data before them are not (zeros stand in the gap); names made,
renamed or removed, or not, in any mixture, but a rename as a whole. An fsync of a file is not one of its name, nor the other
way round: POSIX promises no more, and a program that holds here holds on any file system that keeps that promise.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any, Final

from tests.disk.watched_disk import Call, WatchedDisk

MODES: Final = ("nothing", "everything", "names only", "data only", "some")
LAST: Final = "the last alone"
"""Of what was not synced, before all that came sooner: whatever relies on an order without a sync shows by this."""


@dataclass(frozen=True, slots=True)
class Change:
    """One step: data of a node (at, or cut to a size), names of a directory, or a sync of a node.

    links: (directory, name, node or None) that come about together.
    """

    node: int = 0
    data: bytes | None = None
    at: int = 0
    size: int | None = None
    links: tuple[tuple[int, str, int | None], ...] = ()
    is_sync: bool = False


@dataclass
class Tree:
    """files: data by node; folders: nodes by name, by node. Node 0 is the folder itself."""

    files: dict[int, bytes] = field(default_factory=dict)
    folders: dict[int, dict[str, int]] = field(default_factory=lambda: {0: {}})

    def copy(self) -> "Tree":
        return Tree(dict(self.files), {node: dict(names) for node, names in self.folders.items()})

    def apply(self, change: Change, data: bytes | None = None) -> None:
        """Make a change, of its data what is given."""
        for folder, name, node in change.links:
            self.folders.setdefault(folder, {}).pop(name, None)
            if node is not None:
                self.folders[folder][name] = node
        if change.size is not None:
            self.files[change.node] = self.files.get(change.node, b"")[: change.size].ljust(change.size, b"\0")
        if data:
            before = self.files.get(change.node, b"").ljust(change.at, b"\0")
            self.files[change.node] = before[: change.at] + data + before[change.at + len(data) :]

    def write_to(self, target: Path, node: int = 0) -> None:
        """Make the folder as it is found when the power is back."""
        target.mkdir()
        for name, inner in self.folders.get(node, {}).items():
            if inner in self.folders:
                self.write_to(target / name, inner)
            else:
                (target / name).write_bytes(self.files.get(inner, b""))


class JournaledDisk(WatchedDisk):
    """Notes every change beneath its folder, and what was acknowledged after how many of them."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.begin, self._live = Tree(), Tree()
        self.changes: list[Change] = []
        self.said: list[tuple[int, Any]] = []
        self._nodes = 0
        self._is_there = False
        self._read(folder, 0)
        self._live = self.begin.copy()

    def say(self, what: Any) -> None:
        """Something was acknowledged now."""
        self.said.append((len(self.changes), what))

    def said_before(self, cut: int) -> list[Any]:
        return [what for at, what in self.said if at <= cut]

    def before(self, call: Call) -> None:
        self._is_there = os.path.lexists(call.path)

    def after(self, call: Call, result: Any) -> None:
        note = getattr(self, f"_note_{call.what}", None)
        if note:
            note(call, result)

    def states(self, cut: int, seed: int) -> Iterator[tuple[str, Tree]]:
        """What the folder may hold after a cut behind so many changes."""
        for mode in (*MODES, LAST):
            yield mode, self._state(cut, mode, Random(f"{seed} {cut} {mode}"))

    def _state(self, cut: int, mode: str, chance: Random) -> Tree:
        tree, is_synced = self.begin.copy(), self._synced(cut)
        for at, change in enumerate(self.changes[:cut]):
            is_name = bool(change.links)
            reaches = {"nothing": False, "everything": True, "names only": is_name, "data only": not is_name}
            reaches[LAST] = at == cut - 1
            if is_synced(at) or reaches.get(mode, chance.random() < 0.5):
                whole = is_synced(at) or mode != "some" or chance.random() < 0.5
                data = change.data or b""
                tree.apply(change, data if whole else data[: chance.randrange(len(data) + 1)])
            for _, _, node in change.links:
                if node is not None and node in self._live.folders:
                    tree.folders.setdefault(node, {})
        return tree

    def _synced(self, cut: int) -> Any:
        last = {change.node: at for at, change in enumerate(self.changes[:cut]) if change.is_sync}

        def is_synced(at: int) -> bool:
            change = self.changes[at]
            nodes = [folder for folder, _, _ in change.links] or [change.node]
            return any(last.get(node, -1) > at for node in nodes)

        return is_synced

    # -- what is noted

    def _read(self, folder: Path, node: int) -> None:
        """Links, pipes and sockets are gone behind a power cut."""
        for path in sorted(folder.iterdir()):
            if path.is_symlink() or not (path.is_dir() or path.is_file()):
                continue
            self._nodes += 1
            self.begin.folders[node][path.name] = inner = self._nodes
            if path.is_dir():
                self.begin.folders[inner] = {}
                self._read(path, inner)
            else:
                self.begin.files[inner] = path.read_bytes()

    def _node(self, path: str) -> int:
        node = 0
        for part in Path(path).relative_to(self.folder).parts:
            node = self._live.folders[node][part]
        return node

    def _place(self, path: str) -> tuple[int, str]:
        return self._node(str(Path(path).parent)), Path(path).name

    def _add(self, change: Change) -> None:
        self.changes.append(change)
        self._live.apply(change, change.data)

    def _note_create(self, call: Call, descriptor: int) -> None:
        if not self._is_there:
            self._nodes += 1
            self._live.files[self._nodes] = b""
            self._add(Change(links=((*self._place(call.path), self._nodes),)))
        elif call.flags & os.O_TRUNC:
            self._add(Change(self._node(call.path), size=0))

    def _note_mkdir(self, call: Call, _: Any) -> None:
        self._nodes += 1
        self._live.folders[self._nodes] = {}
        self._add(Change(links=((*self._place(call.path), self._nodes),)))

    def _note_write(self, call: Call, written: int) -> None:
        at = os.lseek(call.descriptor, 0, os.SEEK_CUR) - written
        self._add(Change(self._node(call.path), data=call.data[:written], at=at))

    def _note_truncate(self, call: Call, _: Any) -> None:
        self._add(Change(self._node(call.path), size=call.size))

    def _note_fsync(self, call: Call, _: Any) -> None:
        self._add(Change(self._node(call.path), is_sync=True))

    def _note_rename(self, call: Call, _: Any) -> None:
        node = self._node(call.path)
        self._add(Change(links=((*self._place(call.path), None), (*self._place(call.to), node))))

    def _note_unlink(self, call: Call, _: Any) -> None:
        self._add(Change(links=((*self._place(call.path), None),)))

    _note_rmdir = _note_unlink
