"""How a run's tests are shared among workers: processes that are forked once all tests are collected, so that each test file
is imported once. Who is free takes the next group of tests from a pipe that all share."""

import ctypes
import os
import platform
import signal
import struct
import sys
import traceback
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from mmap import mmap
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from selectors import EVENT_READ, PollSelector
from types import ModuleType
from typing import Any, Final, NamedTuple

import pytest

TELLING_S: Final = 0.1
"""A fixture that takes longer is told, for the list of the slowest."""
NUMBER: Final = 4
"""Bytes of the place of a group or a test."""
INTERRUPT: Final = {signal.SIGINT}
NICE: Final = 5
"""Of a worker whose tests wait for no clock."""
TURN_NS: Final = 20_000_000
"""The length of its turns. Four workers of simulated schedules took 8 % less processor by it than by the kernel's own."""
SCHED_SETATTR: Final = {"x86_64": 314, "aarch64": 274}
"""Its number, for many a libc has no function of that name."""
NO_TEST: Final = b"\xff" * NUMBER


def is_needed(report: pytest.TestReport) -> bool:
    """Return False for a fixture that was made or ended at once, without a fault and in silence."""
    is_told = report.failed or report.skipped or report.when == "call" or report.duration >= TELLING_S
    return is_told or bool(report.user_properties)


def is_plain(report: pytest.TestReport) -> bool:
    """Return whether nothing is to be told of a phase but that it went well, and how long it took."""
    return report.passed and not (report.sections or report.user_properties or hasattr(report, "wasxfail"))


class Plain(NamedTuple):
    """What such a report says beside its test."""

    when: Any
    duration_s: float

    def report_of(self, nodeid: str, location: tuple[str, int | None, str]) -> pytest.TestReport:
        return pytest.TestReport(nodeid, location, {}, "passed", None, self.when, duration=self.duration_s)


class Telling:
    """Tells of each test of a worker, at the test's end, what it came to, of most in two words: a whole report
    brings all keywords of its test along. When the session ends nobody may listen any more."""

    def __init__(self, session: pytest.Session, told: Connection) -> None:
        self._config, self._told = session.config, told
        self._reports: list[Any] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if is_needed(report):
            pack = self._config.hook.pytest_report_to_serializable
            packed = (
                Plain(report.when, report.duration) if is_plain(report) else pack(config=self._config, report=report)
            )
            self._reports.append(packed)

    def pytest_runtest_logfinish(self, nodeid: str, location: tuple[str, int | None, str]) -> None:
        self._told.send((nodeid, location, self._reports))
        self._reports = []


class BetweenGroups:
    """Stands for a group's next test, which nobody has chosen yet: of the fixtures those of the session stay."""

    def __init__(self, session: pytest.Session) -> None:
        self._session = session

    def listchain(self) -> list[pytest.Session]:
        return [self._session]


class WorkerProcess:
    """What a forked process does. place: where it notes the place of the test that it is at."""

    def __init__(self, session: pytest.Session, name: str, told: Connection, place: mmap) -> None:
        self._session, self._place = session, place
        self._last: pytest.Item | None = None
        config: Any = session.config
        config.workerinput = {"workerid": name}  # by which plugins know a worker
        sys.modules["__main__"] = ModuleType("__main__")  # else what a test spawns would import pytest
        capture, terminal = (config.pluginmanager.get_plugin(name) for name in ("capturemanager", "terminalreporter"))
        capture.stop_global_capturing()  # into files that all would share
        capture.start_global_capturing()
        config.pluginmanager.unregister(terminal)
        config.pluginmanager.register(Telling(session, told))
        folders = config._tmp_path_factory
        folders._basetemp = folders.getbasetemp() / name
        folders._basetemp.mkdir(mode=0o700)

    def run(self, groups: Iterable[list[int]]) -> None:
        """Run the tests at these places, until -x or Ctrl-C ends that."""
        try:
            for group in groups:
                self._run_group([self._session.items[place] for place in group], group)
                if self._session.shouldfail:
                    break
        except KeyboardInterrupt:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        finally:
            if self._last:
                self._end_session(self._last)

    def _run_group(self, items: list[pytest.Item], places: list[int]) -> None:
        following: list[Any] = [*items[1:], BetweenGroups(self._session)]
        for item, place, after in zip(items, places, following, strict=True):
            self._last, self._place[:] = item, place.to_bytes(NUMBER)
            item.ihook.pytest_runtest_protocol(item=item, nextitem=after)
            if self._session.shouldfail:
                return

    def _end_session(self, last: pytest.Item) -> None:
        """End the session's fixtures, as a part of the last test."""
        end: Any = self._session._setupstate.teardown_exact  # type: ignore[attr-defined]
        call = pytest.CallInfo.from_call(lambda: end(None), "teardown")
        report = last.ihook.pytest_runtest_makereport(item=last, call=call)
        last.ihook.pytest_runtest_logreport(report=report)
        last.ihook.pytest_runtest_logfinish(nodeid=last.nodeid, location=last.location)


@contextmanager
def ending_the_process(terminal: int) -> Iterator[None]:
    """Let a worker leave no frame of those in which it was forked. terminal: descriptor for what it has died of."""
    try:
        yield
        os._exit(0)
    except (BrokenPipeError, KeyboardInterrupt):  # the run has ended
        os._exit(1)
    except BaseException:
        os.write(terminal, traceback.format_exc().encode())
        os._exit(1)


def step_back() -> None:
    """Let this process and what it starts run when those that are held to seconds leave a core to it, and then for longer at a
    time: four workers on two cores, which take turns in milliseconds, read their memory anew at each turn. Linux before 6.12
    pays the length of a turn no attention."""
    nice = max(NICE, os.getpriority(os.PRIO_PROCESS, 0))
    attributes = struct.pack("IIQiIQQQ", 48, os.SCHED_BATCH, 0, nice, 0, TURN_NS, 0, 0)  # of sched_setattr(2)
    number = SCHED_SETATTR.get(platform.machine())
    if number is None or ctypes.CDLL(None).syscall(number, 0, attributes, 0):
        os.setpriority(os.PRIO_PROCESS, 0, nice)
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def own_threads() -> set[str]:
    """Names of this process's threads beside its first, which a fork does not take along."""
    threads = [thread for thread in Path("/proc/self/task").iterdir() if thread.name != str(os.getpid())]
    return {(thread / "comm").read_text().strip() for thread in threads}


class Worker(NamedTuple):
    """A worker as the run sees it."""

    pid: int
    place: mmap


class ForkedWorkers:
    """Runs what is collected in `count` processes, each group (`group_of` a test's id) in one of them, in its order. Each group
    of `waiting`, which leaves its core to others, has one more, and the others step back behind it."""

    def __init__(self, count: int, group_of: Callable[[str], str], waiting: Collection[str] = ()) -> None:
        self._count, self._group_of, self._waiting = count, group_of, waiting
        self._workers: dict[Connection, Worker] = {}
        self._groups: dict[str, list[int]] = {}
        self._started = 0
        self._hearing = PollSelector()  # of which no worker inherits a descriptor

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool | None:
        option = session.config.option
        if session.testsfailed or option.collectonly or option.usepdb:
            return None  # and pytest goes on
        assert not (threads := own_threads()), (
            f"an import of a test file has started what no worker would have: {threads}"
        )
        for place, item in enumerate(session.items):
            self._groups.setdefault(self._group_of(item.nodeid), []).append(place)
        self._queue, filling = os.pipe()
        os.write(filling, b"".join(number.to_bytes(NUMBER) for number in range(len(self._groups))))
        os.close(filling)
        session.config._tmp_path_factory.getbasetemp()  # type: ignore[attr-defined]  # one for all
        try:
            count = self._count + sum(group in self._waiting for group in self._groups)
            for _ in range(min(count, len(self._groups))):
                self._start(session, [])
            self._listen(session)
        finally:
            self._end()
        return True

    def _start(self, session: pytest.Session, first: list[int]) -> None:
        """Fork a worker, which begins with the tests at these places."""
        (heard, told), place = Pipe(duplex=False), mmap(-1, NUMBER)
        place[:] = NO_TEST
        self._started += 1
        signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPT)  # until the one is in its frame, and the other knows of it
        pid = os.fork()
        if not pid:
            with ending_the_process(os.dup(2)):
                signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPT)
                for other in (heard, *self._workers):
                    other.close()
                WorkerProcess(session, f"worker{self._started}", told, place).run(self._take_groups(first))
        self._workers[heard] = Worker(pid, place)
        self._hearing.register(heard, EVENT_READ)
        told.close()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPT)

    def _take_groups(self, first: list[int]) -> Iterator[list[int]]:
        if first:
            yield first
        names = list(self._groups)
        while number := os.read(self._queue, NUMBER):
            name = names[int.from_bytes(number)]
            if name not in self._waiting:
                step_back()
            yield self._groups[name]

    def _listen(self, session: pytest.Session) -> None:
        """Pass on what the workers tell, until each has ended."""
        hook = session.config.hook
        while self._workers:
            for key, _ in self._hearing.select():
                heard: Any = key.fileobj
                try:
                    nodeid, location, reports = heard.recv()
                except EOFError:
                    self._bury(session, heard)
                    continue
                for packed in reports:
                    if isinstance(packed, Plain):
                        report = packed.report_of(nodeid, location)
                    else:
                        report = hook.pytest_report_from_serializable(config=session.config, data=packed)
                    hook.pytest_runtest_logreport(report=report)
                hook.pytest_runtest_logfinish(nodeid=nodeid, location=location)
                if session.shouldfail:
                    raise session.Failed(session.shouldfail)

    def _bury(self, session: pytest.Session, heard: Connection) -> None:
        """A worker has ended. Died it has with a test that fails so, and another one goes on behind that."""
        worker = self._workers.pop(heard)
        self._hearing.unregister(heard)
        heard.close()
        _, status = os.waitpid(worker.pid, 0)
        if not status:
            return
        if worker.place[:] == NO_TEST:
            raise ChildProcessError("a worker has died before its first test")
        place = int.from_bytes(worker.place[:])
        item = session.items[place]
        how = f"a worker has died in this test: {os.waitstatus_to_exitcode(status)}"
        report = pytest.TestReport(item.nodeid, item.location, {}, "failed", how, "call")
        session.config.hook.pytest_runtest_logreport(report=report)
        if not session.shouldfail:
            self._start(session, [other for other in self._groups[self._group_of(item.nodeid)] if other > place])

    def _end(self) -> None:
        """End workers that still run, since -x or Ctrl-C has ended the run."""
        os.close(self._queue)
        for heard, worker in self._workers.items():
            heard.close()
            with suppress(ProcessLookupError):
                os.kill(worker.pid, signal.SIGINT)
        for worker in self._workers.values():
            os.waitpid(worker.pid, 0)
