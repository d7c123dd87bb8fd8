"""How a run's workers share its tests, and what they tell of them: as xdist has it, where that is neither wrong nor dear."""

import fcntl
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any, Final

import pytest

TELLING_S: Final = 0.1
"""A fixture that takes longer is told, for the list of the slowest."""
PLAIN: Final = "plain"


class FewMessages:
    """Leaves out what nobody needs to know. xdist sends six messages for each of fifteen thousand tests; two of them say that
    nothing has gone wrong before and behind it, and what packs and unpacks them takes as long as a short test does."""

    def __init__(self, plugins: pytest.PytestPluginManager) -> None:
        (worker,) = (one for one in plugins.get_plugins() if type(one).__name__ == "WorkerInteractor")
        self._send, worker.sendevent = worker.sendevent, self._send_what_is_needed

    @pytest.hookimpl(tryfirst=True)
    def pytest_report_to_serializable(self, report: object) -> dict[str, Any] | None:
        """What is not sent is not packed."""
        return None if is_needed(report) else {PLAIN: True}

    def _send_what_is_needed(self, name: str, **contents: Any) -> None:
        if name != "logstart" and PLAIN not in contents.get("data", ()):
            self._send(name, **contents)


def is_needed(report: object) -> bool:
    """Return False for a fixture that was made or ended at once, without a fault and in silence."""
    if not isinstance(report, pytest.TestReport):
        return True
    is_told = report.failed or report.skipped or report.when == "call" or report.duration >= TELLING_S
    return is_told or bool(report.user_properties)


def schedule_groups(group_of: Callable[[str], str], config: pytest.Config, log: Any) -> Any:
    """Our own groups: xdist 3.8 passes its `xdist_group` through a field that pytest 9.2 no longer has, and in silence
    groups nothing (pytest-xdist issue 1386)."""
    from xdist.scheduler import LoadScopeScheduling

    places: dict[str, int] = {}

    class ByGroup(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return group_of(nodeid)

        def _assign_work_unit(self, node: Any) -> None:
            """As xdist does, which walks through all tests for the place of each, and at each test's end through all that its
            worker has ever had: groups that are done are forgotten."""
            if not places:
                places.update((nodeid, place) for place, nodeid in enumerate(self.registered_collections[node]))
            group, tests = self.workqueue.popitem(last=False)
            left = {name: had for name, had in self.assigned_work.get(node, {}).items() if not all(had.values())}
            self.assigned_work[node] = {**left, group: tests}
            node.send_runtest_some([places[nodeid] for nodeid, is_done in tests.items() if not is_done])

    config.option.loadscopereorder = False  # not by the number of tests: our order
    return ByGroup(config, log)


class GroupsStayTogether:
    """Fails a run in which a group was spread over workers: everything would pass, only slower and less surely."""

    def __init__(self, group_of: Callable[[str], str]) -> None:
        self._group_of = group_of
        self.workers: dict[str, set[str]] = {}
        self.lost_one = False

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if worker := getattr(report, "worker_id", None):
            self.workers.setdefault(self._group_of(report.nodeid), set()).add(worker)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, error: object) -> None:
        self.lost_one |= bool(error)  # its work went to another one

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        spread = [] if self.lost_one else [group for group, workers in self.workers.items() if len(workers) > 1]
        if spread:
            raise pytest.UsageError(f"not kept on one worker: {spread[:5]}")


class OneCompiler:
    """Lets one worker compile loops at a time: the others then find on disk what they, too, need. In a fresh clone all of them
    compiled the same for seconds, and at once. One loop may be compiled within another."""

    def __init__(self, file: Path) -> None:
        self._file, self._threads, self._depth = file, RLock(), 0

    def take_turns(self, dispatcher: Any) -> None:
        """dispatcher: numba's class of that name, which looks on disk before it compiles."""
        compile_now = dispatcher.compile

        def compile_in_turn(loop: Any, types: Any) -> Any:
            with self._turn():
                return compile_now(loop, types)

        dispatcher.compile = compile_in_turn

    @contextmanager
    def _turn(self) -> Iterator[None]:
        with self._threads, self._file.open("rb") as lock:
            if not self._depth:  # else this thread has it
                fcntl.flock(lock, fcntl.LOCK_EX)
            self._depth += 1
            try:
                yield
            finally:
                self._depth -= 1
