"""Inputs that a search by coverage found or mutates: the judges here, the search itself (atheris) with --long."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from random import Random

import pytest

from tests.fuzz.damage import damaged
from tests.fuzz.guided.targets import TARGETS

TRIES = {"profile": 20, "bank": 60}
"""Where one takes milliseconds; 150 of the others."""
SECONDS = 300
FOUND = [
    ("table", b"\0\x89FGR1\r\n\n" + bytes(300)),  # a header of no bytes, whose CRC-32 is right
    ("yaml", b"{" * 600),  # keys that are mappings, in one another
    ("request", rb'{"dn\ne": "a", "for_/": 2.5}'),  # a key of two lines, which made two of the log's
]
"""What the search found broken, shrunk; mended since."""


@pytest.mark.parametrize("name", TARGETS)
def test_what_a_search_begins_with_breaks_no_law(name: str) -> None:
    target, chance = TARGETS[name], Random(f"15 {name}")
    seeds = target.seeds()
    for seed in seeds:
        target.assert_lawful(seed)
    for _ in range(TRIES.get(name, 150)):
        target.assert_lawful(damaged(chance.choice(seeds), chance))
    target.assert_lawful(b"")


@pytest.mark.parametrize("name, found", FOUND)
def test_what_a_search_has_found_stays_mended(name: str, found: bytes) -> None:
    TARGETS[name].assert_lawful(found)


def search(name: str, folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tests.fuzz.guided.run", name, str(folder), *options]
    return subprocess.run(command, cwd=Path(__file__).parents[3], capture_output=True, text=True, check=False)


@pytest.mark.long
@pytest.mark.parametrize("name", TARGETS)
def test_a_search_by_coverage_finds_no_input_that_breaks_a_law(name: str, tmp_path: Path) -> None:
    """Five minutes for each target."""
    if find_spec("atheris") is None:
        pytest.skip("needs atheris, which ./tools/test --long installs where it can")
    done = search(name, tmp_path / "inputs", f"-max_total_time={SECONDS}", "-seed=15")
    assert done.returncode == 0, done.stderr[-4000:]
