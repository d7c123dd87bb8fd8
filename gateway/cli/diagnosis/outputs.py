"""Files of an answer: all of them whole, or none, and never over what they were made from."""

import contextlib
import errno
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import click

from gateway.cli.diagnosis.progress_line import handle_interrupt
from gateway.cli.errors import already_exists
from gateway.plain_file import exists, is_directory, is_file
from gateway.processes.durable_file import sync_path

STDOUT: Final = Path("-")  # as the name of a file
_OURS: Final = "Written by force-gateway diagnose"  # at the head of what --extend and --plan write
_HEAD_CHARACTERS: Final = 500


def check_targets(targets: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise UsageError where two outputs, or an output and an input, are one file, FileNotFoundError where no directory is,
    IsADirectoryError where one is in the place of a file, OSError where links lead in a circle, E405 where a rig, a plant
    or another profile that somebody wrote would be lost."""
    occupied = {path.resolve(): f"{path} is read" for path in inputs if exists(path)}
    for target in targets:
        with contextlib.suppress(FileNotFoundError):
            target.stat()  # links that lead in a circle lead nowhere
        if target.resolve() in occupied:
            raise click.UsageError(f"{target} would be overwritten: {occupied[target.resolve()]}")
        occupied[target.resolve()] = f"{target} is written by another option"
        _refuse_place(target)
        if _is_written_by_hand(target):
            raise already_exists(target, "diagnose has not written it: name another file")


def check_page(target: Path, inputs: Iterable[Path]) -> None:
    """Raise what `check_targets` does, and UsageError where the name says that it is no HTML: no program would open it."""
    check_targets([target], inputs)
    if target.suffix.lower() not in ("", ".html", ".htm"):
        raise click.UsageError(f"{target}: an HTML file ends in .html")


def _is_written_by_hand(target: Path) -> bool:
    """Decide whether a target is YAML that is not ours: `--extend my-cell.yaml` made a plant of the rig's file."""
    if target.suffix not in (".yaml", ".yml") or not is_file(target):
        return False
    head = target.read_bytes()[:_HEAD_CHARACTERS].decode("utf-8", "replace")
    return bool(head.strip()) and _OURS not in head


def write_all(texts: Mapping[Path, str]) -> None:
    """Write each text beside its name first, and rename them only when all are on the disk. OSError, and no file has
    changed.

    A device (/dev/null, a terminal) is written to in the end: nobody wants it replaced by a file. Ctrl-C before the first
    is renamed: KeyboardInterrupt, and no file has changed either; later it comes too late.
    """
    pressed: list[int] = []  # no Event: its lock may be held where the handler comes in
    with handle_interrupt(lambda number, frame: pressed.append(number)):
        _write_all(texts, pressed)


def _write_all(texts: Mapping[Path, str], pressed: Sequence[int]) -> None:
    for path in texts:
        _refuse_place(path)
    devices = [path for path in texts if exists(path) and not is_file(path)]
    places = {path: Path(os.path.realpath(path)) for path in texts if path not in devices}  # a link stays one
    beside = {path: place.with_name(f".{place.name}.{os.getpid()}") for path, place in places.items()}
    try:
        for path, fresh in beside.items():
            with _told_by(path):
                fresh.write_text(texts[path], encoding="utf-8")
                sync_path(fresh)
        if pressed:
            raise KeyboardInterrupt
        for path, fresh in beside.items():
            fresh.replace(places[path])
        for folder in {place.parent for place in places.values()}:
            sync_path(folder)
    finally:
        for fresh in beside.values():
            fresh.unlink(missing_ok=True)
    for path in devices:
        with _told_by(path):
            path.write_text(texts[path], encoding="utf-8")


@contextlib.contextmanager
def _told_by(path: Path) -> Iterator[None]:
    """Have an OSError name the file that was asked for: that of a full disk names none, others the one beside it."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None


def _refuse_place(target: Path) -> None:
    if not is_directory(target.parent):
        raise FileNotFoundError(errno.ENOENT, "no such directory", str(target.parent))
    if is_directory(target):
        raise IsADirectoryError(errno.EISDIR, "it is a directory, and no file", str(target))
