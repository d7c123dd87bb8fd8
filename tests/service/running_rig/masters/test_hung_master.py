"""A master whose program stands still while its last frame is sent on and on, as a PLC's communication module does."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.control import CalibrationInUse, LeaseAction
from gateway.control.settings import Defaults, SelfTestSettings
from gateway.profiles import load_calibration
from gateway.registers import Refusal
from gateway.registers.words import State
from gateway.registers.writes.held_starts import HeldEnables
from tests.control.bench import bsfm, settings
from tests.service.running_rig.simulated_rig import CALIBRATE, ENABLE, OTHER, OWNER, TAKE, SmallRig

LEASE_S, CYCLE_S = 0.35, 0.1
RESET, SELF_TEST = 1 << 1, 1 << 6


@pytest.mark.parametrize(
    ("word", "force_n", "reason"),
    [
        (ENABLE, 12.0, RefusalReason.HEARTBEAT_STALE),
        (CALIBRATE, 0.0, RefusalReason.CALIBRATION_HELD),
        (SELF_TEST, 0.0, RefusalReason.CALIBRATION_HELD),
    ],
)
def test_the_last_frame_of_a_program_that_stands_still_presses_once(
    word: int, force_n: float, reason: RefusalReason
) -> None:
    control = settings(lease_s=LEASE_S, lease_action=LeaseAction.RAMP)
    rig = SmallRig(replace(control, self_test=SelfTestSettings()))
    frame = rig.block(word, force_n, beat=rig.beat + 1)
    rig.write(0, *frame)
    rig.beats = False
    for _ in range(100):
        rig.run(CYCLE_S).answer(0, *frame)
    late = rig.trace[-800:]
    assert not any(state is not State.OFF or volts for state, volts, _ in late), "pressed again"
    refused = rig.answer(0, *frame)
    assert refused and refused.reason is reason
    assert rig.bank.owner is None, "somebody else may take the machine"


def test_a_program_that_goes_on_enables_with_its_next_beat() -> None:
    rig = SmallRig(settings(lease_s=LEASE_S, lease_action=LeaseAction.RAMP))
    frame = rig.block(ENABLE, 12.0, beat=7)
    rig.write(0, *frame)
    rig.beats = False
    rig.run(0.1).until(State.OFF).run(1.0)
    rig.write(0, *frame[:4], 8, *frame[5:])
    assert rig.run(0.05).state is not State.OFF


def test_a_fault_that_another_master_resets_lets_no_frame_of_before_press_again() -> None:
    rig = SmallRig(settings(lease_s=LEASE_S))
    frame = rig.block(ENABLE, 12.0, beat=7)
    rig.write(0, *frame)
    rig.beats = False
    rig.run(0.1).until(State.FAULT).run(1.0)
    rig.write(0, RESET, 0, 0, 0, 4711, peer=OTHER)
    for _ in range(20):
        rig.run(CYCLE_S).answer(0, *frame)
    assert all(volts == 0.0 for _, volts, _ in rig.trace[-200:])
    refused = rig.answer(0, *frame)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE


def test_of_a_force_that_is_held_for_a_lost_master_nobody_is_the_owner() -> None:
    """Neither who stands still and sends its last frame on and on, nor who writes once and leaves: they kept the others out."""
    rig = SmallRig(settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD))
    frame = rig.block(ENABLE, 12.0, beat=7)
    rig.write(0, *frame)
    rig.beats = False
    for _ in range(10):
        rig.run(CYCLE_S).write(0, *frame)
    assert rig.bank.owner is None
    rig.write(1, 1100, peer=OTHER)
    rig.run(1.0)
    assert rig.state is State.HOLDING and rig.bank.owner is None
    rig.write(0, *frame[:4], 8, *frame[5:])
    assert rig.bank.owner == OWNER.host, "who beats owns"
    refused = rig.answer(1, 1100, peer=OTHER)
    assert refused and refused.reason is RefusalReason.NOT_OWNER


@pytest.mark.parametrize("lost", ["waiting for contact", "on a ramp", "and its contact behind it"])
def test_a_force_that_is_held_for_a_lost_master_does_not_rise(lost: str) -> None:
    """Who comes to see why the machine stands touched the tool, and it pressed with the setpoint of a master that was gone."""
    rig = SmallRig(settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD), contact=not lost.startswith("waiting"))
    frame = rig.block(ENABLE, 30.0, beat=7)
    ramp = 100 if lost == "on a ramp" else 0  # 10 N/s
    frame = (*frame[:2], ramp, *frame[3:])
    rig.write(0, *frame)
    rig.run(1.0)
    rig.beats = False
    rig.run(LEASE_S + 0.1)
    if lost.startswith("and"):
        assert rig.plant.force_n > 28.0, "what is held is held"
        rig.plant.contact = False
        rig.run(1.0)
    held_n = 0.0 if not rig.plant.contact else rig.plant.force_n
    rig.plant.contact = True
    rig.run(2.0)
    assert rig.plant.force_n < max(5.0, held_n + 1.0)
    rig.write(0, *frame[:4], 4711, *frame[5:])
    rig.beats = True
    rig.run(4.0)
    assert rig.plant.force_n > 28.0, "its master is back"


def _faulted_under_cycles(rig: SmallRig) -> Iterator[Refusal | None]:
    """A living PLC that writes its whole block, enable in it, over a fault and beyond; the answers behind a reset by another
    master, ten a second."""
    rig.beats = False
    for cycle in range(100):
        rig.is_cell_silent = 10 <= cycle < 15
        if cycle == 25:
            rig.write(0, RESET, 0, 0, 0, 9000, peer=OTHER)
            assert rig.state is State.OFF
        refused = rig.answer(0, ENABLE, 1200, 0, 0, cycle)
        rig.run(CYCLE_S)
        if cycle >= 25:
            yield refused


@pytest.mark.parametrize("lease_s", [None, LEASE_S])
def test_an_enable_that_stood_over_a_fault_presses_not_by_another_master_s_reset_alone(lease_s: float | None) -> None:
    """It would begin a force in the moment in which somebody at the page wanted to see whether the fault is gone."""
    rig = SmallRig(settings(lease_s=lease_s))
    for refused in _faulted_under_cycles(rig):
        assert refused is not None and refused.reason is RefusalReason.CALIBRATION_HELD
        assert (rig.state, rig.wire.voltage_v) == (State.OFF, 0.0)
    assert rig.bank.owner is None, "somebody else may take the machine"


@pytest.mark.parametrize("by", ["its own 0", "its own coil", "its own reset", "a pause", "another master"])
def test_behind_a_reset_an_enable_counts_again_that_was_0_or_of_who_has_waited(by: str) -> None:
    rig = SmallRig()
    refused = next(_faulted_under_cycles(rig))
    assert refused is not None and refused.reason is RefusalReason.CALIBRATION_HELD
    if by == "its own 0":
        rig.write(0, 0, 1200)
    elif by == "its own coil":
        rig.bank.write_bits(0, [False], OWNER)
    elif by == "its own reset":
        rig.write(0, RESET)
    elif by == "a pause":
        rig.run(2.8)
        assert rig.answer(0, ENABLE, 1200) is not None
        rig.run(3.0)
    rig.write(0, ENABLE, 1200, peer=OTHER if by == "another master" else OWNER)
    rig.until(State.HOLDING)


def test_a_heartbeat_or_another_coil_lets_no_enable_go_that_stood_over_a_fault() -> None:
    rig = SmallRig()
    assert next(_faulted_under_cycles(rig)) is not None
    rig.write(4, 99)
    rig.write(1, 0)
    rig.bank.write_bits(2, [False], OWNER)
    refused = rig.answer(0, ENABLE, 1200)
    assert refused is not None and refused.reason is RefusalReason.CALIBRATION_HELD


def test_the_hosts_whose_enables_stood_over_a_fault_are_sixty_four() -> None:
    held = HeldEnables()
    for number in range(65):
        held.note(f"10.0.0.{number}", 1.0)
    assert [held.holds(f"10.0.0.{number}", 1.5) for number in (0, 1, 64)] == [False, True, True]


@pytest.mark.parametrize("is_lowered", [False, True])
def test_a_calibration_that_allows_less_lets_no_force_rise_that_is_held_for_a_lost_master(is_lowered: bool) -> None:
    """Contact was lost, too: 2 N waited for it, and 20 N were pressed on whoever touched the tool behind the commit."""
    rig = SmallRig(settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD)).holding(30.0)
    rig.beats = rig.plant.contact = False
    rig.run(3.0)
    less = replace(load_calibration("demo"), number=17, force_limits_n=(1.0, 20.0))
    if is_lowered:
        assert rig.bank.set_active_model(less).startswith("W314")
        rig.controller.use(CalibrationInUse(replace(bsfm(), limits_n=less.force_limits_n), 17))
    rig.plant.contact = True
    rig.run(2.0)
    assert rig.plant.force_n < 3.0 and rig.word("force_setpoint") == (2000 if is_lowered else 3000)
    refused = rig.answer(1, 500)
    assert refused and refused.reason is RefusalReason.HEARTBEAT_STALE
    rig.write(1, 500, 0, 0, 4711)
    rig.beats = True
    rig.run(2.0)
    assert rig.plant.force_n == pytest.approx(5.0, abs=0.3), "a new setpoint with a beat counts"


@pytest.mark.parametrize(
    ("writes", "ends"),
    [
        ("a path", State.OFF),
        ("nothing", State.FAULT),
        ("one frame", State.FAULT),
        ("a path, then it leaves", State.FAULT),
        ("a path, then its cable is cut", State.FAULT),
    ],
)
def test_the_way_to_the_end_is_no_fault_beside_an_owner_that_goes_on_with_its_path(writes: str, ends: State) -> None:
    """Its setpoints were refused, its beats with them, and the force fell at once, as of a master that is gone."""
    rig, written = (
        SmallRig(replace(settings(lease_s=LEASE_S), defaults=Defaults(force_ramp_n_per_s=10.0))).holding(30.0),
        0,
    )
    rig.beats = False
    for cycle in range(80):
        if cycle == 10:
            rig.controller.stop()
        elif writes.startswith("a path") or cycle < 10:  # a cut cable leaves the connection open
            written = cycle
        if cycle < 10 or not (writes == "nothing" or (writes.endswith("cut") and cycle > 15)):
            rig.answer(0, ENABLE, 3000 + written % 7, 0, 0, 1000 + written)
        if cycle == 15 and writes.endswith("leaves"):
            rig.loop.owner_connected = False
            break
        rig.run(0.05)
    rig.until(ends, 3.0)
    volts = [volts for _, volts, _ in rig.trace]
    falls = [before_v - after_v for before_v, after_v in pairwise(volts)]
    assert (max(falls) > 2.0) is (ends is State.FAULT)


@pytest.mark.parametrize(("brings_n", "then_n"), [(None, 12.0), (30.0, 30.0), (8.0, 8.0)])
def test_who_takes_over_what_is_held_for_a_lost_master_holds_that_unless_it_brings_a_setpoint(
    brings_n: float | None, then_n: float
) -> None:
    """The master was lost on the way to 30 N: a takeover and a beat of another one let the force go on to them."""
    control = settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD)
    rig = SmallRig(replace(control, defaults=Defaults(force_ramp_n_per_s=5.0)))
    rig.write(0, ENABLE, 3000)
    rig.run(2.0).beats = False
    held_n = rig.run(1.5).plant.force_n
    assert rig.state is State.HOLDING and held_n == pytest.approx(12.0, abs=0.5)
    rig.write(0, ENABLE | TAKE, *([] if brings_n is None else [round(100 * brings_n)]), peer=OTHER)
    for beat in range(50):
        rig.write(4, 100 + beat, peer=OTHER)
        rig.run(0.1)
    assert rig.plant.force_n == pytest.approx(then_n, abs=0.5)
    assert rig.word("force_setpoint") == rig.word("force_requested") == pytest.approx(100 * then_n, abs=50)


@pytest.mark.parametrize("has_contact", [True, False])
def test_who_beats_beside_what_is_held_for_a_lost_master_holds_that(has_contact: bool) -> None:
    """A heartbeat of another one, which never asked for a force: 12 N went on to 30 N, or 30 N waited for the next touch."""
    control = settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD)
    rig = SmallRig(replace(control, defaults=Defaults(force_ramp_n_per_s=5.0)), contact=has_contact)
    rig.write(0, ENABLE, 3000)
    rig.run(2.0).beats = False
    rig.run(1.5)
    held_n = rig.word("force_accepted") / 100 if has_contact else 0.0
    for beat in range(20):
        rig.write(4, 100 + beat, peer=OTHER)
        rig.run(0.1)
    rig.plant.contact = True
    for beat in range(50):
        rig.write(4, 200 + beat, peer=OTHER)
        rig.run(0.1)
    assert rig.bank.owner == OTHER.host and rig.word("force_setpoint") == pytest.approx(100 * held_n)
    assert rig.plant.force_n == pytest.approx(held_n, abs=0.5)
    rig.write(1, 2000, peer=OTHER)
    for beat in range(60):
        rig.write(4, 300 + beat, peer=OTHER)
        rig.run(0.1)
    assert rig.plant.force_n == pytest.approx(20.0, abs=0.5), "what it asks for counts"


def test_a_write_without_a_beat_beside_what_is_held_lets_it_not_rise_at_the_next_contact() -> None:
    """Another host's width of the band made 12 N its setpoint, and they were pressed on whoever touched the tool."""
    control = settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD)
    rig = SmallRig(replace(control, defaults=Defaults(force_ramp_n_per_s=5.0)))
    rig.write(0, ENABLE, 3000)
    rig.run(2.0).beats = False
    rig.run(1.5).write(11, 100, peer=OTHER)
    assert rig.run(0.5).plant.force_n == pytest.approx(12.0, abs=0.5), "what is held is held"
    rig.plant.contact = False
    rig.run(1.5).plant.contact = True
    assert rig.run(3.0).plant.force_n < 5.0
