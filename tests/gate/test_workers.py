"""How the gate shares its tests among workers: what must stay together does, and no name in the lists is out of date. What
workers tell of a test, how they end, and that no test leaves anything behind."""

import asyncio
import fcntl
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import (
    DESCRIPTORS,
    LONG_WAITS,
    REAL_TIME,
    SLOW,
    SPREAD,
    WITH_A_CLOCK,
    begun_at,
    find_leaks,
    group_of,
)
from tests.gate.one_compiler import OneCompiler
from tests.gate.workers import NICE, Plain, is_needed, is_plain

TESTS = Path(__file__).parents[1]
INTERRUPTED = """
import os, signal

def fork(fork=os.fork):
    if pid := fork():
        os.kill(os.getpid(), signal.SIGINT)
    return pid

os.fork = fork
"""
CONFTEST = """
import os
from pathlib import Path
import pytest
from tests.gate.workers import ForkedWorkers

@pytest.fixture(scope="session", autouse=True)
def ends():
    yield
    Path(f"ended-{os.getpid()}").touch()
    assert not os.path.exists("ends badly"), "ended badly"

def pytest_configure(config):
    config.pluginmanager.register(ForkedWorkers(2, lambda nodeid: nodeid.partition("::")[0]))
"""


def test_a_file_is_one_group_whatever_its_parameters_are_called() -> None:
    file = "tests/twin/test_any.py"
    assert {group_of(f"{file}::{name}") for name in ("test_a", "test_b[a::b]", "test_c[x@y]")} == {"twin/test_any.py"}


def test_all_that_is_in_real_time_is_one_group_and_begins_first() -> None:
    nodeids = [f"tests/{folder}/test_any.py::test_a" for folder in REAL_TIME]
    assert {group_of(nodeid) for nodeid in nodeids} == {"real time"}
    assert {begun_at(nodeid) for nodeid in nodeids} == {0}


def test_what_waits_for_minutes_is_the_second_group() -> None:
    nodeids = [f"tests/{place}::test_a" for place in LONG_WAITS]
    assert {(group_of(nodeid), begun_at(nodeid)) for nodeid in nodeids} == {("long waits", 1)}


def test_each_recording_of_the_sample_is_a_group_and_the_laws_over_them_are_one() -> None:
    for prefix in SPREAD:
        assert len({group_of(f"tests/{prefix}{number}]") for number in range(19)}) == 19
    file = SPREAD[0].partition("::")[0]
    assert group_of(f"tests/{file}::test_nothing_is_found_in_nothing") == file


def test_slow_files_begin_before_others() -> None:
    ranks = [begun_at(f"tests/{file}::test_a") for file in (*SLOW, "twin/test_any.py")]
    assert ranks == sorted(set(ranks))
    assert all(begun_at(f"tests/{prefix}3]") < ranks[0] for prefix in SPREAD)


def test_every_place_that_the_lists_name_is_there() -> None:
    assert all((TESTS / place).exists() for place in (*REAL_TIME, *LONG_WAITS, *SLOW, *WITH_A_CLOCK))
    assert all(place.startswith(WITH_A_CLOCK) for place in (*REAL_TIME, *LONG_WAITS))
    for prefix in SPREAD:
        file, _, name = prefix.partition("::")
        assert f"def {name.removesuffix('[')}(" in (TESTS / file).read_text(encoding="utf-8")


def report(when: str, outcome: str, duration_s: float = 0.0, said: tuple[tuple[str, str], ...] = ()) -> Any:
    place = ("a.py", 1, "test_a")
    return pytest.TestReport("a.py::test_a", place, {}, outcome, None, when, user_properties=said, duration=duration_s)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("one", "is_told"),
    [
        (report("call", "passed"), True),
        (report("setup", "passed"), False),
        (report("teardown", "passed"), False),
        (report("setup", "failed"), True),
        (report("setup", "skipped"), True),
        (report("teardown", "failed"), True),
        (report("setup", "passed", 0.2), True),
        (report("teardown", "passed", said=(("tried again", "stolen"),)), True),
    ],
)
def test_all_but_a_fixture_that_went_well_is_told(one: Any, is_told: bool) -> None:
    assert is_needed(one) is is_told


@pytest.mark.parametrize(
    "changes", [{}, {"sections": [("stdout", "said")]}, {"wasxfail": "why"}, {"outcome": "failed"}]
)
def test_of_what_went_well_in_silence_a_worker_tells_the_time_and_of_anything_else_all(changes: dict[str, Any]) -> None:
    one = report("call", "passed", 0.2)
    vars(one).update(changes)
    assert is_plain(one) is (not changes)
    other = Plain(one.when, one.duration).report_of(one.nodeid, one.location)
    what = ("nodeid", "location", "outcome", "when", "duration", "sections", "user_properties")
    assert [getattr(other, name) == getattr(one, name) for name in what].count(False) == len(changes.keys() & {*what})
    assert not is_plain(report("call", "passed", said=(("tried again", "stolen"),)))


def run_in_workers(folder: Path, *words: str, conftest: str = CONFTEST, **files: str) -> subprocess.Popen[str]:
    """Begin to run test files of this text in two workers."""
    (folder / "conftest.py").write_text(conftest)
    for name, text in files.items():
        (folder / f"test_{name}.py").write_text("import os, signal, time\nfrom pathlib import Path\n" + text)
    (folder / "interrupted.py").write_text(INTERRUPTED)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", *words, "."]
    environment = os.environ | {"PYTHONPATH": f"{TESTS.parent}:{folder}", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    out = subprocess.PIPE
    return subprocess.Popen(command, cwd=folder, env=environment, stdout=out, stderr=subprocess.STDOUT, text=True)


def test_each_test_runs_once_in_its_group_s_worker_and_what_fails_is_told(tmp_path: Path) -> None:
    note = "def test_{}(tmp_path):\n    print('said')\n    with open('ran', 'a') as ran: "
    note += "ran.write(f'{} {} {{os.getpid()}}\\n')\n"
    files = {
        group: "".join(note.format(name, group, name) for name in "ab")
        + ("    assert tmp_path.parent.name == 'no'\n" if group == "three" else "")
        for group in ("one", "two", "three")
    }
    run = run_in_workers(tmp_path, **files)
    said, _ = run.communicate()
    ran = [line.split() for line in (tmp_path / "ran").read_text().splitlines()]
    assert sorted((group, name) for group, name, _ in ran) == sorted((group, name) for group in files for name in "ab")
    assert len({(group, pid) for group, _, pid in ran}) == 3 and str(run.pid) not in {pid for *_, pid in ran}
    assert run.returncode == 1 and "1 failed, 5 passed" in said
    assert re.search(r"AssertionError: assert 'worker[12]' == 'no'", said) and said.count("said\n") == 1
    assert {path.name for path in tmp_path.glob("ended-*")} >= {f"ended-{pid}" for *_, pid in ran}


def test_a_group_that_waits_has_a_worker_beside_those_that_have_something_to_do(tmp_path: Path) -> None:
    """Of as many workers as cores one that waits would leave a core idle; where nothing waits, more hinder each other."""
    waits = (
        "def test_a():\n    for _ in range(100):\n        if Path('done').exists(): return\n        time.sleep(0.005)\n"
    )
    conftest = CONFTEST.replace("ForkedWorkers(2, ", "ForkedWorkers(1, ").replace("[0]))", '[0], ["test_a_waits.py"]))')
    told = []
    for text in (conftest, conftest.replace("test_a_waits", "test_nothing")):
        files = {"a_waits": waits + "    assert False, 'alone'\n", "does": "def test_b(): Path('done').touch()\n"}
        run = run_in_workers(tmp_path, conftest=text, **files)
        told.append(run.communicate()[0])
        (tmp_path / "done").unlink()
    assert "2 passed" in told[0] and "alone" in told[1]


def test_only_what_waits_for_a_clock_keeps_its_place_before_others(tmp_path: Path) -> None:
    rank = "f'{os.getpriority(os.PRIO_PROCESS, 0)} {os.sched_getscheduler(0)}'"
    tell = f"def test_a(): Path(__file__ + '.told').write_text({rank})\n"
    conftest = CONFTEST.replace("[0]))", '[0], ["test_a_waits.py"]))')
    run = run_in_workers(tmp_path, conftest=conftest, a_waits=tell, does=tell)
    assert "2 passed" in run.communicate()[0]
    waiting, stepped_back = ((tmp_path / f"test_{name}.py.told").read_text().split() for name in ("a_waits", "does"))
    assert int(waiting[0]) == os.getpriority(os.PRIO_PROCESS, 0) and int(waiting[1]) == os.sched_getscheduler(0)
    assert int(stepped_back[0]) >= NICE and int(stepped_back[1]) == os.SCHED_BATCH


def test_a_worker_that_dies_fails_its_test_and_another_one_goes_on_behind_it(tmp_path: Path) -> None:
    dying = "def test_a(): pass\ndef test_b(): os.kill(os.getpid(), signal.SIGKILL)\ndef test_c(): pass\n"
    run = run_in_workers(tmp_path, dying=dying, other="def test_d(): pass\n")
    said, _ = run.communicate()
    assert run.returncode == 1 and "1 failed, 3 passed" in said
    assert "a worker has died in this test: -9" in said and "FAILED test_dying.py::test_b" in said


def test_what_the_session_s_end_finds_fails_the_run(tmp_path: Path) -> None:
    (tmp_path / "ends badly").touch()
    run = run_in_workers(tmp_path, one="def test_a(): pass\n")
    said, _ = run.communicate()
    assert run.returncode == 1 and "1 passed, 1 error" in said and "ended badly" in said


def test_at_the_first_failure_the_others_are_ended_with_all_their_fixtures(tmp_path: Path) -> None:
    waits = "def test_a():\n    Path('waits').touch()\n    time.sleep(600)\n"
    fails = "def test_b():\n    while not Path('waits').exists(): time.sleep(0.01)\n    assert False\n"
    run = run_in_workers(tmp_path, "-x", fails=fails, waits=waits, later="def test_c(): pass\n")
    said, _ = run.communicate()
    assert run.returncode == 1 and "1 failed" in said and "Traceback" not in said
    assert len(list(tmp_path.glob("ended-*"))) == 2


def test_a_thread_that_no_worker_would_have_ends_the_run_before_its_first_test(tmp_path: Path) -> None:
    thread = "import threading\nthreading.Thread(target=time.sleep, args=(1.0,)).start()\ndef test_a(): pass\n"
    run = run_in_workers(tmp_path, one=thread)
    said, _ = run.communicate()
    assert run.returncode == 3 and "has started what no worker would have" in said and "passed" not in said


def test_an_interrupt_right_behind_a_fork_ends_that_worker_too(tmp_path: Path) -> None:
    run = run_in_workers(
        tmp_path, "-p", "interrupted", waits="def test_a():\n    time.sleep(2)\n    Path('went on').touch()\n"
    )
    said, _ = run.communicate()
    assert run.returncode == 2 and "KeyboardInterrupt" in said
    assert not (tmp_path / "went on").exists()


def test_an_interrupt_ends_all_workers_with_their_fixtures(tmp_path: Path) -> None:
    waits = "def test_a():\n    Path('begun').touch()\n    time.sleep(600)\n"
    run = run_in_workers(tmp_path, waits=waits)
    while (
        not (tmp_path / "begun").exists() and run.poll() is None
    ):  # a run that ends early is told below, not waited for
        time.sleep(0.01)
    run.send_signal(signal.SIGINT)
    said, _ = run.communicate()
    assert run.returncode == 2 and "KeyboardInterrupt" in said
    assert len(list(tmp_path.glob("ended-*"))) == 1


@pytest.mark.parametrize("is_counted", [True, False])
def test_a_descriptor_that_is_left_fails_its_test_and_one_that_is_closed_does_not(
    is_counted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a kernel that counts them as well as by an older one, which says 0."""
    if not is_counted:
        stat, none = os.stat, os.stat_result([0] * 10)
        monkeypatch.setattr("os.stat", lambda path, **how: none if path == DESCRIPTORS else stat(path, **how))
    check = find_leaks()
    next(check)
    number = os.open("/dev/null", os.O_RDONLY)
    with pytest.raises(AssertionError, match=r"descriptors left behind: .*/dev/null"):
        next(check)
    os.close(number)
    assert list(find_leaks()) == [None]


def test_a_task_that_is_left_fails_its_test() -> None:
    async def leave_one() -> None:
        asyncio.get_running_loop().create_task(asyncio.sleep(60.0), name="left")

    check = find_leaks()
    next(check)
    asyncio.run(leave_one())
    with pytest.raises(AssertionError, match=r"tasks left behind: .*left"):
        next(check)
    assert list(find_leaks()) == [None]


def test_one_worker_compiles_at_a_time_and_a_loop_within_another_waits_for_nobody(tmp_path: Path) -> None:
    lock, held = tmp_path / "lock", list[bool]()
    lock.touch()

    def is_free() -> bool:
        with lock.open("rb") as other:
            try:
                fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            return True

    class Dispatcher:
        def __init__(self, *calls: Any) -> None:
            self.calls = calls

        def compile(self, types: object) -> object:
            held.append(not is_free())
            for loop in self.calls:
                loop.compile(types)
            held.append(not is_free())
            return types

    OneCompiler(lock).take_turns(Dispatcher)
    assert Dispatcher(Dispatcher(), Dispatcher()).compile("floats") == "floats"
    assert held == [True] * 6 and is_free()
