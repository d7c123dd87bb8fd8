"""The command block from write to write: what rises, what stops, and what of it acts again."""

from dataclasses import replace

import pytest

from gateway.control.command_edges import NO_EDGES, CommandTracker
from gateway.control.settings import Defaults
from gateway.registers.command import Command
from gateway.registers.words import ControlBit
from gateway.units import STANDARD_GRAVITY_M_PER_S2
from tests.control.bench import Bench, bsfm, enabled, settings

NONE, ENABLE, TARE, RUN = ControlBit(0), ControlBit.ENABLE, ControlBit.TARE, ControlBit.START_CALIBRATION


def tracker(word: ControlBit = NONE) -> CommandTracker:
    commands = CommandTracker(settings(lease_s=1.0))
    commands.take(0.0, Command(control_word=word, number=1))
    return commands


@pytest.mark.parametrize(("word", "stops"), [(NONE, True), (ENABLE, False), (RUN, False), (ENABLE | RUN, False)])
def test_an_enable_that_falls_stops_unless_a_run_takes_its_place(word: ControlBit, stops: bool) -> None:
    assert tracker(ENABLE).edges_of(Command(control_word=word, number=2)).stops is stops
    assert not tracker().edges_of(Command(control_word=word, number=2)).stops, "nothing was on"


def test_behind_a_stop_no_bit_stands_and_each_that_is_written_rises_anew() -> None:
    commands = tracker(ENABLE)
    edges = commands.take(1.0, Command(control_word=ENABLE, number=2, stops=True))
    assert edges.stops and not edges.rises
    assert commands.take(2.0, Command(control_word=ENABLE, number=3)).rises == ENABLE


def test_a_momentary_bit_acts_with_each_write_and_with_none_of_the_bank_s_own() -> None:
    commands = tracker(TARE)
    assert commands.edges_of(Command(control_word=TARE, number=1)).rises == 0
    assert commands.edges_of(Command(control_word=TARE, number=2)).rises == TARE


def test_the_same_command_has_no_edges_and_is_no_beat() -> None:
    commands = tracker()
    command = Command(control_word=ENABLE, heartbeat=5, number=2)
    assert commands.take(1.0, command).rises == ENABLE
    assert commands.take(2.0, command) == NO_EDGES and commands.lease_age_s(2.0) == 1.0


@pytest.mark.parametrize("heartbeat", [0, 4])
def test_what_a_master_writes_behind_the_bank_s_clearing_is_its_own_beat(heartbeat: int) -> None:
    """Each second value of one that only toggles was none, where another one stopped it in each of its cycles."""
    commands = tracker()
    commands.take(1.0, Command(heartbeat=3, number=2))
    commands.expect_clearing()
    commands.take(1.5, Command(heartbeat=3, number=2))
    assert commands.lease_age_s(2.0) == 1.0, "the bank's own command is none"
    commands.take(2.0, Command(heartbeat=heartbeat, number=3))
    assert commands.lease_age_s(2.5) == 0.5


@pytest.mark.parametrize("manner", ["repeats", "has_waited"])
def test_a_heartbeat_that_comes_again_or_has_waited_renews_no_lease_and_the_next_one_does(manner: str) -> None:
    commands = tracker()
    commands.take(2.0, Command(heartbeat=5, number=2))
    commands.take(2.4, Command(heartbeat=6, number=3)._replace(**{manner: True}))
    assert commands.lease_age_s(2.5) == 0.5
    commands.take(2.6, Command(heartbeat=6, number=4))
    assert commands.lease_age_s(2.7) == pytest.approx(0.7), "it is known"
    commands.take(2.8, Command(heartbeat=7, number=5))
    assert commands.lease_age_s(2.9) == pytest.approx(0.1)


def test_limits_of_a_calibration_end_with_it() -> None:
    """A smaller one before leaves no trace."""
    commands = CommandTracker(settings())
    commands.take(0.0, Command(force_setpoint_n=30.0, number=1))
    for limits_n, force_n in (((0.0, 20.0), 20.0), ((0.0, 40.0), 30.0), (None, 30.0)):
        commands.use(replace(bsfm(), limits_n=limits_n))
        assert commands.demand.force_n == force_n


def test_who_commands_is_the_peer_where_one_is_known() -> None:
    commands = tracker()
    assert commands.who == "a command"
    commands.take(1.0, Command(number=2, peer="10.0.0.5"))
    assert commands.who == "10.0.0.5"


@pytest.mark.parametrize(("before_kg", "after_kg"), [(1.0, 0.0), (0.0, 1.0), (3.0, 0.2)])
def test_a_payload_that_is_changed_under_a_force_takes_the_slide_along_the_ramp(
    before_kg: float, after_kg: float
) -> None:
    """28 N more were pressed within a tenth of a second, by a register that says nothing of a force."""
    bench = enabled()
    bench.write(force_setpoint_n=30.0, payload_kg=before_kg, force_ramp_n_per_s=10.0)
    bench.run(5.0)
    assert bench.last.force_applied_n == 30.0
    changed_n = STANDARD_GRAVITY_M_PER_S2 * (before_kg - after_kg)
    from_n = bench.plant.force_n
    bench.write(payload_kg=after_kg)
    bench.run(0.5)
    assert 1.0 < abs(bench.plant.force_n - from_n) < 6.0, "of 5 N by the ramp"
    bench.run(3.5)
    assert bench.plant.force_n - from_n == pytest.approx(changed_n, abs=0.5)
    assert bench.last.force_measured_n == pytest.approx(30.0, abs=0.5)


def test_a_payload_is_in_use_at_once_while_nothing_is_pressed_and_with_what_begins_the_force() -> None:
    bench = Bench()
    bench.run(0.3)
    bench.write(payload_kg=2.0)
    assert bench.last.force_measured_n == pytest.approx(2.0 * STANDARD_GRAVITY_M_PER_S2, abs=0.5)
    bench.enable(30.0, payload_kg=1.0)
    assert bench.last.force_measured_n == pytest.approx(STANDARD_GRAVITY_M_PER_S2, abs=0.5)


def test_a_payload_on_its_way_arrives_at_once_where_the_force_ends() -> None:
    bench = enabled()
    bench.write(force_setpoint_n=30.0, payload_kg=2.0, force_ramp_n_per_s=5.0)
    bench.run(6.0)
    bench.write(payload_kg=0.0)
    bench.run(0.5)
    bench.disable()
    bench.step()
    assert bench.controller._commands.gravity_n == 0.0


def test_under_a_force_a_payload_that_is_no_longer_told_goes_down_to_the_rig_s_own_and_not_below() -> None:
    commands = CommandTracker(replace(settings(), defaults=Defaults(payload_kg=1.0)), lambda: 30.0)
    commands.take(0.0, Command(payload_kg=2.0, number=1))
    told = Command(number=2, force_ramp_n_per_s=5.0)
    commands.take(10.0, Command(payload_kg=2.0, number=1))
    weights_n = []
    for k in range(60):
        commands.take(10.0 + 0.05 * k, told)
        weights_n.append(commands.gravity_n)
    assert min(weights_n) == weights_n[-1] == pytest.approx(STANDARD_GRAVITY_M_PER_S2)
