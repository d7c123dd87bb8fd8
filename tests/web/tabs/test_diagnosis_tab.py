"""A diagnosis of the page: one at a time, cancelled without a trace, and ended with the page's process."""

import asyncio
import errno
import json
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace

import pytest

from gateway import progress
from gateway.diagnosis.result import Verdict
from gateway.web.tabs import diagnosis_job
from gateway.web.tabs.diagnosis_process import ProgressTeller
from tests.web.tabs.conftest import record
from tests.web.tabs.served_tabs import serve

FOREVER = "import gateway.progress as p\nwhile True: p.report('searching', 1, 3)\n"


def wait_until(page, fits: Callable[[dict], bool], within_s: float = 60.0) -> dict:
    deadline_s = time.monotonic() + within_s
    while not fits(job := page.get("/api/v1/diagnosis").json["job"]):
        assert time.monotonic() < deadline_s, job
        time.sleep(0.02)
    return job


def is_searching(job: dict) -> bool:
    assert not job["ended"], job
    return job["stage"] == "searching"


@pytest.fixture
def endless(monkeypatch, tmp_path) -> None:
    """A command line that searches for ever, before the real one on the path of modules."""
    package = tmp_path / "endless" / "gateway_of_test"
    package.mkdir(parents=True)
    (package / "__main__.py").write_text(FOREVER)
    (package / "__init__.py").write_text("")
    monkeypatch.setattr("gateway.web.tabs.diagnosis_job.PROGRAM", "gateway_of_test")
    monkeypatch.setenv("PYTHONPATH", f"{package.parent}:{Path(__file__).parents[3]}")


def test_a_second_one_is_refused_and_a_cancelled_one_leaves_nothing(page, state, endless) -> None:
    record(state)
    record(state)
    assert page.post("/api/v1/diagnosis/begin", {"recording": 1}).status == 200
    refused = page.post("/api/v1/diagnosis/begin", {"recording": 2})
    assert refused.status == 409
    assert refused.json["error"].startswith("E179 recording 1 is being diagnosed")
    job = wait_until(page, is_searching)
    assert (job["done"], job["of"]) == (1, 3)
    assert page.post("/api/v1/diagnosis/cancel").json["job"]["ended"] == "cancelled"
    assert not list((state / "diagnoses").iterdir())
    assert page.post("/api/v1/diagnosis/cancel").status == 409
    (state / "diagnoses" / ".0002" / "of a page that was killed").mkdir(parents=True)
    assert page.post("/api/v1/diagnosis/begin", {"recording": 2}).json["job"]["ended"] == "", "the next one is another"
    assert page.post("/api/v1/diagnosis/cancel").json["job"]["ended"] == "cancelled"
    assert not list((state / "diagnoses").iterdir())


def test_the_end_of_the_page_ends_its_diagnosis(state, endless) -> None:
    record(state)
    with serve(state) as page:
        page.post("/api/v1/diagnosis/begin", {"recording": 1})
        wait_until(page, is_searching)
        assert searches_of(state)
    assert not searches_of(state)


def searches_of(state: Path) -> list[str]:
    lines = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = entry.read_bytes().replace(b"\0", b" ").decode()
        except OSError:  # ended meanwhile
            continue
        lines += [line] if "diagnosis_process" in line and str(state) in line else []
    return lines


def test_the_end_of_the_link_ends_the_process_in_the_middle_of_its_work(endless) -> None:
    ours, far_end = socket.socketpair()
    command = [sys.executable, "-m", "gateway.web.tabs.diagnosis_process", str(far_end.fileno()), "gateway_of_test"]
    with subprocess.Popen(command, pass_fds=(far_end.fileno(),)) as process:
        far_end.close()
        try:
            with ours, ours.makefile("rb") as told:
                assert json.loads(told.readline())["stage"] == "searching"
            assert process.wait(20) == 1
        finally:
            process.kill()


def test_what_cannot_be_diagnosed_is_told_in_the_verbs_words(page, state) -> None:
    path = record(state)
    path.write_bytes(path.read_bytes()[:200])
    assert page.post("/api/v1/diagnosis/begin", {"recording": 1}).status == 200
    job = wait_until(page, lambda job: bool(job["ended"]))
    assert job["ended"] == "failed"
    assert job["said"].startswith("E403 ")
    assert not list((state / "diagnoses").iterdir())


def test_a_process_hears_everything_besides_who_listens(monkeypatch) -> None:
    monkeypatch.setattr(progress, "_everything", [])
    heard: list[str] = []
    inside: list[str] = []
    progress.hear_everything(lambda now: heard.append(str(now)))
    progress.report("before")
    with progress.listen(lambda now: inside.append(str(now))):
        progress.report("search", 0, 3)
        progress.advance(2, 3)
    assert heard == ["before", "search: 0 of 3", "search: 2 of 3"]
    assert inside == heard[1:]


def test_a_full_link_does_not_stop_the_search() -> None:
    ours, far_end = socket.socketpair()
    with ours, far_end:
        teller = ProgressTeller(far_end)
        for stage in range(20_000):
            teller.tell(progress.Progress(f"stage {stage}"))
        assert b'"stage 0"' in ours.recv(1000)


def test_the_page_has_words_for_each_verdict() -> None:
    script = files("gateway.web").joinpath("static/tabs/diagnosis.js").read_text("utf-8")
    (words,) = re.findall(r"const VERDICTS = \{(.*?)\};", script)
    assert set(re.findall(r'"?([\w-]+)"?: "', words)) == {verdict.value for verdict in Verdict}


def test_the_disk_that_takes_the_report_keeps_no_request_waiting(tmp_path, monkeypatch) -> None:
    """It was renamed by the loop that serves the page: on a disk that hung nobody could stop the force there."""
    names: list[str] = []
    monkeypatch.setattr(diagnosis_job, "_keep", lambda *words: names.append(threading.current_thread().name) or True)
    job = diagnosis_job.RunningDiagnosis(1, False, 0.0)
    jobs = diagnosis_job.DiagnosisJobs(SimpleNamespace(state=tmp_path), lambda: 2.0)
    asyncio.run(jobs._end(job, 0, "", tmp_path))
    assert (job.ended, job.took_s) == ("done", 2.0)
    assert names and names != [threading.main_thread().name]


@pytest.mark.parametrize("keeps_plant", [False, True])
def test_a_plant_is_kept_where_that_is_wanted_and_a_process_that_does_not_start_leaves_nothing_open(
    tmp_path, monkeypatch, keeps_plant: bool
) -> None:
    words: list[str] = []

    async def refuse(*asked: str, **_: object) -> None:
        words.extend(asked)
        raise OSError(errno.ENOMEM, "no memory")

    monkeypatch.setattr(asyncio, "create_subprocess_exec", refuse)
    link, far_end = socket.socketpair()
    monkeypatch.setattr(diagnosis_job, "socket", SimpleNamespace(socketpair=lambda: (link, far_end)))
    jobs = diagnosis_job.DiagnosisJobs(SimpleNamespace(state=tmp_path), lambda: 2.0)
    asyncio.run(jobs.begin(1, keeps_plant=keeps_plant))
    assert ("--save" in words) is keeps_plant
    assert (jobs.status()["ended"], jobs.status()["said"]) == ("failed", "the diagnosis did not start: no memory")
    assert link.fileno() == far_end.fileno() == -1


def test_the_reports_are_those_that_are_whole_the_newest_recording_first(tmp_path) -> None:
    (tmp_path / "diagnoses").mkdir()
    for name in ("0001.json", "0001.html", "0002.json", "0010.json", "0010.html"):
        (tmp_path / "diagnoses" / name).write_text('{"verdict": "agrees", "causes": []}')
    kept = diagnosis_job.kept_diagnoses(tmp_path)
    assert [(one["recording"], one["verdict"]) for one in kept] == [(10, "agrees"), (1, "agrees")]
