"""A test in real time that fails while the host of this virtual machine keeps a processor away is tried again, twice.

Such a test holds the gateway to bounds of 100 ms, and a host that gives shares takes a processor for as long. What the kernel
has counted as stolen during each try decides (`steal`), not how the test failed; a failure without, or a third, counts.
Each is told at the end.
"""

from collections.abc import Callable
from typing import Any

import pytest
from _pytest.runner import runtestprotocol

from gateway.processes.scheduling.withheld_time import most_growth, read_stolen_s

STOLEN_S = 0.05
"""Less breaks no bound: the shortest is twice as long."""
TRIES = 3
TOLD_AS = "tried again"


class TriedAgain:
    """is_concerned: decides which tests are held to real time; stolen_s: of each processor until now."""

    def __init__(
        self, is_concerned: Callable[[str], bool], stolen: Callable[[], dict[str, float]] = read_stolen_s
    ) -> None:
        self._is_concerned, self._stolen_s = is_concerned, stolen
        self._told: list[str] = []

    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
        if not self._is_concerned(item.nodeid):
            return None
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        why = ""
        for left in reversed(range(TRIES)):
            before = self._stolen_s()
            reports = runtestprotocol(item, nextitem=nextitem, log=False)
            lost_s = most_growth(self._stolen_s(), before)
            failed = [report.longreprtext[-200:] for report in reports if report.failed]
            if not failed or lost_s < STOLEN_S or not left:
                break
            why += f"{1e3 * lost_s:.0f} ms stolen; {failed[0]} "
            item._initrequest()  # type: ignore[attr-defined]  # as pytest does before the first time: fixtures are made anew
        for report in reports:
            report.user_properties.append((TOLD_AS, why))
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        why = dict(report.user_properties).get(TOLD_AS)
        if why and report.when == "call":
            self._told.append(f"{report.nodeid}: {why}")

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        for line in self._told:
            terminalreporter.line(f"{TOLD_AS}, for this machine's host had taken a processor: {line}")
