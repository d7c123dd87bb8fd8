"""A machine whose response is known to be slow is waited for: before its force at rest is judged, and behind each step."""

from dataclasses import replace

import pytest

from gateway.control.self_test.items import Item
from gateway.control.settings import SelfTestSettings
from gateway.registers.words import ControlBit, SelfTestVerdict, State
from tests.control.bench import Bench
from tests.control.runs.test_ladder_run import roomy

LONGEST_S = 20.0
"""What a robot waits for the verdict, at most."""


def verdicts_behind_a_force(lag_s: float) -> dict[Item, SelfTestVerdict]:
    """The verdicts of a self-test that is asked for right behind 40 N."""
    control = roomy()
    slow = replace(control.supervision, response_lag_s=lag_s)
    bench = Bench(replace(control, supervision=slow, self_test=SelfTestSettings(force_n=15.0)), seed=3, lag_s=lag_s)
    bench.run(0.5)
    bench.enable(40.0)
    bench.run(8.0 * lag_s)
    bench.disable()
    bench.run(0.05)
    begun = bench.write(control_word=ControlBit.START_SELF_TEST)
    assert "self-test begun by 10.0.0.5" in begun.events
    assert bench.last.state is State.CALIBRATING
    bench.seconds_until(lambda output: output.state is State.OFF, LONGEST_S)
    return {each.item: each.verdict for each in bench.controller.active_run.self_test.findings}


@pytest.mark.parametrize("lag_s", [0.4, 0.7])
def test_right_behind_a_force_a_slow_machine_passes(lag_s: float) -> None:
    """What was left of 40 N was a zero that is off, with the advice to tare; and three seconds behind a step it still rose."""
    found = verdicts_behind_a_force(lag_s)
    judged = (Item.ZERO, Item.SIGN, Item.SCALE, Item.RESPONSE, Item.LEAK)
    assert {item: found[item] for item in judged} == dict.fromkeys(judged, SelfTestVerdict.PASSED)


def test_however_slow_a_machine_is_a_robot_has_its_verdict_in_time() -> None:
    assert verdicts_behind_a_force(1.5)[Item.ZERO] is SelfTestVerdict.FAILED, "of 40 N some is left"
