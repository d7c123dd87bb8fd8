"""What the three processes of a running gateway have loaded: the kernel's own list, so that a late import counts too."""

import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = ("scipy", "pandas", "matplotlib", "jinja2", "pyarrow")


def mapped(pid: int) -> set[str]:
    """Files that a process has mapped: its extension modules among them."""
    lines = Path(f"/proc/{pid}/maps").read_text().splitlines()
    return {line.split(maxsplit=5)[5] for line in lines if line.count("/") > 1}


def loaded_by(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_control_never_maps_anything_heavy_while_it_works(rested):
    """With a force commanded, a recording, the float blocks read and a refusal: nothing is left to load later."""
    assert not rested.write(0, 1, 1000).isError()
    rested.wait_until(lambda status: status["state"] == 3)
    rested.words(200, 60)
    rested.write(1, 6500)
    done = subprocess.run(
        [sys.executable, "-m", "gateway", "record", "on", "--state", str(rested.state)],
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    files = mapped(rested.ready["pids"]["control"])
    assert not [file for file in files for name in HEAVY if f"/{name}" in file]


def test_the_guardian_maps_no_numpy(rested):
    files = mapped(rested.ready["pids"]["guardian"])
    assert files, "the list can be read"
    assert not [file for file in files for name in (*HEAVY, "numpy", "pydantic_core", "yaml") if f"/{name}" in file]


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import gateway.service.control_process", {*HEAVY, "pymodbus", "rich"}),
        ("import gateway.service.simulated_rig", {*HEAVY, "pymodbus", "rich"}),
        (
            "import gateway.service.supervisor.guardian",
            {*HEAVY, "numpy", "asyncio", "yaml", "pydantic", "serial", "click"},
        ),
    ],
)
def test_each_process_imports_only_what_it_needs(statement, absent):
    assert loaded_by(statement).isdisjoint(absent)
