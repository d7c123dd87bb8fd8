"""A load cell that is asked misses what it did not answer in a self-test, not what nobody had asked for."""

from dataclasses import replace

import pytest

from gateway.control.self_test.items import Finding, Item
from gateway.control.settings import SelfTestSettings
from gateway.devices import DeviceProfile, DeviceRole
from gateway.registers.words import ControlBit, SelfTestResult, SelfTestVerdict
from tests.service.every_device.test_every_device_presses import PROFILES, rig_with
from tests.service.wired import Wired

ASKED = [name for name, profile in PROFILES.items() if profile.role is DeviceRole.LOAD_CELL and not profile.stream]


def found_on_the_line(profile: DeviceProfile, silent_ms: int) -> Finding:
    """What a self-test without a force finds. silent_ms: of each 100, in which the cell's answers are lost."""
    rig = rig_with(profile)
    wired = Wired(replace(rig, control=replace(rig.control, self_test=SelfTestSettings(force_n=0.0))))
    wired.until(lambda: bool(wired.word("status_word") & 2), 3.0)
    wired.write(0, int(ControlBit.START_SELF_TEST))
    for step, _ in enumerate(wired.samples(4.0)):
        wired.is_cell_plugged = step % 100 >= silent_ms
    report = wired.controller.active_run.self_test
    assert report.result is not SelfTestResult.RUNNING
    return next(one for one in report.findings if one.item is Item.CELL_LINE)


@pytest.mark.parametrize("name", ASKED)
def test_a_cell_that_answers_each_question_misses_nothing(name: str) -> None:
    """Where a question went out a tick later the reading before was told to be missing: 70 of 1000 of a healthy cell."""
    found = found_on_the_line(PROFILES[name], 0)
    assert found.verdict is SelfTestVerdict.PASSED, found.text
    assert " 0 missing, 0 unreadable" in found.text


@pytest.mark.parametrize("name", ["hbm-aed", "laumas-tlb", "mantracourt-dsc"])
def test_one_that_leaves_questions_unanswered_is_found(name: str) -> None:
    found = found_on_the_line(PROFILES[name], 30)
    assert found.verdict is SelfTestVerdict.FAILED, found.text
    assert " 0 missing" not in found.text
