"""What a process beside control has to say is an event like any other: with its time, severity, code, and from where."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from gateway.processes import exit_codes
from gateway.processes.scheduling import priority

BROKER_AWAY_THEN_END = """
import sys
from gateway.processes.beside_control import serve_until_guardian_ends

async def serve(options, log):
    log("broker", "E181 the MQTT broker is away")
    raise ExceptionGroup("tasks", [OSError(13, "Permission denied", "/etc/secret")])

sys.exit(serve_until_guardian_ends("mqtt", sys.argv[1:], serve))
"""

FLOODED_LIBRARY = """
import logging, sys
from gateway.processes.beside_control import serve_until_guardian_ends

async def serve(options, log):
    for _ in range(5000):
        logging.getLogger("uvicorn.error").warning("Exceeded concurrency limit.")

sys.exit(serve_until_guardian_ends("web", sys.argv[1:], serve))
"""

NO_DESCRIPTOR = """
import asyncio, resource, socket, sys
from gateway.processes.beside_control import serve_until_guardian_ends

async def serve(options, log):
    server = await asyncio.start_server(lambda *_: None, "127.0.0.1", 0)
    calls = [socket.socket() for _ in range(8)]
    for call in calls:
        call.setblocking(False)
        call.connect_ex(server.sockets[0].getsockname())
    resource.setrlimit(resource.RLIMIT_NOFILE, (calls[-1].fileno() + 1, 4096))
    for _ in range(20):
        await asyncio.sleep(0)
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))

sys.exit(serve_until_guardian_ends("web", sys.argv[1:], serve))
"""

NO_MEMORY = """
import resource, sys
from gateway.processes.beside_control import serve_until_guardian_ends

async def serve(options, log):
    resource.setrlimit(resource.RLIMIT_AS, (400 << 20, 400 << 20))
    raise FAILURE

sys.exit(serve_until_guardian_ends("web", sys.argv[1:], serve))
"""

SERVES_FOR_EVER = """
import sys, time
from gateway.processes.beside_control import serve_until_guardian_ends

async def serve(options, log):
    print("serves", flush=True)
    time.sleep(60.0)  # in the middle of whatever it does

sys.exit(serve_until_guardian_ends("web", sys.argv[1:], serve))
"""


def say(tmp_path: Path, code: str) -> tuple[int, list[str]]:
    """Exit code of such a process, and its lines on stderr."""
    guardian, link = socket.socketpair()
    with guardian, link:
        command = [sys.executable, "-c", code, str(link.fileno()), json.dumps({"state": str(tmp_path)})]
        ended = subprocess.run(command, pass_fds=[link.fileno()], capture_output=True, text=True, check=False)
    return ended.returncode, ended.stderr.splitlines()


def test_a_library_that_logs_in_a_flood_fills_no_log(tmp_path: Path) -> None:
    """A page that is asked for by more than it serves said a line for each of them, without time and without end."""
    _, lines = say(tmp_path, FLOODED_LIBRARY)
    assert 1 <= len(lines) <= 30
    assert " info    library uvicorn.error: Exceeded concurrency limit." in lines[0]
    assert "more lines" in lines[-1]


def test_what_it_says_and_why_it_ends_are_events(tmp_path: Path) -> None:
    code, lines = say(tmp_path, BROKER_AWAY_THEN_END)
    assert code == exit_codes.DEVICE
    away, why = lines
    assert " error   broker E181 the MQTT broker is away" in away and "Permission denied" in why
    kept = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text().splitlines()]
    assert [(one["source"], one["cause"], one["code"]) for one in kept] == [
        ("mqtt", "broker", "E181"),
        ("mqtt", "start", None),
    ]


def test_callers_for_whom_no_descriptor_is_left_are_told_once_and_in_a_sentence(tmp_path: Path) -> None:
    """Each was a traceback of asyncio, a thousand in a few seconds."""
    _, lines = say(tmp_path, NO_DESCRIPTOR)
    told = [line for line in lines if "E150 " not in line]  # nor is one left for the events' file, at times
    assert len(told) == 1, lines
    assert " warning library A411 " in told[0] and "Too many open files" in told[0] and "ulimit -n" in told[0]


@pytest.mark.parametrize(
    "failure",
    [
        "MemoryError",
        "ImportError('failed to map segment', path='/usr/lib/x.abi3.so')",
        "ImportError('read this first') from ImportError('failed to map segment', path='/usr/lib/x.so')",
        "SystemError('error return')",
    ],
)
def test_too_little_memory_is_a_sentence_and_no_traceback(failure: str, tmp_path: Path) -> None:
    code, lines = say(tmp_path, NO_MEMORY.replace("FAILURE", failure))
    assert (code, len(lines)) == (exit_codes.DEVICE, 1), lines
    assert " error   start E106 " in lines[0] and "400 MiB" in lines[0] and "ulimit -v" in lines[0]


@pytest.mark.parametrize(
    "failure",
    ["ModuleNotFoundError('No module named uvicorn', name='uvicorn')", "ImportError('no such name', path='x.py')"],
)
def test_what_is_missing_or_broken_is_not_told_as_memory_where_that_is_limited(failure: str, tmp_path: Path) -> None:
    """Whoever raised the limit as he was told found the same sentence again."""
    code, lines = say(tmp_path, NO_MEMORY.replace("FAILURE", failure))
    assert code and any(failure.partition("(")[0] in line for line in lines)
    assert not any("ulimit" in line for line in lines)


BREAKS = {
    "missing": ("", "a_library.part", "E160 a_library.part is missing or broken (ModuleNotFoundError: No module named"),
    "a part of it": ("from a_library import x\n", "a_library", "E160 a_library is missing or broken (ImportError: "),
    "no Python": ("def (\n", "a_library", "a_library/__init__.py is missing or broken (SyntaxError: "),
    "half of it": ("import os\nos.no_such\n", "a_library", "E160 a_library is missing or broken (AttributeError: "),
}


@pytest.mark.parametrize("how", BREAKS)
def test_a_module_that_is_missing_or_broken_is_one_line_that_names_it(how: str, tmp_path: Path) -> None:
    """The page's log was 27 lines of a traceback, every five seconds."""
    text, module, told = BREAKS[how]
    (tmp_path / "a_library").mkdir()
    (tmp_path / "a_library" / "__init__.py").write_text(text)
    failure = f"SystemExit(sys.path.insert(0, {str(tmp_path)!r}) or __import__({module!r}))"
    code, lines = say(tmp_path, NO_MEMORY.replace("FAILURE", failure))
    assert (code, len(lines)) == (exit_codes.DEVICE, 1), lines
    assert " error   start E160 " in lines[0] and told in lines[0] and lines[0].endswith(f"anew in {sys.prefix}")


def test_a_defect_where_memory_is_not_limited_keeps_its_traceback(tmp_path: Path) -> None:
    limit = "    resource.setrlimit(resource.RLIMIT_AS, (400 << 20, 400 << 20))\n"
    code, lines = say(tmp_path, NO_MEMORY.replace("FAILURE", "ImportError('no such name')").replace(limit, ""))
    assert code == 1 and any("Traceback" in line for line in lines)


def test_it_gives_way_to_control_and_goes_first_when_memory_runs_out() -> None:
    code = (
        "import os; from pathlib import Path; from gateway.processes.beside_control import serve_behind_control\n"
        "serve_behind_control(); print(Path('/proc/self/oom_score_adj').read_text(), os.nice(0))"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    score, nice = map(int, said.split())
    assert score == 900 and nice >= priority.HELPER_NICE


def test_it_ends_with_its_guardian_whatever_it_is_at(tmp_path: Path) -> None:
    """Else it would hold its port, and show a gateway that is gone."""
    guardian, link = socket.socketpair()
    command = [sys.executable, "-c", SERVES_FOR_EVER, str(link.fileno()), json.dumps({"state": str(tmp_path)})]
    with subprocess.Popen(command, pass_fds=[link.fileno()], stdout=subprocess.PIPE) as served:
        link.close()
        assert served.stdout and served.stdout.readline() == b"serves\n"
        assert served.poll() is None
        guardian.close()
        try:
            assert served.wait(10.0) == 0
        finally:
            served.kill()


def test_a_stop_that_every_process_is_told_leaves_it_there_until_the_guardian_ends(tmp_path: Path) -> None:
    """As systemd tells: page and telemetry show the force that is ramped to 0, and that it is."""
    guardian, link = socket.socketpair()
    command = [sys.executable, "-c", SERVES_FOR_EVER, str(link.fileno()), json.dumps({"state": str(tmp_path)})]
    with subprocess.Popen(command, pass_fds=[link.fileno()], stdout=subprocess.PIPE) as served:
        link.close()
        assert served.stdout and served.stdout.readline() == b"serves\n"
        served.terminate()
        guardian.close()
        assert served.wait(10.0) == 0, "not by the signal"


def test_a_machine_that_refuses_a_thread_is_told_in_one_line(tmp_path: Path) -> None:
    """It was a traceback, at each of its starts."""
    code, lines = say(
        tmp_path,
        "import threading\n"
        'def refuse(thread): raise RuntimeError("can\'t start new thread")\n'
        f"threading.Thread.start = refuse\n{SERVES_FOR_EVER}",
    )
    assert code == exit_codes.FAILED
    (told,) = lines
    assert told.startswith("E106 no thread to wait for the guardian: can't start new thread; too few processes")
