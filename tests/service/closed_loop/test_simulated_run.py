"""One run against the twin, with the controller or the loop played: what counts of it, and what is said to whom when."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import NO_COMPENSATION, ControlSettings
from gateway.control.settings import ValveControl
from gateway.defaults import TICK_S
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, State
from gateway.service.closed_loop import simulated_run
from gateway.service.closed_loop.schedule import LARGEST_N, SETTLED_S, SetpointSegment, draw_schedule
from gateway.service.closed_loop.simulated_run import ControlSetup, SimulatedLoop, simulate_run
from gateway.twin.surroundings import Surroundings
from tests.service.rigs import demo, with_supervision

HOLD_S = 1.0


def test_what_counts_is_a_wished_force_once_it_should_have_come_and_steps_alone_settle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The quiet before the first wish is no part of it, nor is a wish for nothing."""
    asked = list[tuple[float, float]]()

    class Loop:
        fault = "stale"

        def __init__(self, *_: object) -> None: ...

        def tick(self, time_s: float, force_n: float, _schedule: object) -> float:
            asked.append((time_s, force_n))
            return force_n + (-2.0 if time_s < 3.25 else 0.5)

    monkeypatch.setattr(simulated_run, "SimulatedLoop", Loop)
    wishes = (
        SetpointSegment(1.0, HOLD_S, 0.0, 0.0),
        SetpointSegment(2.0, HOLD_S, 10.0, 14.0),
        SetpointSegment(3.0, HOLD_S, 20.0, 20.0),
    )
    schedule: Any = SimpleNamespace(wishes=wishes)
    run = simulate_run(None, None, schedule, 0, frozenset())  # type: ignore[arg-type]
    ticks, settled = round(HOLD_S / TICK_S), round(SETTLED_S / TICK_S)
    assert len(asked) == 4 * ticks and asked[0] == (0.0, 0.0)
    assert asked[-1] == (pytest.approx(4.0 - TICK_S), 20.0)
    assert run.error_n.tolist() == pytest.approx([-2.0] * (ticks - settled) + [0.5] * (ticks - settled))
    assert run.settled_s == (pytest.approx(0.25, abs=1.5 * TICK_S),) and run.fault == "stale"


class Plant:
    """A twin whose force is its time."""

    def __init__(self) -> None:
        self.force_n, self.told = 0.0, list[object]()

    def advance(self, by_s: float) -> None:
        self.force_n += by_s

    def read(self) -> float:
        return 100.0 + self.force_n

    def command(self, voltage_v: float) -> None:
        self.told.append(voltage_v)

    def set_surroundings(self, around: Surroundings) -> None:
        self.told.append(around)


def loop_of(inputs: frozenset[str] = frozenset()) -> Any:
    """A loop whose controller answers as it is told to, and notes what it hears."""
    loop: Any = SimulatedLoop.__new__(SimulatedLoop)
    loop._twin, loop._inputs, loop.fault, loop._voltage_v = Plant(), inputs, "", 0.0
    loop._command, loop._sample, loop._line, loop.heard = Command(), None, None, []
    loop.answer = SimpleNamespace(voltage_v=1.5, fault=FaultCode.NONE)

    def step(now_s: float, command: Command, sample: Any, _line: Any) -> Any:
        loop.heard.append((now_s, command, sample))
        return loop.answer

    loop._controller = SimpleNamespace(step=step, state=State.HOLDING)
    return loop


def test_a_sample_comes_half_a_tick_behind_the_write_and_the_force_is_that_of_the_end() -> None:
    loop, schedule = loop_of(), SimpleNamespace(columns=())
    assert loop.tick(2.0, 12.0, schedule) == pytest.approx(TICK_S)
    (written_s, command, _), (stepped_s, _, sample) = loop.heard
    assert (written_s, stepped_s) == (2.0, pytest.approx(2.0 + 0.5 * TICK_S))
    assert sample.time_s == stepped_s and sample.force_n == pytest.approx(100.0 + 0.5 * TICK_S)
    assert command.force_setpoint_n == 12.0 and loop._twin.told == [1.5], "a voltage that stands is not told again"


def test_around_the_tool_only_moves_what_the_schedule_moves() -> None:
    around, loop = Surroundings(tilt_deg=90.0), loop_of(frozenset({"tilt_deg"}))
    loop.tick(2.0, 12.0, SimpleNamespace(columns=("tilt_deg",), around=lambda time_s: around))
    assert around in loop._twin.told and loop.heard[0][1].tilt_angle_rad == pytest.approx(1.5708, abs=1e-4)


def test_a_master_writes_what_has_changed_and_wants_nothing_behind_a_fault() -> None:
    loop = loop_of()
    numbers = []
    for time_s, force_n in ((0.0, 12.0), (0.1, 12.0), (0.2, 12.0), (0.3, 13.0)):
        loop._write(time_s, force_n, 0.0)
        numbers.append(loop._command.number)
        wanted = (ControlBit.ENABLE, force_n) if time_s else (ControlBit(0), 0.0)
        assert (loop._command.control_word, loop._command.force_setpoint_n) == wanted
    assert numbers == [0, 1, 1, 2]
    loop._controller.state = State.FAULT
    loop._write(0.4, 13.0, 0.0)
    assert (loop._command.control_word, loop._command.force_setpoint_n) == (ControlBit(0), 0.0)


@pytest.mark.parametrize(
    "settings",
    [with_supervision(demo(), lease_s=0.2).control, replace(demo().control, valve=ValveControl())],
    ids=["lease", "valve"],
)
def test_a_rig_with_a_lease_or_a_valve_presses_as_one_without(settings: ControlSettings) -> None:
    """Nobody beat and nobody read the valve back: the force was off by all of the setpoint, before and after."""
    schedule: Any = SimpleNamespace(wishes=(SetpointSegment(0.5, 1.5, 10.0, 10.0),), columns=())
    rig = demo()
    assert rig.plant
    run, plain = (
        simulate_run(ControlSetup(one, rig.calibration.model(), NO_COMPENSATION), rig.plant, schedule, 1, frozenset())
        for one in (settings, rig.control)
    )
    assert run.fault == "" and run.rms_n == plain.rms_n < 0.5


@pytest.mark.parametrize(("force_max_n", "largest_n"), [(20.0, 20.0), (60.0, LARGEST_N)])
def test_a_small_rig_is_asked_for_no_more_than_it_allows(force_max_n: float, largest_n: float) -> None:
    plant = demo().plant
    assert plant
    wishes = draw_schedule(plant, plant, 0, force_max_n).wishes
    assert max(end_n for wish in wishes for end_n in (wish.from_n, wish.to_n)) == pytest.approx(largest_n)
