"""A run on the output, and masters around it: how it ends, who may end it, what it never does, and who owns what afterwards."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from struct import pack, unpack

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control import LeaseAction
from gateway.control.runs.experiment_plan import ExperimentPlan, Move, MoveKind, Part
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.profiles import load_calibration
from gateway.registers.refusal import Refusal
from gateway.registers.words import CalibrationPhase, State
from tests.control.bench import settings
from tests.service.running_rig.simulated_rig import (
    CALIBRATE,
    ENABLE,
    OTHER,
    OWNER,
    RESET,
    TAKE,
    TARE,
    Rack,
    with_limits,
)

LEASE_S = 0.35
RAMP_N_PER_S = 40.0
SHORT = CalibrationPlan(step_v=0.5, groups=1, minor_points=12)


def leased() -> Rack:
    return Rack(settings(lease_s=LEASE_S))


def with_ramp(force_ramp_n_per_s: float = RAMP_N_PER_S) -> Rack:
    control = settings()
    return Rack(replace(control, defaults=replace(control.defaults, force_ramp_n_per_s=force_ramp_n_per_s)))


def locally(rack: Rack, plan: CalibrationPlan | ExperimentPlan = SHORT) -> Rack:
    rack.controller.active_run.ask(plan)
    return rack.until(State.CALIBRATING)


# -- how a run ends

CLEARS: dict[str, Callable[[Rack], None]] = {
    "FC05": lambda rack: rack.bank.write_bits(5, [False], OWNER),
    "FC06": lambda rack: rack.write(0, 0),
    "FC15": lambda rack: rack.bank.write_bits(0, [False] * 8, OWNER),
    "FC16": lambda rack: rack.write(0, *rack.block(0, beat=99)),
    "FC22": lambda rack: rack.bank.mask_write(0, 0xFFDF, 0, OWNER),
    "float ABCD": lambda rack: rack.bank.write_registers(200, bytes(4), OWNER),
    "float CDAB": lambda rack: rack.bank.write_registers(300, bytes(4), OWNER),
    "another master": lambda rack: rack.write(0, 0, peer=OTHER),
}


@pytest.mark.parametrize("way", CLEARS)
def test_clearing_bit_5_takes_the_force_to_0_along_the_ramp(way: str) -> None:
    rack = with_ramp().calibrating()
    begun_n, began = rack.plant.force_n, len(rack.trace)
    assert begun_n > 8.0
    CLEARS[way](rack)
    assert rack.state is State.CALIBRATING
    rack.until(State.OFF, 2.0)
    volts = [voltage_v for _, voltage_v, _ in rack.trace[began:]]
    assert len(volts) * 0.01 >= 0.5 * begun_n / RAMP_N_PER_S
    assert all(after <= before for before, after in pairwise(volts))
    assert max(before - after for before, after in pairwise(volts)) < 0.4
    assert (rack.wire.voltage_v, rack.word("calibration_phase")) == (0.0, CalibrationPhase.STOPPED)
    assert (rack.word("control_word"), rack.bank.owner) == (0, None)


@pytest.mark.parametrize("peer", [OWNER, OTHER])
def test_clearing_enable_is_the_safe_voltage_in_the_write_itself(peer) -> None:
    rack = Rack().calibrating(ENABLE | CALIBRATE)
    rack.write(0, 0, peer=peer)
    assert (rack.wire.voltage_v, rack.state) == (0.0, State.OFF)


def test_clearing_bit_5_alone_of_an_enabled_run_ends_in_off_and_not_in_ready() -> None:
    rack = with_ramp().calibrating(ENABLE | CALIBRATE)
    rack.write(0, ENABLE)
    assert rack.wire.voltage_v > 0.5
    rack.until(State.OFF, 2.0)
    assert rack.word("control_word") == 0


def test_who_ends_the_run_of_another_master_does_not_own_it() -> None:
    rack = with_ramp().calibrating(ENABLE | CALIBRATE)
    rack.write(0, ENABLE, peer=OTHER)
    assert rack.state is State.CALIBRATING
    assert rack.bank.owner == OWNER.host
    rack.until(State.OFF, 2.0)
    assert rack.bank.owner is None


def test_another_masters_enable_during_a_run_is_refused_and_no_end_of_it() -> None:
    rack = with_ramp().calibrating()
    with pytest.raises(Refusal) as refused:
        rack.write(0, ENABLE, 900, peer=OTHER)
    assert refused.value.reason is RefusalReason.NOT_OWNER
    assert rack.state is State.CALIBRATING and rack.bank.owner == OWNER.host


def test_a_run_of_this_machine_is_stopped_by_0_in_the_control_word_alone_and_not_by_a_cyclic_block() -> None:
    rack = locally(Rack()).run(2.0)
    for beat in range(5):
        rack.write(0, *rack.block(0, beat=beat))
        rack.run(0.1)
    rack.bank.write_bits(2, [False], OTHER)
    assert rack.state is State.CALIBRATING
    rack.write(0, 0, peer=OTHER)
    assert (rack.wire.voltage_v, rack.state) == (0.0, State.OFF)


def test_a_run_of_this_machine_needs_no_heartbeat_on_its_way_to_0() -> None:
    control = settings(lease_s=LEASE_S)
    rack = Rack(replace(control, defaults=replace(control.defaults, force_ramp_n_per_s=10.0)))
    locally(rack).run(3.0).controller.active_run.ask_stop("calibration stopped at this machine")
    rack.until(State.OFF, 6.0)


@pytest.mark.parametrize("action", [LeaseAction.HOLD, LeaseAction.RAMP])
def test_the_leases_end_ends_a_run_of_the_masters_along_the_ramp(action: LeaseAction) -> None:
    rack = Rack(settings(lease_s=LEASE_S, lease_action=action)).calibrating()
    rack.beats = False
    rack.until(State.OFF, 2.0)
    assert rack.word("calibration_phase") == CalibrationPhase.STOPPED


def test_a_run_that_cannot_begin_any_more_when_its_turn_comes_leaves_the_force() -> None:
    rack = Rack()
    rack.controller.active_run.ask(SHORT)
    rack.controller.active_run._asked, asked = None, rack.controller.active_run._asked
    rack.holding()
    rack.controller.active_run._asked = asked
    rack.run(2.0)
    assert rack.state is State.HOLDING
    assert rack.controller.active_run.take_refused().startswith("W305 calibration refused: state HOLDING")


def test_a_master_that_holds_bit_5_in_its_cycle_does_not_begin_again() -> None:
    rack = Rack().calibrating()
    rack.write(0, *rack.block(CALIBRATE, beat=1))
    rack.write(0, 0, peer=OTHER)
    rack.until(State.OFF)
    held = rack.answer(0, *rack.block(CALIBRATE, beat=2))
    assert held is not None
    assert (held.code, held.reason) == (4, RefusalReason.CALIBRATION_HELD)
    rack.write(0, *rack.block(0, beat=3))
    rack.write(0, *rack.block(CALIBRATE, beat=4))
    assert rack.state is State.CALIBRATING


def test_one_write_begins_a_run_again_and_again() -> None:
    rack = Rack()
    for _ in range(2):
        rack.calibrating()
        rack.controller.active_run.ask_stop("calibration stopped at this machine")
        rack.until(State.OFF)


def test_a_run_shows_what_it_does_and_how_long_it_still_takes() -> None:
    rack = Rack().calibrating()
    assert rack.word("status_word") & 3 == 1, "enabled, and not ready for commands"
    assert rack.word("force_accepted") > 0
    left_s = rack.word("calibration_time_left")
    rack.run(20.0)
    assert 0 < rack.word("calibration_time_left") < left_s
    rack.write(0, 0)
    rack.until(State.OFF)
    assert rack.word("calibration_time_left") == rack.word("force_accepted") == 0


# -- the rig's largest force


@pytest.mark.parametrize("gain_n_per_v", [6.0, 7.4, 9.0, 13.0])
def test_a_ladder_never_measures_more_than_the_rig_allows_and_goes_on_below(gain_n_per_v: float) -> None:
    rack = Rack(with_limits(settings(), force_max_n=40.0), gain_n_per_v=gain_n_per_v)
    locally(rack)
    measured_n = []
    while rack.controller.active_run.running:
        rack.run(0.01)
        measured_n.append(unpack(">h", rack.bank.read_registers(102, 1))[0] / 100.0)
    assert max(measured_n) <= 40.0
    assert max(measured_n) >= 31.0
    assert rack.word("calibration_phase") == CalibrationPhase.FITTING
    said = [sentence for sentence in rack.log if sentence.startswith("A350")]
    assert bool(said) is (gain_n_per_v > 7.0), "beyond the calibration in use"
    assert rack.word("fault_code") == FaultCode.NONE


@pytest.mark.parametrize("check", [True, False])
def test_an_experiment_ends_where_it_would_pass_the_rigs_force(check: bool) -> None:
    climbs = Move(do=MoveKind.RAMP, to_share=1.0, over_s=8.0, hold_s=5.0)
    plan = ExperimentPlan(name="up", check=check, parts=(Part(name="up", moves=(climbs,)),))
    rack = locally(Rack(with_limits(settings(), force_max_n=40.0), gain_n_per_v=10.0), plan)
    rack.until(State.OFF, 30.0)
    assert max(force_n for _, _, force_n in rack.trace) <= 40.0
    assert (rack.word("calibration_phase"), rack.word("fault_code")) == (CalibrationPhase.STOPPED, FaultCode.NONE)
    assert [sentence for sentence in rack.log if "40 N: the run is stopped" in sentence]


# -- who owns

HOLDERS: dict[str, Callable[[], Rack]] = {
    "off": Rack,
    "prepared": lambda: _written(Rack(), 1, 500),
    "ready": lambda: _written(Rack(), 0, ENABLE),
    "holding": lambda: leased().holding(),
    "fault": lambda: leased().faulted(),
    "calibrating": lambda: Rack().calibrating(),
    "calibrating here": lambda: locally(Rack()),
}


def _written(rack: Rack, *words: int) -> Rack:
    rack.write(*words)
    return rack.run(0.1)


@pytest.mark.parametrize("name", HOLDERS)
def test_bit_3_of_another_master_takes_over_alike_in_every_state(name: str) -> None:
    rack = HOLDERS[name]()
    stood = (rack.state, rack.word("control_word"), rack.word("force_setpoint"))
    rack.bank.write_bits(3, [True], OTHER)
    assert rack.bank.owner == OTHER.host
    assert (rack.state, rack.word("control_word"), rack.word("force_setpoint")) == stood
    for words in ((4, 71), (4, 72), (0, *rack.block(rack.word("control_word"), beat=73))):
        rack.write(*words, peer=OTHER)
        rack.run(0.1)
        assert rack.bank.owner == OTHER.host, "its own heartbeat never ends it"
    if rack.state is not State.CALIBRATING:
        for words in ((6, 10), (2, 300), (1, 0)):
            rack.write(*words, peer=OTHER)
            assert rack.bank.owner == OTHER.host
    refused = rack.answer(2, 100)
    assert refused is not None
    assert (refused.code, refused.reason) == (6, RefusalReason.NOT_OWNER)
    rack.bank.write_bits(3, [True], OWNER)
    assert rack.bank.owner == OWNER.host


def test_a_takeover_in_the_write_that_disables_holds_too() -> None:
    rack = Rack().holding()
    rack.write(0, TAKE, peer=OTHER)
    rack.run(0.5)
    assert (rack.state, rack.bank.owner) == (State.OFF, OTHER.host)


def test_a_takeover_ends_with_disable() -> None:
    rack = Rack().holding()
    rack.bank.write_bits(3, [True], OWNER)
    rack.write(0, 0)
    assert rack.bank.owner is None


def test_a_takeover_ends_with_the_lease_and_with_no_other_fault() -> None:
    rack = leased().holding()
    rack.bank.write_bits(3, [True], OWNER)
    rack.is_cell_silent = True
    rack.until(State.FAULT)
    assert rack.bank.owner == OWNER.host
    rack.is_cell_silent = False
    rack.run(0.5).write(0, RESET, 0, 0, 0, 4711)
    rack.run(1.0).holding()
    rack.beats = False
    rack.until(State.FAULT)
    assert rack.bank.owner is None


def test_a_takeover_outlives_the_end_of_its_own_run() -> None:
    rack = Rack()
    rack.write(0, TAKE | CALIBRATE)
    rack.run(2.5).write(0, 0)
    rack.until(State.OFF)
    assert rack.bank.owner == OWNER.host


# -- edges, write by write


def test_an_edge_bit_acts_each_time_it_is_written() -> None:
    rack = Rack()
    for _ in range(3):
        rack.write(0, TARE)
    assert sum(sentence.startswith("tare") for sentence in rack.log) == 3
    rack.write(4, 1)
    assert sum(sentence.startswith("tare") for sentence in rack.log) == 3


def test_a_reset_with_a_new_heartbeat_counts_in_the_very_moment_of_the_fault() -> None:
    rack = leased().holding()
    rack.is_cell_silent = True
    rack.until(State.FAULT)
    rack.write(0, RESET, 0, 0, 0, 4711)
    assert rack.state is State.OFF


def test_a_force_that_is_still_leaving_cannot_become_the_zero() -> None:
    rack = Rack().holding(30.0)
    rack.write(0, 0)
    refused = rack.answer(0, TARE)
    assert refused is not None
    assert "on their way to 0" in refused.sentence
    rack.run(1.5).write(0, TARE)
    assert abs(rack.controller.zero_n) < 1.0


def test_control_answers_for_this_moment_and_not_for_the_last_step() -> None:
    """The last step saw a fresh sample; meanwhile it has grown old, and no step has told."""
    rack = Rack()
    assert rack.word("status_word") & 2
    rack.ticks += 20
    refused = rack.answer(0, ENABLE, 1200)
    assert refused is not None
    assert (refused.code, refused.reason) == (0x0B, RefusalReason.CELL_SILENT)


def test_a_calibration_with_a_smaller_limit_lowers_the_setpoint_in_the_registers() -> None:
    rack = Rack().holding(20.0)
    less = replace(load_calibration("demo"), number=17, force_limits_n=(1.0, 8.0))
    said = rack.bank.set_active_model(less)
    rack.controller.use(less.model(), 17)
    assert said == "W314 force_setpoint lowered from 20.00 N to 8.00 N: calibration 17 allows no more"
    for _ in range(2):
        rack.run(0.1)
        assert (rack.word("force_setpoint"), rack.word("force_requested")) == (800, 2000)
        assert rack.bank.read_registers(202, 2) == pack(">f", 8.0)
        rack.write(4, 5)
    rack.run(2.0)
    assert (rack.state, rack.word("force_accepted")) == (State.HOLDING, 800)
    rack.write(1, 500)
    assert (rack.word("force_setpoint"), rack.word("force_requested")) == (500, 500)
    assert rack.bank.set_active_model(less) == ""
