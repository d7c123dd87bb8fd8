"""Real file systems for a state directory: small enough to be filled, or one that turns read-only or hangs under open files.

Mounting is root's; where it cannot be done the tests that need it are skipped, and say why.
"""

import contextlib
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

SIZE_MB = 4
CHUNK = bytes(1 << 16)


def run(*words: str | Path) -> None:
    subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True)


@contextlib.contextmanager
def mounted(folder: Path, *options: str | Path) -> Iterator[Path]:
    """Mount something on a new folder; skip loudly where this machine does not allow it."""
    folder.mkdir()
    try:
        run("mount", *options, folder)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(
            f"cannot mount here ({getattr(error, 'stderr', '') or error}): needs root and a kernel that lets it"
        )
    try:
        yield folder
    finally:
        run("umount", folder)


@contextlib.contextmanager
def small_disk(folder: Path) -> Iterator[Path]:
    """A file system in memory that is full after a few megabytes."""
    with mounted(folder, "-t", "tmpfs", "-o", f"size={SIZE_MB}m", "tmpfs") as disk:
        yield disk


def fill(disk: Path) -> Path:
    """Leave no byte on it; return what takes the room."""
    ballast = disk / "ballast"
    descriptor = os.open(ballast, os.O_WRONLY | os.O_CREAT)
    try:
        for size in (len(CHUNK), 4096, 1):
            with contextlib.suppress(OSError):
                while os.write(descriptor, CHUNK[:size]):
                    pass
    finally:
        os.close(descriptor)
    return ballast


class FailingExt4:
    """An ext4 in a file, mounted so that an error turns it read-only, as it does to a worn memory card."""

    def __init__(self, image: Path) -> None:
        self.image = image

    @contextlib.contextmanager
    def mounted(self, folder: Path) -> Iterator[Path]:
        with self.image.open("wb") as file:
            file.truncate(32 << 20)
        try:
            run("mkfs.ext4", "-q", "-F", self.image)
        except (OSError, subprocess.CalledProcessError) as error:
            pytest.skip(f"no mkfs.ext4 here ({error})")
        with mounted(folder, "-o", "loop,errors=remount-ro", self.image) as disk:
            yield disk

    def break_under(self, disk: Path) -> None:
        """Have the kernel find an error: from now on the file system is read-only, also to files that are open."""
        device = disk.stat().st_dev
        name = Path(f"/sys/dev/block/{os.major(device)}:{os.minor(device)}").resolve().name
        trigger = Path("/sys/fs/ext4") / name / "trigger_fs_error"
        if not trigger.exists():
            pytest.skip(f"{trigger} is not there: this kernel cannot be asked for an error of ext4")
        trigger.write_text("asked for by a test")


@contextlib.contextmanager
def hanging(disk: Path) -> Iterator[None]:
    """Whoever writes to this file system waits, for as long as this lasts."""
    try:
        run("fsfreeze", "--freeze", disk)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"cannot freeze a file system here ({getattr(error, 'stderr', '') or error})")
    try:
        yield
    finally:
        run("fsfreeze", "--unfreeze", disk)
