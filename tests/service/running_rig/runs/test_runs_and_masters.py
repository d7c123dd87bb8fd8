"""A run on the output, and masters around it: how it ends, who may end it, what it never does, and who owns what afterwards."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from struct import unpack

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control import LeaseAction
from gateway.control.runs.experiment_plan import ExperimentPlan, Move, MoveKind, Part
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.registers.refusal import Refusal
from gateway.registers.words import CalibrationPhase, State
from tests.control.bench import settings
from tests.service.running_rig.simulated_rig import (
    CALIBRATE,
    ENABLE,
    OTHER,
    OWNER,
    SmallRig,
    with_limits,
)

LEASE_S = 0.35
RAMP_N_PER_S = 40.0
SHORT = CalibrationPlan(step_v=0.5, groups=1, minor_points=12)


def leased() -> SmallRig:
    return SmallRig(settings(lease_s=LEASE_S))


def with_ramp(force_ramp_n_per_s: float = RAMP_N_PER_S) -> SmallRig:
    control = settings()
    return SmallRig(replace(control, defaults=replace(control.defaults, force_ramp_n_per_s=force_ramp_n_per_s)))


def locally(rig: SmallRig, plan: CalibrationPlan | ExperimentPlan = SHORT) -> SmallRig:
    rig.controller.active_run.ask(plan)
    return rig.until(State.CALIBRATING)


# -- how a run ends

CLEARS: dict[str, Callable[[SmallRig], None]] = {
    "FC05": lambda rig: rig.bank.write_bits(5, [False], OWNER),
    "FC06": lambda rig: rig.write(0, 0),
    "FC15": lambda rig: rig.bank.write_bits(0, [False] * 8, OWNER),
    "FC16": lambda rig: rig.write(0, *rig.block(0, beat=99)),
    "FC22": lambda rig: rig.bank.mask_write(0, 0xFFDF, 0, OWNER),
    "float ABCD": lambda rig: rig.bank.write_registers(200, bytes(4), OWNER),
    "float CDAB": lambda rig: rig.bank.write_registers(300, bytes(4), OWNER),
    "another master": lambda rig: rig.write(0, 0, peer=OTHER),
}


@pytest.mark.sampled
@pytest.mark.parametrize("way", CLEARS)
def test_clearing_bit_5_takes_the_force_to_0_along_the_ramp(way: str) -> None:
    rig = with_ramp().calibrating()
    begun_n, began = rig.plant.force_n, len(rig.trace)
    assert begun_n > 8.0
    CLEARS[way](rig)
    assert rig.state is State.CALIBRATING
    rig.until(State.OFF, 2.0)
    volts = [voltage_v for _, voltage_v, _ in rig.trace[began:]]
    assert len(volts) * 0.01 >= 0.5 * begun_n / RAMP_N_PER_S
    assert all(after <= before for before, after in pairwise(volts))
    assert max(before - after for before, after in pairwise(volts)) < 0.4
    assert (rig.wire.voltage_v, rig.word("calibration_phase")) == (0.0, CalibrationPhase.STOPPED)
    assert (rig.word("control_word"), rig.bank.owner) == (0, None)


@pytest.mark.parametrize("peer", [OWNER, OTHER])
def test_clearing_enable_is_the_safe_voltage_in_the_write_itself(peer) -> None:
    rig = SmallRig().calibrating(ENABLE | CALIBRATE)
    rig.write(0, 0, peer=peer)
    assert (rig.wire.voltage_v, rig.state) == (0.0, State.OFF)


def test_clearing_bit_5_alone_of_an_enabled_run_ends_in_off_and_not_in_ready() -> None:
    rig = with_ramp().calibrating(ENABLE | CALIBRATE)
    rig.write(0, ENABLE)
    assert rig.wire.voltage_v > 0.5
    rig.until(State.OFF, 2.0)
    assert rig.word("control_word") == 0


def test_who_ends_the_run_of_another_master_does_not_own_it() -> None:
    rig = with_ramp().calibrating(ENABLE | CALIBRATE)
    rig.write(0, ENABLE, peer=OTHER)
    assert rig.state is State.CALIBRATING
    assert rig.bank.owner == OWNER.host
    rig.until(State.OFF, 2.0)
    assert rig.bank.owner is None


def test_another_masters_enable_during_a_run_is_refused_and_no_end_of_it() -> None:
    rig = with_ramp().calibrating()
    with pytest.raises(Refusal) as refused:
        rig.write(0, ENABLE, 900, peer=OTHER)
    assert refused.value.reason is RefusalReason.NOT_OWNER
    assert rig.state is State.CALIBRATING and rig.bank.owner == OWNER.host


def test_a_run_of_this_machine_is_stopped_by_0_in_the_control_word_alone_and_not_by_a_cyclic_block() -> None:
    rig = locally(SmallRig()).run(2.0)
    for beat in range(5):
        rig.write(0, *rig.block(0, beat=beat))
        rig.run(0.1)
    rig.bank.write_bits(2, [False], OTHER)
    assert rig.state is State.CALIBRATING
    rig.write(0, 0, peer=OTHER)
    assert (rig.wire.voltage_v, rig.state) == (0.0, State.OFF)


def test_a_run_of_this_machine_needs_no_heartbeat_on_its_way_to_0() -> None:
    control = settings(lease_s=LEASE_S)
    rig = SmallRig(replace(control, defaults=replace(control.defaults, force_ramp_n_per_s=10.0)))
    locally(rig).run(3.0).controller.active_run.ask_stop("calibration stopped at this machine")
    rig.until(State.OFF, 6.0)
    assert rig.state is State.OFF


@pytest.mark.parametrize("action", [LeaseAction.HOLD, LeaseAction.RAMP])
def test_the_leases_end_ends_a_run_of_the_masters_along_the_ramp(action: LeaseAction) -> None:
    rig = SmallRig(settings(lease_s=LEASE_S, lease_action=action)).calibrating()
    rig.beats = False
    rig.until(State.OFF, 2.0)
    assert rig.word("calibration_phase") == CalibrationPhase.STOPPED


def test_a_run_that_cannot_begin_any_more_when_its_turn_comes_leaves_the_force() -> None:
    rig = SmallRig()
    rig.controller.active_run.ask(SHORT)
    rig.controller.active_run._asked, asked = None, rig.controller.active_run._asked
    rig.holding()
    rig.controller.active_run._asked = asked
    rig.run(2.0)
    assert rig.state is State.HOLDING
    assert rig.controller.active_run.take_refused().startswith("W305 calibration refused: state HOLDING")


def test_a_master_that_holds_bit_5_in_its_cycle_does_not_begin_again() -> None:
    rig = SmallRig().calibrating()
    rig.write(0, *rig.block(CALIBRATE, beat=1))
    rig.write(0, 0, peer=OTHER)
    rig.until(State.OFF)
    held = rig.answer(0, *rig.block(CALIBRATE, beat=2))
    assert held is not None
    assert (held.code, held.reason) == (4, RefusalReason.CALIBRATION_HELD)
    rig.write(0, *rig.block(0, beat=3))
    rig.write(0, *rig.block(CALIBRATE, beat=4))
    assert rig.state is State.CALIBRATING


def test_one_write_begins_a_run_again_and_again() -> None:
    rig = SmallRig()
    for _ in range(2):
        rig.calibrating()
        rig.controller.active_run.ask_stop("calibration stopped at this machine")
        rig.until(State.OFF)
        assert rig.word("calibration_phase") == CalibrationPhase.STOPPED


def test_a_run_shows_what_it_does_and_how_long_it_still_takes() -> None:
    rig = SmallRig().calibrating()
    assert rig.word("status_word") & 3 == 1, "enabled, and not ready for commands"
    assert rig.word("force_accepted") > 0
    left_s = rig.word("calibration_time_left")
    rig.run(20.0)
    assert 0 < rig.word("calibration_time_left") < left_s
    rig.write(0, 0)
    rig.until(State.OFF)
    assert rig.word("calibration_time_left") == rig.word("force_accepted") == 0


def test_a_run_that_takes_the_zero_first_does_not_begin_where_no_tare_would() -> None:
    rig = SmallRig().holding(40.0)
    rig.write(0, 0)
    rig.run(0.15)
    assert rig.controller.refusal_of_run(rig.now(), SHORT) == ""
    assert "still on their way to 0" in rig.controller.refusal_of_run(rig.now(), replace(SHORT, tare=True))


def test_a_run_that_takes_enables_place_ends_with_its_bit_all_the_same() -> None:
    rig = SmallRig()
    rig.write(0, ENABLE)
    rig.until(State.READY)
    rig.write(0, CALIBRATE)
    rig.until(State.CALIBRATING).run(1.0)
    rig.write(0, *rig.block(CALIBRATE, beat=9))
    assert rig.state is State.CALIBRATING, "a master that writes in cycles"
    rig.write(0, 0)
    rig.until(State.OFF, 2.0)
    assert rig.word("calibration_phase") == CalibrationPhase.STOPPED


def test_no_run_begins_where_the_tool_waits_for_contact_with_a_force() -> None:
    rig = SmallRig(contact=False)
    rig.write(0, ENABLE, 1200)
    rig.until(State.READY).run(0.5)
    assert rig.wire.voltage_v > 0.0
    assert "READY with" in rig.controller.refusal_of_run(rig.now(), SHORT)


# -- the rig's largest force


@pytest.mark.sampled
@pytest.mark.parametrize("gain_n_per_v", [6.0, 7.4, 9.0, 13.0])
def test_a_ladder_never_measures_more_than_the_rig_allows_and_goes_on_below(gain_n_per_v: float) -> None:
    rig = SmallRig(with_limits(settings(), force_max_n=40.0), gain_n_per_v=gain_n_per_v)
    locally(rig)
    measured_n = []
    while rig.controller.active_run.running:
        rig.run(0.01)
        measured_n.append(unpack(">h", rig.bank.read_registers(102, 1))[0] / 100.0)
    assert max(measured_n) <= 40.0
    assert max(measured_n) >= 31.0
    assert rig.word("calibration_phase") == CalibrationPhase.FITTING
    said = [sentence for sentence in rig.log if sentence.startswith("A350")]
    assert bool(said) is (gain_n_per_v > 7.0), "beyond the calibration in use"
    assert rig.word("fault_code") == FaultCode.NONE


@pytest.mark.parametrize("check", [True, False])
def test_an_experiment_ends_where_it_would_pass_the_rigs_force(check: bool) -> None:
    climbs = Move(do=MoveKind.RAMP, to_share=1.0, over_s=8.0, hold_s=5.0)
    plan = ExperimentPlan(name="up", check=check, parts=(Part(name="up", moves=(climbs,)),))
    rig = locally(SmallRig(with_limits(settings(), force_max_n=40.0), gain_n_per_v=10.0), plan)
    rig.until(State.OFF, 30.0)
    assert max(force_n for _, _, force_n in rig.trace) <= 40.0
    assert (rig.word("calibration_phase"), rig.word("fault_code")) == (CalibrationPhase.STOPPED, FaultCode.NONE)
    assert [sentence for sentence in rig.log if "40 N: the run is stopped" in sentence]
