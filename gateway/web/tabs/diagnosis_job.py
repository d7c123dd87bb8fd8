"""The one diagnosis that the page runs at a time: its process, what it is at, its end; and the reports that are kept.

STATE/diagnoses/NNNN.html and .json are of recording NNNN. A diagnosis writes into a folder of its own, whose files are renamed
when all are there: a cancelled one leaves nothing.
"""

import asyncio
import contextlib
import json
import shutil
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from gateway.plain_file import exists
from gateway.processes.durable_file import read_regular
from gateway.processes.module_command import module_command
from gateway.web.context import WebContext
from gateway.web.tabs.answers import NOT_FOUND, TabRefusedError
from gateway.web.tabs.own_command import child_environment, last_sentence

FOLDER: Final = "diagnoses"
PROGRAM: Final = "gateway"
"""Module of the command line whose verb diagnoses."""
_LONGEST_SAID: Final = 20_000


@dataclass(slots=True)
class RunningDiagnosis:
    """A diagnosis under way, or the last one. ended: empty while it runs, else done, failed or cancelled; said: why it failed,
    or what it has kept."""

    recording: int
    keeps_plant: bool
    began_s: float
    stage: str = "starting"
    done: int = 0
    of: int = 0
    ended: str = ""
    said: str = ""
    took_s: float = 0.0
    process: asyncio.subprocess.Process | None = field(default=None, repr=False)


class DiagnosisJobs:
    """Starts, follows and cancels; one at a time. clock: monotonic seconds."""

    def __init__(self, context: WebContext, clock: Callable[[], float] = time.monotonic) -> None:
        self._context = context
        self._state = context.state
        self._clock = clock
        self._job: RunningDiagnosis | None = None
        self._task: asyncio.Task[None] | None = None

    def status(self) -> dict[str, Any] | None:
        """Return how the diagnosis is; None where none was begun since the page's process started."""
        job = self._job
        if job is None:
            return None
        spent_s = job.took_s if job.ended else self._clock() - job.began_s
        names = ("recording", "stage", "done", "of", "ended", "said")
        return {name: getattr(job, name) for name in names} | {"spent_s": spent_s}

    async def begin(self, recording: int, *, keeps_plant: bool) -> None:
        """Begin a diagnosis. TabRefusedError where one is under way."""
        if self._job is not None and not self._job.ended:
            raise TabRefusedError(
                f"E179 recording {self._job.recording} is being diagnosed: one at a time; wait for it, or cancel it"
            )
        self._job = job = RunningDiagnosis(recording, keeps_plant, self._clock())
        folder = self._state / FOLDER / f".{recording:04d}"
        link, far_end = socket.socketpair()
        try:
            await asyncio.to_thread(_make_empty, folder)
            job.process = await self._spawn(job, folder, far_end)
        except OSError as error:
            link.close()
            job.ended, job.said = "failed", f"the diagnosis did not start: {error.strerror or error}"
            return
        finally:
            far_end.close()
        self._task = self._context.begin(self._follow(job, folder, link))

    async def cancel(self) -> None:
        """End the diagnosis under way; return when it has ended."""
        if self._job is None or self._job.ended or self._task is None:
            raise TabRefusedError("no diagnosis is under way")
        self._job.ended = "cancelled"
        if self._job.process:
            _kill(self._job.process)
        await self._task

    async def _spawn(self, job: RunningDiagnosis, folder: Path, far_end: socket.socket) -> asyncio.subprocess.Process:
        words = ["diagnose", str(job.recording), "--state", str(self._state)]
        words += ["--report", str(folder / "report.html"), "--json", str(folder / "document.json")]
        words += ["--save"] if job.keeps_plant else []
        module = module_command("gateway.web.tabs.diagnosis_process")
        return await asyncio.create_subprocess_exec(
            *module,
            str(far_end.fileno()),
            PROGRAM,
            *words,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            pass_fds=(far_end.fileno(),),
            env=child_environment(),
        )

    async def _follow(self, job: RunningDiagnosis, folder: Path, link: socket.socket) -> None:
        assert job.process and job.process.stdout
        try:
            said, _ = await asyncio.gather(job.process.stdout.read(), _hear(job, link))
            code = await job.process.wait()
        except asyncio.CancelledError:  # the page ends, and its diagnosis with it
            _kill(job.process)
            await job.process.wait()
            raise
        await self._end(job, code, said.decode(errors="replace")[-_LONGEST_SAID:], folder)
        await asyncio.to_thread(shutil.rmtree, folder, True)

    async def _end(self, job: RunningDiagnosis, code: int, said: str, folder: Path) -> None:
        job.took_s = self._clock() - job.began_s
        if job.ended:
            return
        whole = code == 0 and await asyncio.to_thread(_keep, folder, self._state / FOLDER, job.recording)
        job.ended = "done" if whole else "failed"
        job.said = _saved_plant(said) if whole else last_sentence(said) or f"the diagnosis ended with {code}"


def kept_diagnoses(state: Path) -> list[dict[str, Any]]:
    """Return the kept reports: recording, verdict and causes of each, the newest recording first."""
    numbered = ((int(path.stem), path) for path in (state / FOLDER).glob("[0-9]*.json") if path.stem.isdecimal())
    return [
        {"recording": number, "made_unix_s": path.stat().st_mtime} | _headline(path)
        for number, path in sorted(numbered, reverse=True)
        if exists(path.with_suffix(".html"))
    ]


def read_report(state: Path, recording: int) -> str:
    """Return the report of a recording. TabRefusedError where it was not diagnosed here."""
    try:
        return read_regular(state / FOLDER / f"{recording:04d}.html").decode()
    except OSError:
        raise TabRefusedError(f"recording {recording} was not diagnosed on this page", NOT_FOUND) from None


def _headline(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(read_regular(path))
        causes = [{"name": cause["name"], "confidence": cause.get("confidence")} for cause in document["causes"]]
        return {"verdict": document["verdict"], "causes": causes}
    except (OSError, ValueError, KeyError, TypeError):
        return {"verdict": "unreadable", "causes": []}


async def _hear(job: RunningDiagnosis, link: socket.socket) -> None:
    """Take what the process tells until it ends."""
    reader, writer = await asyncio.open_connection(sock=link)
    try:
        while line := await reader.readline():
            with contextlib.suppress(ValueError, KeyError):
                now = json.loads(line)
                job.stage, job.done, job.of = str(now["stage"]), int(now["done"]), int(now["of"])
    except ConnectionError:  # killed
        pass
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()


def _kill(process: asyncio.subprocess.Process) -> None:
    with contextlib.suppress(ProcessLookupError):
        process.kill()


def _make_empty(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)


def _keep(folder: Path, kept: Path, recording: int) -> bool:
    """Move the report and its document to their names; False where they are not there."""
    try:
        (folder / "document.json").replace(kept / f"{recording:04d}.json")
        (folder / "report.html").replace(kept / f"{recording:04d}.html")
    except OSError:
        return False
    return True


def _saved_plant(said: str) -> str:
    """Return the verb's line about the plant that it has kept; empty where it has kept none."""
    return next((line.strip() for line in said.splitlines() if line.startswith("plant ")), "")
