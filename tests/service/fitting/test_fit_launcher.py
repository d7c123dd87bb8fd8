"""The process that fits a ladder is heard as a whole, whatever it says, and outlives whoever has started it."""

import asyncio
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from gateway.service.running_rig import calibration_runs, fit_launcher
from gateway.service.running_rig.fit_launcher import FitLauncher, Result
from tests.processes.held_program import held_program
from tests.service.running_rig.runs.test_calibration_runs import kept
from tests.service.wired import Wired

NO_RESULT = "A331 the fit process ended without a result"


def heard(monkeypatch: pytest.MonkeyPatch, code: str) -> Result:
    """What such a process is heard to say."""
    monkeypatch.setattr(fit_launcher, "module_command", lambda _: [sys.executable, "-S", "-c", f"import os; {code}"])

    async def scene() -> Result:
        results: asyncio.Queue[Result] = asyncio.Queue()
        child = FitLauncher(Path("recording"), Path("rig"), Path("state"), results.put_nowait)
        async with asyncio.timeout(10):
            result = await results.get()
            while not child.is_reaped:  # asked for again, until it is reaped
                await asyncio.sleep(0.005)
        return result

    return asyncio.run(scene())


def test_a_result_that_comes_in_pieces_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a session of its own: the end of a terminal, or of control, is not the fit's."""
    said = r"""os.write(1, b'{"stored": '); os.write(1, b'7, "report": "' + b'x' * 200000 + b'"}')"""
    result = heard(monkeypatch, f"assert os.getsid(0) == os.getpid(); {said}")
    assert result == {"stored": 7, "report": "x" * 200000}


def test_a_fit_whose_program_the_disk_does_not_give_is_not_waited_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The loop that started it stood still with it, and was killed for it."""
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\necho '{\"stored\": 7}'\n")
    program.chmod(0o700)
    monkeypatch.setattr(fit_launcher, "module_command", lambda _: [str(program)])

    async def scene(disk: subprocess.Popen[bytes]) -> Result:
        results: asyncio.Queue[Result] = asyncio.Queue()
        child = FitLauncher(Path("recording"), Path("rig"), Path("state"), results.put_nowait)
        assert disk.poll() is None, "it came back behind the disk alone"
        disk.communicate()
        async with asyncio.timeout(10):
            result = await results.get()
            while not child.is_reaped:
                await asyncio.sleep(0.005)
        return result

    with held_program(program) as disk:
        assert asyncio.run(scene(disk)) == {"stored": 7}


@pytest.mark.parametrize("code", ["os._exit(1)", "os.write(1, b'{\"stored\": ')", "os.write(1, b'Killed')"])
def test_a_fit_that_ends_without_a_result_is_a_refusal_and_no_exception(
    code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = heard(monkeypatch, code)
    assert result["refused"].startswith(NO_RESULT)


def test_a_fit_that_hangs_is_killed_with_all_that_it_has_started(monkeypatch: pytest.MonkeyPatch) -> None:
    """Until it has ended no other run may begin. A disk that hangs does not let it hear that it shall end."""
    monkeypatch.setattr(fit_launcher, "LONGEST_S", 0.3)
    deaf = "os.fork(); import signal; signal.alarm(15); signal.signal(15, signal.SIG_IGN); signal.pause()"
    result = heard(monkeypatch, deaf)
    assert result["refused"].startswith("A331 the fit process was killed after 0.005 minutes without a result")


def test_of_a_fit_that_has_ended_nothing_is_killed_later(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half an hour later another process may have its number."""
    monkeypatch.setattr(fit_launcher, "module_command", lambda _: [sys.executable, "-S", "-c", "print('{}')"])
    killed = list[object]()
    monkeypatch.setattr(fit_launcher.os, "killpg", lambda *asked: killed.append(asked))

    async def scene() -> Result:
        results: asyncio.Queue[Result] = asyncio.Queue()
        child = FitLauncher(Path("recording"), Path("rig"), Path("state"), results.put_nowait)
        async with asyncio.timeout(10):
            result = await results.get()
            assert child._patience.cancelled()
            while not child.is_reaped:
                await asyncio.sleep(0.005)
        return result

    assert (asyncio.run(scene()), killed) == ({}, [])


def test_a_fit_that_cannot_be_started_is_a_refusal_that_names_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none_left(*_: object) -> None:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(calibration_runs, "FitLauncher", none_left)
    runs = kept(Wired().ready(), tmp_path)
    runs._fit(SimpleNamespace(failure=None, path=tmp_path / "0007", number=7))  # type: ignore[arg-type]
    refused = runs.status()["result"]["refused"]
    assert refused.startswith("A331 the fit did not start: Resource temporarily") and refused.endswith("fit 7")
