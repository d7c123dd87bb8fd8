"""When the valve may move, and what turns with it, its parts played: no air that was put out, or may stand, is forgotten."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.bsfm import Bsfm
from gateway.control import CalibrationInUse, LineStatus
from gateway.control.command_edges import CommandTracker
from gateway.control.inputs import ValveStatus
from gateway.control.sample_conditioning import SampleConditioner
from gateway.control.settings import ValveControl
from gateway.control.valve.turning import Turning
from gateway.control.valve.valve_switch import ValveSwitch
from gateway.devices.valve_profile import ValveDirection
from gateway.registers.command import Command
from tests.control.bench import bsfm, settings
from tests.control.valve.valve_bench import BIT_4

PUSH, PULL = ValveDirection
TICK_S, LAG_S = 0.01, 0.12


class Stand:
    """A pull is asked for from the beginning. did: what the parts were told."""

    def __init__(self, model: Bsfm | None = None) -> None:
        rig = replace(settings(response_lag_s=LAG_S), valve=ValveControl(pull_area_share=0.75, dwell_s=0.0))
        self.commands = CommandTracker(rig)
        self.commands.take(0.0, Command(control_word=BIT_4, number=1))
        self.switch, self.did, self.now_s = ValveSwitch(rig.valve), [], 0.0  # type: ignore[arg-type]
        note = self.did.append
        self.loop = SimpleNamespace(voltage_v=0.0, branch_share=-1.0, rest=lambda: note("loop rests"))
        faults = SimpleNamespace(
            measured_n=1.5,
            shift_zero=lambda n: note(f"shifted {n}"),
            start=lambda: note("faults start"),
            start_rise=lambda: note("the rise starts"),
        )
        parts = SimpleNamespace(loop=self.loop, faults=faults, one_shot=SimpleNamespace())
        self.machine: Any = SimpleNamespace(parts=parts, is_enabled=False, tell=note)
        conditioner = SampleConditioner(rig.supervision)
        self.turning = Turning(self.switch, self.commands, conditioner, rig, model or bsfm())

    def run(self, seconds: float, standing_v: float | None, stands: ValveDirection = PUSH) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.now_s += TICK_S
            self.turning.follow(self.now_s, LineStatus(standing_v=standing_v, valve=ValveStatus(stands)), self.machine)

    def waits_s(self, standing_v: float | None = 0.0, limit_s: float = 5.0) -> float:
        """Until the valve is told."""
        began_s = self.now_s
        while self.switch.commanded is not PULL and self.now_s - began_s < limit_s:
            self.run(TICK_S, standing_v)
        return self.now_s - began_s


@pytest.mark.parametrize(
    ("standing_v", "out_v", "moves"),
    [(0.0, 0.0, True), (0.04, 0.0, True), (0.06, 0.0, False), (None, 0.0, False), (0.0, 0.1, False)],
)
def test_it_moves_only_where_no_voltage_is_asked_for_and_none_stands(
    standing_v: float | None, out_v: float, moves: bool
) -> None:
    stand = Stand(bsfm(0.1))  # so weak that its pressure never counts: the voltages alone do
    stand.loop.voltage_v = out_v
    assert (stand.waits_s(standing_v, 3.0) < 2.9) is moves


def test_a_plant_that_is_slower_or_stronger_than_the_first_calibration_said_is_waited_for_longer() -> None:
    usual_s = Stand().waits_s()
    slower, stronger = Stand(), Stand()
    slower.turning.use(bsfm(), settings(response_lag_s=2.0 * LAG_S))
    stronger.turning.use(bsfm(2.0), settings(response_lag_s=LAG_S))
    assert slower.waits_s() == pytest.approx(2.0 * usual_s, rel=0.1)
    assert stronger.waits_s() > usual_s + 3.0 * TICK_S


def test_what_was_asked_for_while_nobody_knew_what_stands_may_stand() -> None:
    stand = Stand()
    stand.commands.take(0.0, Command(number=2))
    stand.run(2.0, 0.0)
    stand.loop.voltage_v = 4.0
    stand.run(1.0, None)
    stand.loop.voltage_v = 0.0
    stand.commands.take(0.0, Command(control_word=BIT_4, number=3))
    assert stand.waits_s() > 3.0 * LAG_S


def test_with_the_readback_everything_turns_once() -> None:
    stand = Stand()
    stand.waits_s()
    assert not stand.did
    stand.run(3 * TICK_S, 0.0, PULL)
    assert stand.did == ["shifted 3.0", "faults start", "loop rests", "the valve pulls"]
    assert stand.machine.parts.faults.direction == stand.machine.parts.one_shot.direction == -1.0


def test_behind_a_switch_that_turned_nothing_the_rise_is_judged_from_there() -> None:
    """Behind a restart the valve may still pull while control begins to push: what has gone by then has not risen."""
    stand = Stand()
    stand.commands.take(0.0, Command(number=2))
    stand.run(1.0, 0.0, PULL)
    assert stand.switch.is_switching and not stand.did
    stand.run(1.0, 0.0, PUSH)
    assert stand.did == ["the rise starts"]


@pytest.mark.parametrize(("limit_n", "most_n"), [(20.0, 20.0), (100.0, 42.75)])
def test_no_more_is_pulled_than_the_model_reaches_and_its_limits_allow(limit_n: float, most_n: float) -> None:
    pull = replace(Stand().turning.model_of_pull(CalibrationInUse(bsfm(), 1)), limits_n=(0.0, limit_n))
    calibration = CalibrationInUse(bsfm(), 1, pull_model=pull)
    assert Stand().turning.most_pull_n(calibration) == pytest.approx(most_n)
