"""What is told once in an enable is told again in the next one, of what has lasted without a break, by the sign of the cell."""

from types import SimpleNamespace
from typing import Any

import pytest

from gateway.control.inputs import LineStatus, LoopInputs
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.one_shot_events import OneShotEvents

STEP_S = 0.1


def told(events: OneShotEvents, at_limit: list[bool], from_s: float = 0.0) -> list[float]:
    """When a trim at its limit is told of, in a force that is held, one step after the other."""
    loop: Any = SimpleNamespace(settling=SimpleNamespace(holds_force=True), voltage_v=3.0, trim_v=0.6)
    found = []
    for k, loop.is_trim_at_limit in enumerate(at_limit):
        now_s = from_s + STEP_S * k
        inputs = LoopInputs(now_s, STEP_S, Reading(contact_n=20.0), True, 18.0)
        if events.saturated_event(loop, 20.0, inputs):
            found.append(round(now_s, 1))
    return found


def test_a_trim_at_its_limit_is_told_once_in_each_enable() -> None:
    """In the next one the rig is as wrong as before, and another person may look at the log."""
    events = OneShotEvents(5.0)
    assert told(events, [True] * 100) == [3.0]
    events.start()
    assert told(events, [True] * 100, 10.0) == [10.0]


def test_a_trim_that_leaves_its_limit_has_not_stood_there() -> None:
    """It came back by itself: two times of two seconds are no three."""
    assert told(OneShotEvents(5.0), [True] * 20 + [False] + [True] * 20) == []


def test_a_force_that_is_stuck_while_the_tool_pulls_has_the_sign_that_the_cell_shows() -> None:
    events = OneShotEvents(5.0)
    events.direction = -1.0
    assert "-7.0 N" in events.stuck_event(True, Reading(contact_n=7.0))
    assert events.stuck_event(True, Reading(contact_n=7.0)) == ""
    assert events.stuck_event(False, Reading(contact_n=0.0)) == ""
    events.direction = 1.0
    assert " 7.0 N" in events.stuck_event(True, Reading(contact_n=7.0))


@pytest.mark.parametrize("voltage_v", [0.0, 0.05])
def test_a_force_that_is_held_at_hardly_a_volt_teaches_no_pressure_per_volt(voltage_v: float) -> None:
    """Friction may hold one there: what a sensor says of no pressure would call air missing at each later force."""
    events, line = OneShotEvents(5.0), LineStatus(pressure_pa=5e3, pressure_pa_per_v=2e4)
    events.observe_line(line)
    loop: Any = SimpleNamespace(settling=SimpleNamespace(holds_force=True), voltage_v=voltage_v, unreachable=False)
    assert events.unreachable_event(loop, 3.0, LoopInputs(0.0, STEP_S, Reading(contact_n=3.0), True, 3.0)) == ""
    events.observe_line(line._replace(pressure_pa=8e4))
    assert not events.lacks_air(4.0)
    events.observe_line(line)
    assert events.lacks_air(4.0)
