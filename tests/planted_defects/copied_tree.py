"""A copy of the checkout in which one place is wrong, and the tests run in it."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Final

from tests.planted_defects.defects.defect import Defect

ROOT: Final = Path(__file__).parents[2]
_COPIED: Final = ("gateway", "profiles", "tests", "tools", "pyproject.toml", "README.md")
_AGES: Final = count(2)
"""Seconds, others for each defect: a compiled file counts as the source's by whole seconds and size, and two defects of a file
may have one size."""
_FAILED: Final = re.compile(r"^FAILED (\S+)", re.M)


def copy_tree(folder: Path) -> Path:
    """Return the folder with a copy of all that the tests need, compiled files included."""
    for name in _COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns(".hypothesis", "node_modules"))
        else:
            shutil.copy2(source, folder / name)
    return folder


@contextmanager
def planted(tree: Path, defect: Defect) -> Iterator[None]:
    """Have the defect in the copy for this block. AssertionError where its place is not found once."""
    file = tree / "gateway" / defect.file
    sound, found = file.read_text(encoding="utf-8"), file.stat()
    assert sound.count(defect.before) == 1, (
        f"{defect.file}: the place of {defect.name!r} is there {sound.count(defect.before)} times"
    )
    file.write_text(sound.replace(defect.before, defect.after), encoding="utf-8")
    os.utime(file, ns=(found.st_atime_ns, found.st_mtime_ns + next(_AGES) * 1_000_000_000))
    try:
        yield
    finally:
        file.write_text(sound, encoding="utf-8")
        os.utime(file, ns=(found.st_atime_ns, found.st_mtime_ns))


def failing_test(tree: Path, tests: tuple[str, ...]) -> str | None:
    """Return the first test that fails in the copy, None when all pass. AssertionError where they could not run at all."""
    places = [f"tests/{place}" for place in tests]
    words = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *places]
    environment = os.environ | {"PYTHONPATH": str(tree), "HYPOTHESIS_STORAGE_DIRECTORY": str(tree / ".hypothesis")}
    done = subprocess.run(words, cwd=tree, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stdout + done.stderr
    match = _FAILED.search(done.stdout)
    assert done.returncode == 0 or match, done.stdout
    return match[1] if match else None
