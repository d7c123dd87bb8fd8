"""What every test must leave behind: no task, no descriptor, no child process."""

import asyncio
import gc
import os
import signal
import time
from collections.abc import Callable, Iterator
from importlib import import_module
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

import hypothesis
import pytest

from tests.gate.budgets import SAMPLED, leave_out_long
from tests.gate.one_compiler import OneCompiler
from tests.gate.tried_again import TriedAgain
from tests.gate.workers import ForkedWorkers

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: the diagnosis' matrices are small
os.environ.setdefault(
    "JE_ARROW_MALLOC_CONF", "background_thread:false"
)  # before pyarrow: workers and children are forked


def pytest_configure(config: pytest.Config) -> None:
    """A shell's background job inherits an ignored SIGINT, and so would every process under test."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    config.pluginmanager.register(TriedAgain(lambda nodeid: nodeid.removeprefix("tests/").startswith(WITH_A_CLOCK)))
    draw_examples(at_random=config.getoption("--long"))
    if workers := config.getoption("--workers"):
        config.pluginmanager.register(ForkedWorkers(workers, group_of, IN_REAL_TIME))
    gc.disable()  # until all tests are collected, of which none is garbage


def draw_examples(*, at_random: bool) -> None:
    """The same examples in each push, new ones in a long run and three times as many, which prints how to draw a failing one
    again. No example has a bound in time: a busy machine is no fault."""
    count = 100 if at_random else -(-100 // SAMPLED)
    hypothesis.settings.register_profile(
        "ours", derandomize=not at_random, deadline=None, print_blob=True, max_examples=count
    )
    hypothesis.settings.load_profile("ours")


KEPT_PROFILES = 64
READERS = ("gateway.profiles.load", "gateway.calibrations.store", "gateway.plants.store")
parsed: dict[tuple[bytes, str], Any] = {}
"""Documents by their bytes and their file's name."""


def keep_parsed_profiles() -> None:
    """Parse each file that is read again and again once, and read what it says once: a rig is assembled two thousand times in
    the gate, of the same few files. What tells the faults of a file's text is not kept."""
    from gateway.profiles.kinds import calibrations, devices, plants, registers
    from gateway.profiles.rigs import assembly
    from gateway.profiles.strict_yaml.text import Document, parse

    def parse_once(data: bytes, file: str) -> Document:
        document = parsed.pop((data, file), None) or parse(data, file)
        parsed[data, file] = document  # behind all others: who is not asked for is forgotten
        if len(parsed) > KEPT_PROFILES:
            del parsed[next(iter(parsed))]
        return document

    for name in READERS:
        import_module(name).parse = parse_once  # type: ignore[attr-defined]
    for room, reader in ((devices, "read_device"), (plants, "read_plant"), (calibrations, "read_calibration")):
        read = done_once(getattr(room, reader))
        for module in (room, assembly):
            setattr(module, reader, read)
    assembly.read_served_registers = done_once(registers.read_served_registers)
    registers.read_map = done_once(registers.read_map)


def done_once(read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """The same for the same argument, which stays as long as its result is kept; nobody may change what comes."""
    known: dict[int, tuple[Any, Any]] = {}

    def read_once(given: Any) -> Any:
        entry = known.pop(id(given), None) or (given, read(given))
        known[id(given)] = entry
        if len(known) > KEPT_PROFILES:
            del known[next(iter(known))]
        return entry[1]

    return read_once


@pytest.fixture(scope="session", autouse=True)
def nobody_changes_what_all_share() -> Iterator[None]:
    """At a worker's end, on its last test."""
    from gateway.profiles.strict_yaml.text import parse

    yield
    changed = [file for (data, file), document in parsed.items() if document != parse(data, file)]
    assert not changed, f"somebody has changed what was read of {changed}"


def pytest_collection() -> None:
    """Before test files are read, of which many ask for profiles at their import."""
    keep_parsed_profiles()


def pytest_collection_finish(session: pytest.Session) -> None:
    """The thousands of tests stay until the end: they are not walked through at each collection of garbage, of which there is
    one for every so many new things. At Python's own 700 it takes a thirtieth of a simulated schedule."""
    if session.config.getoption("--workers"):
        from numba.core.dispatcher import Dispatcher  # which test files have imported by now

        OneCompiler(HERE / "conftest.py").take_turns(Dispatcher)
    gc.freeze()
    gc.set_threshold(*COLLECT_AT)
    gc.enable()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--long", action="store_true", help="the same tests with a bigger budget: seeds, kills, fuzz, soak"
    )
    parser.addoption(
        "--workers",
        type=int,
        default=0,
        help="processes that share the tests that wait for no clock; 0: one runs all, in order",
    )


HERE = Path(__file__).parent

COLLECT_AT = (20_000, 20, 20)
"""New things until the youngest are walked through, and how often that until the older ones are."""

DESCRIPTORS = "/proc/self/fd/"

REAL_TIME = ("end_to_end/", "ports/")
"""What starts processes or waits for real lines: one worker runs it one after the other, so that bounds in seconds do
not compete with each other, and no worker that has something to calculate waits."""

LONG_WAITS = (
    "end_to_end/first_hour/test_calibrate.py",
    "end_to_end/first_hour/test_experiment_run.py",
    "service/probing/",
    "service/running_rig/lines/load_cell/test_baud_probe.py",
)
"""What waits for minutes while a plan is run or a port is asked what is there, and is held to no second: another worker does
that meanwhile."""

IN_REAL_TIME = ("real time", "long waits")

WITH_A_CLOCK = (
    *(
        f"{room}/"
        for room in "audit calibrations cli clients disk end_to_end fieldbus fleet live ports processes".split()
    ),
    *(f"{room}/" for room in "recording reports service telemetry watch web".split()),
)
"""Rooms in which some test waits for the machine's own clock, for a thread, a process or a browser: a machine that stands still
is no fault of theirs (`tried_again`)."""

IN_BROWSER = "web/tabs/in_chromium/"
"""Whose files share one browser (its conftest.py): they are one group. To start one takes as long as three pages."""

SLOW = (
    IN_BROWSER,
    "service/closed_loop/test_study.py",
    "service/edge_table/test_edge_table.py",
    "service/fitting/test_interrupted_ladder.py",
    "diagnosis/changes/test_what_has_changed.py",
    "watch/test_watch_in_virtual_time.py",
    "paper/test_paper_report.py",
    "control/foreign/test_foreign_machines.py",
    "test_compiled_folder.py",
    "web/tabs/test_calibrations_tab.py",
)
"""Files, and a folder, of more than ten seconds of processor, or that wait as long for a browser: begun first, so that none is
left to one worker at the end, nor all workers wait there."""

SPREAD = (
    "hidden_effects/test_hidden_effects.py::test_a_recording_gets_an_answer[",
    "simulation/test_schedules.py::test_whatever_happens_no_law_is_broken_and_the_force_comes_back[",
)
"""Two minutes of processor each, of which all workers take their share: each of these tests is a group of its own."""


def group_of(nodeid: str) -> str:
    """What one worker runs in one piece: a file, whose fixtures are then made once, what is in real time, in two parts, or
    what shares a browser."""
    name = nodeid.removeprefix("tests/")
    if name.startswith(SPREAD):
        return name
    path = name.partition("::")[0]
    if path.startswith(LONG_WAITS):
        return "long waits"
    if path.startswith(IN_BROWSER):
        return IN_BROWSER
    return "real time" if path.startswith(REAL_TIME) else path


def begun_at(nodeid: str) -> int:
    """Rank of a test's group among the workers' work: what is in real time waits most, then what is slow."""
    order = ("real time", "long waits", *SPREAD, *SLOW)
    name = nodeid.removeprefix("tests/")
    group = next((prefix for prefix in SPREAD if name.startswith(prefix)), group_of(nodeid))
    return order.index(group) if group in order else len(order)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    is_shared = bool(config.getoption("--workers"))
    if is_shared:
        items.sort(key=lambda item: (begun_at(item.nodeid), item.path))  # stable: within a file nothing moves
    if not config.getoption("--long"):
        leave_out_long(items, in_silence=is_shared)


@pytest.fixture(scope="session")
def run_folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that all workers of this run share, and no other run: for what is worth making once (with a lock)."""
    own = tmp_path_factory.getbasetemp()
    return own.parent if hasattr(request.config, "workerinput") else own


@pytest.fixture
def budget(request: pytest.FixtureRequest) -> int:
    """How many times more than in the push gate a test may run its loop: 1, or 20 with --long."""
    return 20 if request.config.getoption("--long") else 1


@pytest.fixture(scope="module")
def tracker_process() -> None:
    """The standard library's own process beside spawned ones, which stays to the end: nobody leaks it."""
    resource_tracker.ensure_running()


@pytest.fixture
def generous_umask() -> Iterator[None]:
    """Takes nothing away: what is seen is what was asked for."""
    previous = os.umask(0)
    yield
    os.umask(previous)


def open_descriptors() -> dict[str, str]:
    """By `os`, not by `pathlib`, for a test may wait for its threads."""
    found = {}
    for name in os.listdir(DESCRIPTORS):  # noqa: PTH208
        try:
            found[name] = os.readlink(DESCRIPTORS + name)  # noqa: PTH115
        except OSError:  # the listing's own descriptor
            continue
    return {name: target for name, target in found.items() if not target.startswith("/proc/")}


left_over: list[str] = []
"""Tasks that were cancelled in the running test."""


@pytest.fixture(scope="session", autouse=True)
def cancelled_tasks_are_noted() -> Iterator[None]:
    """asyncio.run cancels left-over tasks silently."""
    cancel_all_tasks = asyncio.runners._cancel_all_tasks  # type: ignore[attr-defined]

    def cancel_and_note(loop: asyncio.AbstractEventLoop) -> None:
        left_over.extend(repr(task) for task in asyncio.all_tasks(loop))
        cancel_all_tasks(loop)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(asyncio.runners, "_cancel_all_tasks", cancel_and_note)
        yield


@pytest.fixture(autouse=True)
def nothing_leaks() -> Iterator[None]:
    yield from find_leaks()


def count_descriptors() -> int:
    """As the kernel counts them, since Linux 6.2; a listing, with its own, takes four times as long."""
    return os.stat(DESCRIPTORS).st_size or len(os.listdir(DESCRIPTORS)) - 1  # noqa: PTH116, PTH208


def find_leaks() -> Iterator[None]:
    """Left-over tasks fail the test, and so do left-over descriptors. These are counted, at each of fifteen thousand tests;
    what they are is asked for where there are more."""
    left_over.clear()
    before = count_descriptors()
    yield
    assert not left_over, f"tasks left behind: {left_over}"
    if count_descriptors() > before:
        after = wait_for_closing(before)
        assert len(after) <= before, f"descriptors left behind: {len(after) - before} of {after}"


def wait_for_closing(before: int) -> dict[str, str]:
    """What is open once garbage is collected and threads had two seconds, or there are no more than before: one that syncs a
    file beside the loop may be a moment behind."""
    gc.collect()
    for _ in range(200):
        if len(open_descriptors()) <= before:
            break
        time.sleep(0.01)
    return open_descriptors()
