"""A real file system frozen while something is written to it, as a power cut leaves it: mounted elsewhere, all that was said is
there, and nothing is torn. What may come of every single write, on any file system, is asked in tests/disk/test_power_cut.py.

The writer is stopped, so that no sync of its is under way; what the kernel has not written by itself by then is lost.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

import psutil
import pytest

from gateway.audit.audit_reader import read_audit, verify_audit
from tests.end_to_end.disks.small_disks import FailingExt4, mounted
from tests.end_to_end.kills.test_upload_kill import Uploads, active_mark, uploads

pytestmark = pytest.mark.long
FREEZES = 40
assert uploads, "a fixture"

AUDITING = """
import sys
from itertools import count
from pathlib import Path
from gateway.audit.audit_file import AuditFile
from tests.audit.appending import append
file = AuditFile(Path(sys.argv[1]), longest_bytes=3000, kept=5)
for number in count(1):
    append(file, [{"what": "force_setpoint", "old": number, "new": number + 1}])
    print(number, flush=True)
"""


def freeze(pid: int) -> None:
    os.kill(pid, signal.SIGSTOP)
    while psutil.Process(pid).status() != psutil.STATUS_STOPPED:
        time.sleep(0.0005)


@contextmanager
def after_the_cut(image: Path, folder: Path) -> Iterator[Path]:
    """What is found when the power is back: the image as it is now, with its journal played."""
    copy = folder / "copy"
    shutil.copyfile(image, copy)
    with mounted(folder / "again", "-o", "loop", copy) as disk:
        yield disk
    (folder / "again").rmdir()


@pytest.fixture
def image(tmp_path: Path) -> Iterator[FailingExt4]:
    """On a disk in memory: it is copied as a whole each time."""
    folder = Path("/dev/shm") / f"frozen-{os.getpid()}"
    folder.mkdir()
    yield FailingExt4(folder / "image")
    shutil.rmtree(folder)


def test_commits(image: FailingExt4, tmp_path: Path, uploads: Uploads) -> None:
    chance, mark, seen = Random(7), 1, 0
    with image.mounted(tmp_path / "disk") as disk:
        state = disk / "state"
        for _ in range(FREEZES):
            pid = uploads.start(state, mark)
            first = int(uploads.line())
            time.sleep(chance.uniform(0.0, 0.05))
            freeze(pid)
            with after_the_cut(image.image, image.image.parent) as again:
                os.kill(pid, signal.SIGKILL)
                said = [first, *uploads.until_gone()]
                assert active_mark(again / "state") in (said[-1], said[-1] + 1)
            mark, seen = active_mark(state) + 1, seen + len(said)
    print(f"{FREEZES} images frozen in {seen} commits, none torn")
    assert seen >= FREEZES


def test_audit(image: FailingExt4, tmp_path: Path) -> None:
    chance, seen = Random(8), 0
    with image.mounted(tmp_path / "disk") as disk:
        for number in range(FREEZES):
            state = disk / str(number)
            process = subprocess.Popen([sys.executable, "-c", AUDITING, str(state)], stdout=subprocess.PIPE, text=True)
            with process:
                assert process.stdout
                first = process.stdout.readline()
                time.sleep(chance.uniform(0.0, 0.05))
                freeze(process.pid)
                with after_the_cut(image.image, image.image.parent) as again:
                    process.kill()
                    said = [int(line) for line in (first, *process.stdout)]
                    judge_audit(again / str(number), said[-1])
            seen += len(said)
    print(f"{FREEZES} images frozen in {seen} batches, none torn")
    assert seen >= FREEZES


def judge_audit(state: Path, last: int) -> None:
    assert verify_audit(state).broken is None
    numbers = [record["old"] for record in read_audit(state) if "old" in record]
    assert numbers == list(range(numbers[0], numbers[-1] + 1))
    assert numbers[-1] in (last, last + 1)
