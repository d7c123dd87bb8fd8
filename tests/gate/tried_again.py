"""A test in real time that fails while the machine stands still is tried again, twice.

Such a test holds the gateway to bounds of 100 ms, and a host that gives shares takes a processor for as long. What has been
measured during each try decides, by the kernel (`steal`) and by a witness beside the tests (`standstill`), not how the test
failed; a failure without, or a third, counts. Each is told at the end. To the first try the test before belongs: at its end a
gateway that both share may have come to a fault, which the next one finds.
"""

import gc
import sys
import warnings
from collections.abc import Callable
from typing import Any

import pytest
from _pytest.runner import runtestprotocol

from gateway.processes.scheduling.withheld_time import most_growth, read_stolen_s
from tests.gate.standstill import StandstillWitness
from tests.gate.workers import BetweenGroups

STOLEN_S = 0.05
"""Less breaks no bound: the shortest is twice as long."""
TRIES = 3
TOLD_AS = "tried again"


def forget_what_failed() -> None:
    """Let nothing be left of a try, in silence: its traceback holds sockets and files open, which would be found at any later
    test, and fail that, or the whole run at its end."""
    for name in ("last_type", "last_value", "last_traceback", "last_exc"):  # where pytest keeps it for debuggers
        vars(sys).pop(name, None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gc.collect()


class TriedAgain:
    """is_concerned: decides which tests are held to real time; lost_s: of each processor until now, and of the machine."""

    def __init__(
        self, is_concerned: Callable[[str], bool], lost_s: Callable[[], dict[str, float]] | None = None
    ) -> None:
        self._witness = None if lost_s else StandstillWitness()
        self._is_concerned, self._lost_s = is_concerned, lost_s or self._measured_s
        self._began: dict[str, float] = {}  # of the test before
        self._told: list[str] = []

    def _measured_s(self) -> dict[str, float]:
        assert self._witness
        return read_stolen_s() | {"witness": self._witness.lost_s()}

    def pytest_unconfigure(self) -> None:
        if self._witness:
            self._witness.close()

    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
        if not self._is_concerned(item.nodeid):
            return None
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        why, began = "", self._lost_s()
        before, self._began = self._began or began, began
        for left in reversed(range(TRIES)):
            reports = runtestprotocol(item, nextitem=nextitem, log=False)
            failed = [report.longreprtext[-200:] for report in reports if report.failed]
            if not failed:  # as nearly all: then nobody asks the kernel
                break
            if self._witness:
                self._witness.settle()
            lost_s = most_growth(self._lost_s(), before)
            if lost_s < STOLEN_S or not left:
                break
            why += f"{1e3 * lost_s:.0f} ms; {failed[0]} "
            self._begin_anew(item)
            before = self._lost_s()
        for report in reports:
            if why:  # a worker sends on what has any, also of the thousands that were made and ended at once
                report.user_properties.append((TOLD_AS, why))
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    @staticmethod
    def _begin_anew(item: Any) -> None:
        """Make all fixtures anew but the session's: a gateway that a module shares has a latched fault, or has ended. What
        fails in ending them is a part of the try that has failed."""
        end = item.session._setupstate.teardown_exact
        pytest.CallInfo.from_call(lambda: end(BetweenGroups(item.session)), "teardown")
        item._initrequest()  # as pytest does before the first time
        forget_what_failed()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        why = dict(report.user_properties).get(TOLD_AS)
        if why and report.when == "call":
            self._told.append(f"{report.nodeid}: {why}")

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        for line in self._told:
            terminalreporter.line(f"{TOLD_AS}, for this machine stood still: {line}")
