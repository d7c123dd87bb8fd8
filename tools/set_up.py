"""Makes .venv whole from a lock file, and shows how far it is; tools/environment calls it with the Python for .venv.

Standard library only, and of the gateway what needs no more. An environment that an interrupted set-up has left is known by
its missing stamp and finished, or made anew where not even pip works in it; the stamp comes last, so that half a set-up never
passes for a whole one.
"""

import os
import re
import select
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from gateway.cli.diagnosis.progress_line import show_progress  # noqa: E402  the checkout's, not an installed one
from gateway.progress import report  # noqa: E402

ENVIRONMENT: Final = ROOT / ".venv"
PYTHON: Final = ENVIRONMENT / "bin" / "python"
PIP: Final = (str(PYTHON), "-m", "pip", "--disable-pip-version-check", "--no-input")
_LOOK_S: Final = 0.2
_KEPT_LINES: Final = 30
_COLLECTED: Final = re.compile(r"^(Collecting|Ignoring|Requirement already satisfied:)", re.MULTILINE)
_RARELY_IMPORTED: Final = "async_api|cuda|dask|distributed|distutils|f2py|fontTools|standard_address_space|tornado"
_NOT_COMPILED: Final = f"/site-packages/(.*/)?(tests?|pip|setuptools|pkg_resources|mypyc?|lexers|{_RARELY_IMPORTED})/"
"""What nobody imports: their own tests, who installs them, what is machine code already, all but one file of hundreds; and what
few do: Python compiles such a file when it is imported first."""
_INSTALLING: Final = re.compile(r"^Installing collected packages: (.*)$", re.MULTILINE)


class StepError(Exception):
    """A command of the set-up has failed. The message ends with what it said last."""


def run_steps(commands: Sequence[Sequence[str]], on_text: Callable[[str], None]) -> None:
    """Run commands side by side; hand on_text all that they have said so far, whenever there is more and now and then.
    StepError where one fails, as soon as all have ended."""
    with ExitStack() as stack:
        processes = [
            stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=ROOT))
            for command in commands
        ]
        pipes = [process.stdout for process in processes if process.stdout]
        said = dict.fromkeys(pipes, "")
        while pipes:
            for pipe in select.select(pipes, [], [], _LOOK_S)[0]:
                chunk = os.read(pipe.fileno(), 65536)
                said[pipe] += chunk.decode(errors="replace")
                if not chunk:
                    pipes.remove(pipe)
            on_text("".join(said.values()))
    for process, words in zip(processes, said.values(), strict=True):
        if process.returncode:
            last = "\n".join(deque(words.splitlines(), _KEPT_LINES))
            raise StepError(f"{last}\n{' '.join(map(str, process.args))} ended with {process.returncode}")


def run_step(command: Sequence[str], on_text: Callable[[str], None]) -> None:
    """Run one command as `run_steps` does."""
    run_steps([command], on_text)


def make_environment() -> None:
    """Make .venv where there is none that works."""
    report(f"making .venv with Python {sys.version.split()[0]} (1/5)")
    works = [str(PYTHON), "-c", "import pip, sys; sys.exit(sys.prefix == sys.base_prefix)"]
    if PYTHON.exists() and subprocess.run(works, capture_output=True, check=False).returncode == 0:
        return
    run_step([sys.executable, "-m", "venv", "--clear", str(ENVIRONMENT)], lambda said: None)


def install_packages(lock: Path) -> None:
    """Install what the lock names, and nothing else: in two halves side by side, for one pip keeps one core busy."""
    pinned = re.findall(
        r"^[A-Za-z0-9][^#\n]*==[^\n]*\n(?:[ #][^\n]*\n)*", lock.read_text(encoding="utf-8"), re.MULTILINE
    )
    halves = [half for half in (pinned[::2], pinned[1::2]) if half]
    before = len(installed())

    def tell(said: str) -> None:
        if len(found := _INSTALLING.findall(said)) == len(halves):
            packages = sum(line.count(",") + 1 for line in found)
            report("installing (3/5)", min(packages, len(installed()) - before), packages)
        else:
            report("fetching (2/5)", min(len(pinned), len(_COLLECTED.findall(said))), len(pinned))

    tell("")
    options = [
        "--progress-bar",
        "off",
        "--no-compile",
        "--no-deps",
        "--require-hashes",
    ]  # the lock names what they need
    with TemporaryDirectory() as folder:
        files = [Path(folder) / f"{number}.lock" for number in range(len(halves))]
        for file, half in zip(files, halves, strict=True):
            file.write_text("".join(half), encoding="utf-8")
        run_steps([[*PIP, "install", *options, "-r", str(file)] for file in files], tell)


def installed() -> list[Path]:
    """Return what pip has finished with: it writes a package's own directory last."""
    return list((ENVIRONMENT / "lib").glob("python*/site-packages/*.dist-info/RECORD"))


def compile_packages() -> None:
    """Compile on all cores what pip would compile on one."""
    sources = [path for path in (ENVIRONMENT / "lib").rglob("*.py") if not re.search(_NOT_COMPILED, str(path))]

    def tell(said: str) -> None:
        report("compiling (4/5)", min(len(sources), said.count("Compiling ")), len(sources))

    try:
        run_step([str(PYTHON), "-m", "compileall", "-j", "0", "-x", _NOT_COMPILED, str(ENVIRONMENT / "lib")], tell)
    except StepError:
        pass  # a package may hold a file for another Python


def install_checkout() -> None:
    """Install this checkout itself, editable."""
    report("installing force-gateway (5/5)")
    run_step([*PIP, "install", "--no-deps", "--no-build-isolation", "-e", str(ROOT)], lambda said: None)


def set_up(lock: Path, stamp: Path, wanted: str) -> None:
    """Make it whole, and stamp it in the end."""
    make_environment()
    stamp.unlink(missing_ok=True)
    install_packages(lock)
    compile_packages()
    install_checkout()
    fresh = stamp.with_name(f".{stamp.name}.new")
    fresh.write_text(f"{wanted}\n", encoding="utf-8")
    fresh.replace(stamp)


def main(lock: str, stamp: str, wanted: str) -> int:
    """Set up, shown; 130 where Ctrl-C has ended it."""
    began_s, is_begun = time.monotonic(), ENVIRONMENT.exists()
    unfinished = is_begun and not list(ENVIRONMENT.glob("stamp-*"))
    print("finishing the set-up of .venv ..." if unfinished else "setting up .venv ...", file=sys.stderr)
    try:
        with show_progress("set-up"):
            set_up(ROOT / lock, ROOT / stamp, wanted)
    except KeyboardInterrupt:
        print("stopped; the same command goes on where it was", file=sys.stderr)
        return 130
    except StepError as error:
        print(error, file=sys.stderr)
        return 1
    print(f".venv is ready, after {time.monotonic() - began_s:.0f} s", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
