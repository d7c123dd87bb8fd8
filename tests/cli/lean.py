"""A gateway that was installed without the extra `analysis`: importing its libraries fails in every process of it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import gateway

_BLOCKED = ("numba", "llvmlite", "pyarrow")
_SITE = f"""
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {_BLOCKED!r}:
            raise ModuleNotFoundError("No module named " + repr(name), name=name)
sys.meta_path.insert(0, Blocked())
"""
_CALLS = """
import json, sys
from click.testing import CliRunner
from gateway.cli.main import command
answers = []
for words in json.loads(sys.argv[1]):
    answer = CliRunner().invoke(command, words)
    answers.append((answer.exit_code, answer.stdout, answer.stderr))
print(json.dumps(answers))
"""


def lean_environment(directory: Path) -> dict[str, str]:
    """Environment of a process for which the extra is not there, by a `sitecustomize` in this directory."""
    (directory / "sitecustomize.py").write_text(_SITE, encoding="utf-8")
    tree = Path(gateway.__file__).parents[1]
    return os.environ | {"PYTHONPATH": f"{directory}{os.pathsep}{tree}"}


def call_lean(directory: Path, *calls: tuple[object, ...]) -> list[tuple[int, str, str]]:
    """Run verbs one after the other in one lean process; exit code, stdout and stderr of each."""
    words = json.dumps([[str(word) for word in call] for call in calls])
    done = subprocess.run(
        [sys.executable, "-c", _CALLS, words],
        env=lean_environment(directory),
        capture_output=True,
        text=True,
        check=True,
        cwd=directory,
    )
    return [tuple(answer) for answer in json.loads(done.stdout)]
