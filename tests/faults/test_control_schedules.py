"""Seeded random schedules of faults in virtual time; an observer that shares no code with control judges the whole history.

It knows the rig's numbers, the command block, the samples and the line, as anybody beside the gateway could, and checks
these invariants: I1 range, I2 slew, I4 no non-safe voltage without its conditions, I5 faults latch, I11 one first cause,
I13 force after healing.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import isfinite, nan
from random import Random

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices.messages import Quality
from gateway.registers.words import ControlBit, Mode
from tests.control.bench import Bench, Record, settings

SEEDS = range(60)
SAFE_V, LOWEST_V, HIGHEST_V, SLEW_V_PER_S, TICK_S = 0.0, 0.0, 9.0, 100.0, 0.01
CELL_TIMEOUT_S, OUTPUT_TIMEOUT_S, STALL_S, LEASE_S = 0.05, 0.1, 0.1, 0.2
ENABLE_BIT, RESET_BIT, FAULT_STATE, OFF_STATE = 1, 2, 4, 0


def assert_range(history: list[Record]) -> None:
    for record in history:
        volts = record.output.voltage_v
        assert isfinite(volts) and LOWEST_V <= volts <= HIGHEST_V, f"I1 at {record.time_s}: {volts} V"


def assert_slew(history: list[Record]) -> None:
    """A running minimum of v - slew t: no later voltage may lie more than one tick's rise above that line."""
    lowest = 0.0
    for record in history:
        height = record.output.voltage_v - SLEW_V_PER_S * record.time_s
        assert height <= lowest + SLEW_V_PER_S * TICK_S + 1e-9, f"I2 at {record.time_s}"
        lowest = min(lowest, height)


def broken_conditions(record: Record) -> Iterator[str]:
    line, now_s = record.line, record.time_s
    if not int(record.command.control_word) & ENABLE_BIT:
        yield "not enabled"
    if record.sample is None or now_s - record.sample.time_s > CELL_TIMEOUT_S + 1e-9:
        yield "cell not fresh"
    if line.fault or line.acknowledged_v is None:
        yield "output at fault"
    if line.unanswered_since_s is not None and now_s - line.unanswered_since_s > OUTPUT_TIMEOUT_S + 1e-9:
        yield "output silent"
    if line.cell_lost:
        yield "cell lost"
    if line.late_s > STALL_S:
        yield "loop stalled"


def assert_conditions(history: list[Record]) -> None:
    for record in history:
        if record.output.voltage_v != SAFE_V:
            broken = list(broken_conditions(record))
            assert not broken, f"I4 at {record.time_s}: {record.output.voltage_v} V while {broken}"


def assert_lease(history: list[Record]) -> None:
    """I3 for the master: a change of the heartbeat, or the enable itself, is at most T + 20 ms ago."""
    renewed_s, beat, enabled = -1.0, 0, False
    for record in history:
        now_enabled = bool(int(record.command.control_word) & ENABLE_BIT)
        if record.command.heartbeat != beat or (now_enabled and not enabled):
            renewed_s = record.time_s
        beat, enabled = record.command.heartbeat, now_enabled
        if record.output.voltage_v != SAFE_V:
            assert record.time_s - renewed_s <= LEASE_S + 0.02, f"I3 at {record.time_s}"


def assert_latching(history: list[Record]) -> None:
    faulted, cause, word = False, 0, 0
    for record in history:
        state, fault = int(record.output.state), int(record.output.fault)
        rises = int(record.command.control_word) & ~word
        word = int(record.command.control_word)
        asked = rises & RESET_BIT and not word & ENABLE_BIT and record.command.force_setpoint_n == 0.0
        if faulted and state != FAULT_STATE:
            assert asked, f"I5 at {record.time_s}: left FAULT without a reset"
            assert state == OFF_STATE
        if state == FAULT_STATE:
            assert record.output.voltage_v == SAFE_V
            assert fault != 0
            assert not faulted or asked or fault == cause, f"I11 at {record.time_s}: {cause} became {fault}"
        else:
            assert fault == 0
        faulted, cause = state == FAULT_STATE, fault


def assert_one_sentence_per_fault(history: list[Record]) -> None:
    before = OFF_STATE
    for record in history:
        state = int(record.output.state)
        sentences = [event for event in record.output.events if event[0] == "A" and not event.startswith("A301")]
        entered = state == FAULT_STATE and before != FAULT_STATE
        assert len(sentences) == (1 if entered else 0), f"I11 at {record.time_s}: {sentences}"
        before = state


INVARIANTS = [
    assert_range,
    assert_slew,
    assert_conditions,
    assert_lease,
    assert_latching,
    assert_one_sentence_per_fault,
]


def _alter(force_n: Callable[[float], float], quality: Quality = Quality.OK) -> Callable[[Bench], None]:
    def act(bench: Bench) -> None:
        bench.alter_sample = lambda sample: replace(sample, force_n=force_n(sample.force_n), quality=quality)

    return act


def _set(name: str, value: object) -> Callable[[Bench], None]:
    return lambda bench: setattr(bench, name, value)


def _plant(name: str, value: object) -> Callable[[Bench], None]:
    return lambda bench: setattr(bench.plant, name, value)


def _line(**changes: object) -> Callable[[Bench], None]:
    def act(bench: Bench) -> None:
        bench.line = bench.line._replace(**changes)  # type: ignore[arg-type]

    return act


FAULTS: dict[str, Callable[[Bench], None]] = {
    "master lost": _set("heartbeat_every_ms", 0),
    "master's connection closed": _line(owner_connected=False),
    "cell stale": _set("cell_silent", True),
    "cell frozen": _set("cell_frozen", True),
    "cell lost": _line(cell_lost=True),
    "saturated": _alter(lambda force_n: 98.07),
    "overload": _alter(lambda force_n: nan, Quality.OVERLOAD),
    "sample is no number": _alter(lambda force_n: nan),
    "sign inverted": _plant("sign", -1.0),
    "kgf": _plant("unit", 9.81),
    "output silent": _set("output_silent", True),
    "output refused": _line(fault=FaultCode.OUTPUT_REFUSED),
    "output altered": _line(fault=FaultCode.OUTPUT_ALTERED),
    "output lost": _line(fault=FaultCode.OUTPUT_LOST, acknowledged_v=None),
    "no air": _plant("air", False),
    "no contact": _plant("contact", False),
    "late": lambda bench: bench.block_loop(bench.rng.choice([0.03, 0.15, 0.4])),
    "nonsense setpoint": lambda bench: bench.force(nan),
}


def command_something(bench: Bench, chance: Random) -> None:
    """What a master may do at any time, wise or not."""
    action = chance.randrange(9)
    if action < 4:
        bench.force(chance.choice([0.0, 0.1, 3.0, 12.0, 20.0, 40.0, 50.0]))
    elif action == 4:
        bench.enable(chance.uniform(0.0, 45.0))
    elif action == 5:
        bench.reset()
    elif action == 6:
        bench.write(control_word=ControlBit(chance.randrange(8)), force_setpoint_n=chance.choice([0.0, 15.0]))
    elif action == 7:
        bench.disable()
    else:
        bench.voltage(chance.uniform(0.0, 4.0))


def disturbed(seed: int) -> Bench:
    """A bench after 4 s of commands and two or three faults, some of them healed in between."""
    chance = Random(seed)
    bench = Bench(settings(lease_s=LEASE_S), seed, friction_n=chance.uniform(0.0, 3.0))
    bench.heartbeat_every_ms = 50
    bench.run(0.2)
    bench.enable(chance.choice([8.0, 12.0, 25.0]))
    for _ in range(chance.randrange(2, 4)):
        for _ in range(chance.randrange(1, 4)):
            bench.run(chance.uniform(0.02, 0.5))
            command_something(bench, chance)
        FAULTS[chance.choice(sorted(FAULTS))](bench)
        bench.run(chance.uniform(0.05, 0.6))
        if chance.random() < 0.5:
            heal(bench)
            bench.reset()
    return bench


def heal(bench: Bench) -> None:
    bench.heal()
    bench.heartbeat_every_ms = 50


@dataclass(frozen=True)
class Life:
    """A schedule and what came after healing. disturbed: steps before that; took_s: until the force was back."""

    history: list[Record]
    disturbed: int
    took_s: float


CAUSES: dict[int, frozenset[FaultCode]] = {}
"""What each schedule told, as far as it has been lived."""


def causes_of(seed: int) -> frozenset[FaultCode]:
    return CAUSES.get(seed) or causes_in(disturbed(seed).history)


def causes_in(history: list[Record]) -> frozenset[FaultCode]:
    return frozenset(record.output.fault for record in history)


@pytest.fixture(scope="module", params=SEEDS, ids=str)
def life(request: pytest.FixtureRequest) -> Life:
    """One of each schedule, for all tests."""
    bench = disturbed(request.param)
    steps = len(bench.history)
    CAUSES[request.param] = causes_in(bench.history)
    heal(bench)
    bench.write(control_word=ControlBit(0), force_setpoint_n=0.0, mode=Mode.FORCE)
    bench.run(1.2)
    bench.reset()
    bench.write(control_word=ControlBit.TARE)  # the schedule may have tared under a broken cell
    bench.enable(12.0)
    return Life(bench.history, steps, bench.seconds_until(lambda output: bool(output.status & 8), 2.0))


@pytest.mark.sampled
def test_random_faults_break_no_invariant(life: Life) -> None:
    for assert_invariant in INVARIANTS:
        assert_invariant(life.history[: life.disturbed])


@pytest.mark.sampled
def test_after_healing_and_reset_the_force_is_in_band_within_two_seconds(life: Life) -> None:
    assert life.took_s <= 2.0, f"I13: {life.history[-1].output}"
    for assert_invariant in INVARIANTS:
        assert_invariant(life.history)


def test_the_schedules_reach_every_cause_that_they_provoke() -> None:
    seen = frozenset[FaultCode]().union(*map(causes_of, SEEDS))
    assert len(seen) >= 11, sorted(seen)


def test_the_observer_sees_planted_violations():
    bench = disturbed(1)
    good = next(record for record in bench.history if record.output.voltage_v > 1.0)
    bad_range = replace(good, output=good.output._replace(voltage_v=nan))
    jump = replace(good, output=good.output._replace(voltage_v=5.0), time_s=0.001)
    stale = replace(good, time_s=good.time_s + 1.0)
    unlatched = [replace(good, output=good.output._replace(state=4, fault=2, voltage_v=0.0)), good]
    for check, history in [
        (assert_range, [bad_range]),
        (assert_slew, [jump]),
        (assert_conditions, [stale]),
        (assert_lease, [stale, replace(stale, time_s=stale.time_s + 1.0)]),
        (assert_latching, unlatched),
    ]:
        with pytest.raises(AssertionError):
            check(history)
