"""Which recordings may go: not one that somebody keeps, nor the rig's reference, nor one that is being recorded.

Whoever records holds a lock on the file; the kernel ends it with the process. What is kept has a file NNNN.keep beside it.
A recording whose time is still to come was made before the clock was set back, one of before 2020 by a clock that nobody had
set: nobody knows their age, and they stand behind the one that has the number before. Otherwise such ones would have stayed for
a year, say, and every new one gone at once; or what was recorded right behind a power cut would have gone before all others.
"""

import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Final

from gateway.plain_file import closing_descriptor, exists, open_plain
from gateway.processes.durable_file import give_to_owner, lock_directory, remove_if_possible
from gateway.profiles.recordings_section import Retention
from gateway.recording.layout import SUFFIX, number_in
from gateway.recording.reader import recording_paths

_MARK: Final = ".keep"
_GONE: Final = ".gone"  # of the highest number that was deleted: it is not used again
CLOCK_SET_S: Final = 1_577_836_800.0  # 2020: an earlier time is of a clock that nobody had set, as after a power cut
CLOSED_S: Final = 5.0  # rows come ten times a second: what was written later than this is being recorded, lock or not


def keep_recording(path: Path) -> None:
    """Have a recording kept, whatever becomes of others. OSError where the disk refuses."""
    mark = path.with_suffix(_MARK)
    try:
        with lock_directory(path.parent) as descriptor:
            _set_mark(descriptor, mark.name)
    except OSError as error:  # of the descriptor it knows the name alone
        raise OSError(error.errno, error.strerror, str(mark)) from None


def let_recording_go(path: Path) -> None:
    """Have a recording kept no longer."""
    path.with_suffix(_MARK).unlink(missing_ok=True)


def is_kept(path: Path) -> bool:
    """Decide whether somebody keeps this recording."""
    return exists(path.with_suffix(_MARK))


def is_being_recorded(path: Path) -> bool:
    """Decide whether somebody holds the lock of this recording. FileNotFoundError where there is none."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def why_protected(path: Path, reference: str) -> str:
    """Return why a recording must stay, as the end of a sentence; empty where it may go. reference: the rig's, by its file's
    name. FileNotFoundError where there is no such recording."""
    if is_being_recorded(path):
        return "it is being recorded"
    if is_kept(path):
        return "it is kept"
    return "it is the rig's reference" if path.name == reference else ""


@dataclass(frozen=True, slots=True)
class Prunable:
    """A recording that goes, and why."""

    path: Path
    size_bytes: int
    why: str


def choose_prunable(
    paths: list[Path], retention: Retention, reference: str, now_s: float, needed: frozenset[str] = frozenset()
) -> list[Prunable]:
    """Return the recordings that the limits have no room for, the oldest first. now_s: of the epoch; needed: names of those
    that somebody will read again, such as a calibration's ladder."""
    ended = sorted(_with_ends(paths, now_s), key=lambda one: one[0])  # of the same time by number, as they come
    total, chosen = sum(status.st_size for _, status, _ in ended), []
    for _, status, path in ended:
        age_s = now_s - status.st_mtime if status.st_mtime >= CLOCK_SET_S else None
        why = _why_it_goes(age_s, total, retention)
        is_needed = path.name in needed or abs(now_s - status.st_mtime) <= CLOSED_S
        if why and not is_needed and _may_go(path, reference):
            chosen.append(Prunable(path, status.st_size, why))
            total -= status.st_size
    return chosen


def _with_ends(paths: list[Path], now_s: float) -> Iterator[tuple[float, os.stat_result, Path]]:
    """With the time at which each ended, as far as the clock of now goes along with it. paths: by number."""
    ended_s = -inf
    for status, path in _statuses(paths):
        ended_s = status.st_mtime if CLOCK_SET_S <= status.st_mtime <= now_s + CLOSED_S else ended_s
        yield ended_s, status, path


def _statuses(paths: list[Path]) -> Iterator[tuple[os.stat_result, Path]]:
    """Of those that are there still: the page, or somebody at a terminal, may delete at the same time."""
    for path in paths:
        with contextlib.suppress(FileNotFoundError):
            yield path.stat(), path


def _may_go(path: Path, reference: str) -> bool:
    """What has gone already need not go; of what cannot be looked at, another user's say, its deletion tells."""
    try:
        return not why_protected(path, reference)
    except FileNotFoundError:
        return False
    except OSError:
        return True


def _why_it_goes(age_s: float | None, total_bytes: int, retention: Retention) -> str:
    """age_s: None where nobody knows."""
    if retention.days is not None and age_s is not None and age_s > retention.days * 86400.0:
        return f"older than {retention.days:g} days"
    if retention.bytes is not None and total_bytes > retention.bytes:
        return f"all have more than {retention.bytes} bytes"
    return ""


def delete_recording(path: Path, reference: str) -> str:
    """Remove a recording; return why it had to stay, empty where it is gone. OSError where the disk refuses.

    Its number is marked first where it is the highest, for that one would be given again. The mark of any other one is not
    needed, and so what is deleted on a full disk needs no room.
    """
    with lock_directory(path.parent) as descriptor:
        if why := why_protected(path, reference):  # in the lock: it may have been kept a moment ago
            return why
        is_highest = not _has_next(path) and int(path.stem) == max(_numbers(path.parent), default=0)
        if is_highest:
            _set_mark(descriptor, path.with_suffix(_GONE).name)
        path.unlink()
        remove_if_possible(descriptor, path.with_suffix(_MARK).name)
        os.fsync(descriptor)
        if is_highest:
            _keep_highest_mark(path.parent, descriptor)
    return ""


def drop_empty_recording(path: Path) -> None:
    """Remove a recording without a row, that a full disk has ended, say. OSError where the disk refuses.

    Its name becomes the mark of its number, which needs no room: those before may have been deleted without one.
    """
    path.rename(path.with_suffix(_GONE))
    with lock_directory(path.parent) as descriptor:
        _keep_highest_mark(path.parent, descriptor)


def _set_mark(folder: int, name: str) -> None:
    """Have an empty file of this name on the disk: it cannot be half, and so needs none beside it that a kill could leave."""
    with closing_descriptor(open_plain(name, os.O_WRONLY | os.O_CREAT, 0o640, directory=folder)) as descriptor:
        give_to_owner(descriptor, name, folder)
    os.fsync(folder)


def _has_next(path: Path) -> bool:
    """Decide it for all but a few at once: to look through 100 000 names for each took turns of control's process."""
    following = f"{int(path.stem) + 1:04d}"
    return any(exists(path.with_name(following + suffix)) for suffix in (SUFFIX, _GONE))


def _numbers(folder: Path) -> list[int]:
    return [number for path in folder.iterdir() if (number := number_in(path)) is not None]


def _keep_highest_mark(folder: Path, descriptor: int) -> None:
    marks = ((number, path) for path in folder.glob(f"*{_GONE}") if (number := number_in(path)) is not None)
    *lower, _ = sorted(marks)
    for _, mark in lower:
        remove_if_possible(descriptor, mark.name)


def prune_recordings(
    state: Path, retention: Retention, reference: str, needed: frozenset[str] = frozenset()
) -> list[Prunable]:
    """Remove what the limits have no room for; return what has gone. One that the disk does not let go keeps no other one;
    OSError where it lets none go."""
    gone, refusals = [], []
    for one in choose_prunable(recording_paths(state), retention, reference, time.time(), needed):
        try:
            if not delete_recording(one.path, reference):
                gone.append(one)
        except FileNotFoundError:
            continue
        except OSError as error:
            refusals.append(error)
    if refusals and not gone:
        raise refusals[0]
    return gone
