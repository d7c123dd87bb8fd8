"""What a person does to the files of a state directory, and takes back in the end."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from tests.disk.drawn.players.player import Player

if TYPE_CHECKING:
    from tests.disk.drawn.scene import Scene

ODD_NAMES = ("0001 (copy).fgr", "ä\u2028ö.yaml", "\udcff\udcfe.fgr", "00000000000000000.fgr", "-rf", "a\nb.jsonl", "~")


class People:
    """moved: what was moved away, and where from."""

    def __init__(self, scene: "Scene") -> None:
        self.scene, self.rng = scene, scene.rng
        self._moved: list[tuple[Path, Path, str]] = []
        self._elsewhere = scene.unseen / "elsewhere"

    def meddle(self, player: Player) -> None:
        """Do one thing to something of a player's."""
        with self.scene.disk.aside():
            files = [path for name in player.folders for path in sorted(self.scene.state.glob(name)) if path.exists()]
            files += [path for folder in files if folder.is_dir() for path in sorted(folder.iterdir())]
            if not files:
                return
            path = self.rng.choice(files)
            deed: Callable[[Path], str] = self.rng.choice(
                [self._hide, self._delete, self._cut, self._alter, self._replace, self._replace, self._add, self._add]
            )
            if said := deed(path):
                self.scene.note(
                    f"a person: {said} {path.relative_to(self.scene.state)!s:}".encode(errors="replace").decode()
                )
        self.scene.disk.note_all()
        for one in self.scene.players:
            if said and (one is player or self._holds(path, one)):
                one.is_touched = one.is_touched or deed not in (self._add, self._hide)

    def _holds(self, path: Path, player: Player) -> bool:
        """A place of the player's is within this folder."""
        return any((self.scene.state / name).is_relative_to(path) for name in player.folders)

    def undo(self) -> None:
        """Put back what stands where something else was put."""
        with self.scene.disk.aside():
            for path, moved, kind in reversed(self._moved):
                if path.is_symlink() or not path.is_dir():
                    path.unlink(missing_ok=True)
                elif kind == "folder":
                    shutil.rmtree(path)
                if not path.exists() and path.parent.is_dir():
                    moved.rename(path)
            self._moved.clear()
        self.scene.disk.note_all()

    def _hide(self, path: Path) -> str:
        self.scene.disk.unreadable.add(str(path))
        return "makes unreadable"

    def _delete(self, path: Path) -> str:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
        return "deletes"

    def _cut(self, path: Path) -> str:
        if not path.is_file():
            return ""
        size = path.stat().st_size
        os.truncate(path, self.rng.choice([0, size // 2, max(0, size - 1), size + 5000]))
        return "truncates"

    def _alter(self, path: Path) -> str:
        if not path.is_file() or not (data := bytearray(path.read_bytes())):
            return ""
        for _ in range(self.rng.choice([1, 5])):
            data[self.rng.randrange(len(data))] = self.rng.choice([0, 0x0A, 0x30, 0xFF])
        with path.open("r+b") as stream:
            stream.write(data)
        return "alters"

    def _replace(self, path: Path) -> str:
        """Something else in its place; what was there comes back in the end."""
        self._elsewhere.mkdir(exist_ok=True)
        moved = self._elsewhere / f"{len(list(self._elsewhere.iterdir()))}"
        path.rename(moved)
        kind = self.rng.choice(["folder", "pipe", "link", "loop", "dangling", "file", "nothing"])
        self._moved.append((path, moved, kind))
        match kind:
            case "folder":
                path.mkdir()
            case "pipe":
                os.mkfifo(path)
            case "link":
                path.symlink_to(moved)
            case "loop":
                path.symlink_to(path)
            case "dangling":
                path.symlink_to(moved.with_name("nowhere"))
            case "file":
                path.write_bytes(b"something else\n" * self.rng.choice([0, 1, 300]))
        return f"puts a {kind} in place of"

    def _add(self, path: Path) -> str:
        folder = path if path.is_dir() else path.parent
        target = folder / self.rng.choice(ODD_NAMES)
        if os.path.lexists(target):
            return ""
        if self.rng.random() < 0.5:
            target.write_bytes(self.rng.randbytes(self.rng.choice([0, 10, 4000])))
        else:
            target.mkdir()
        return "adds an odd name beside"
