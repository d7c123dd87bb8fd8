"""A loop from which a host or a quota withheld the processor says so, in its fault and in its warning."""

from functools import partial
from types import SimpleNamespace
from typing import cast

import pytest

from gateway.codes.faults import FaultCode
from gateway.processes.scheduling.withheld_time import WithheldTime
from gateway.service.running_rig.control_loop import LoopProcess
from gateway.service.running_rig.lateness import Lateness
from tests.service import wired as harness
from tests.service.wired import Wired

WITHHELD = 0.3, "a quota did it"


@pytest.fixture
def noted(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """When the loop has noted that it runs; whenever it asks, 300 ms were withheld."""
    times_s: list[float] = []
    kernel = SimpleNamespace(note=times_s.append, lately=lambda: WITHHELD)
    lateness = Lateness(0.01, cast(WithheldTime, kernel))
    monkeypatch.setattr(harness, "LoopProcess", partial(LoopProcess, lateness=lateness))
    return times_s


def test_the_fault_of_a_loop_that_was_held_names_who_held_it(noted: list[float]) -> None:
    wired = Wired().pressing(20.0)
    assert noted[-1] == pytest.approx(wired.now_s, abs=0.011), "at each tick"
    wired.now_s += wired.rig.control.supervision.stall_s + 0.02
    wired.loop.refresh()
    assert wired.fault_code is FaultCode.MACHINE_BUSY
    assert any("a quota did it" in sentence for sentence in wired.said("A403"))


def test_a_slow_loop_names_it_too(noted: list[float]) -> None:
    wired = Wired().ready()
    wired.lateness = lambda tick: (1, 0.012 if tick % 20 == 0 else 0.0)
    wired.run(4.0)
    (sentence,) = wired.said("A342")
    assert noted and "a quota did it" in sentence
