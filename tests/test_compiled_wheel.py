"""The wheel that tools/compile_wheel makes: what it lacks is said, and compiled the gateway does as it does otherwise."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
COMPILE = [sys.executable, str(ROOT / "tools" / "compile_wheel")]
WHERE = "from gateway.modbus import fast; from gateway.registers import bank; print(bank.__file__, fast.__file__)"
ROOMS = ("tests/modbus", "tests/fieldbus", "tests/registers", "tests/simulation")
REPLACES_A_METHOD = "(the_short_way_of_a_plain_write or repeated_writes)"  # machine code has its methods for good


def test_without_a_compiler_it_says_so_and_writes_nothing(tmp_path: Path) -> None:
    done = subprocess.run(
        [*COMPILE, tmp_path], env={"PATH": str(tmp_path)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stderr == "nothing compiled: no C compiler (cc): apt install gcc\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_compiled_it_passes_the_tests_of_the_wire_the_bank_and_whole_schedules(tmp_path: Path) -> None:
    done = subprocess.run([*COMPILE, tmp_path], capture_output=True, text=True, check=False)
    if "no Python.h" in done.stderr or "no C compiler" in done.stderr:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    copy = tmp_path / "project"
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".*", "__pycache__", "dist"))
    with zipfile.ZipFile(done.stdout.strip()) as wheel:
        wheel.extractall(copy, [name for name in wheel.namelist() if name.endswith(".so")])
    environment = os.environ | {"PYTHONPATH": str(copy), "SIMULATION_SEEDS": "0:100"}
    where = subprocess.run(
        [sys.executable, "-c", WHERE], cwd=copy, env=environment, capture_output=True, text=True, check=True
    )
    assert all(path.startswith(str(copy)) and path.endswith(".so") for path in where.stdout.split()), where.stdout
    command = [sys.executable, "-m", "pytest", *ROOMS, "--workers", "2", "-k", f"not {REPLACES_A_METHOD}"]
    tested = subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True, check=False)
    assert tested.returncode == 0, tested.stdout[-5000:]
    assert " passed" in tested.stdout
