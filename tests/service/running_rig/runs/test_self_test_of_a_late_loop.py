"""A loop that comes late has the readings that waited for it at once: the cell's line has lost none of them."""

import pytest

from gateway.control.self_test.items import Item
from gateway.registers.words import ControlBit, SelfTestVerdict, State
from tests.service.wired import Wired


@pytest.mark.parametrize(("is_plugged", "verdict"), [(True, SelfTestVerdict.PASSED), (False, SelfTestVerdict.FAILED)])
def test_readings_that_waited_for_the_loop_are_not_missing(is_plugged: bool, verdict: SelfTestVerdict) -> None:
    """`252 missing`, with a cable to be looked at, of a cell of which each reading had come."""
    wired = Wired().ready()
    wired.write(0, int(ControlBit.START_SELF_TEST))
    wired.run(0.1)
    while wired.state is State.CALIBRATING:
        wired.run(0.35)
        wired.is_cell_plugged = is_plugged
        wired.stall(0.12)
        wired.is_cell_plugged = True
    report = wired.controller.active_run.self_test
    (line,) = (found for found in report.findings if found.item is Item.CELL_LINE)
    assert line.verdict is verdict, line.text
    assert (" 0 missing" in line.text) is is_plugged
