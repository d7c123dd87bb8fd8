"""The self-test on machines that nobody here has built: nothing is found on a healthy one, and each fault by its own item.

Calibrations are those that the product's quick ladder gave for these machines (tests/control/foreign).
"""

from collections.abc import Callable
from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.self_test.items import Item
from gateway.registers.words import CalibrationPhase, ControlBit, SelfTestResult, SelfTestVerdict, State
from tests.control.foreign.machine import Machine
from tests.control.self_test.rig import KEPT, SelfTestRig, verdict_on

FORCE_N = 34.0
LONGEST_S = 20.0
FAST = (5,)
SEEDS = tuple(seed if seed in FAST else pytest.param(seed, marks=pytest.mark.long) for seed in range(20))
PASSED, WARNED, FAILED = SelfTestVerdict.PASSED, SelfTestVerdict.WARNED, SelfTestVerdict.FAILED


def machine_of(seed: int, **changes: float) -> Machine:
    return replace(KEPT[seed].machine, **changes)


def noisy(seed: int) -> SelfTestRig:
    return SelfTestRig(seed, FORCE_N, machine=machine_of(seed, noise_n=5.0 * KEPT[seed].machine.noise_n + 0.2))


def slow(seed: int) -> SelfTestRig:
    return SelfTestRig(seed, FORCE_N, machine=machine_of(seed, lag_s=6.0 * KEPT[seed].machine.lag_s + 0.1))


def stuck(seed: int) -> SelfTestRig:
    return SelfTestRig(seed, FORCE_N, machine=machine_of(seed, noise_n=0.0), reading=lambda force_n: 0.0)


BROKEN: dict[str, tuple[Item, Callable[[int], SelfTestRig]]] = {
    "noise": (Item.NOISE, noisy),
    "stuck": (Item.RESOLUTION, stuck),
    "coarse": (Item.RESOLUTION, lambda seed: SelfTestRig(seed, FORCE_N, machine=machine_of(seed, quantum_n=0.8))),
    "zero": (Item.ZERO, lambda seed: SelfTestRig(seed, FORCE_N, reading=lambda force_n: force_n + 8.0)),
    "zero below": (Item.ZERO, lambda seed: SelfTestRig(seed, FORCE_N, reading=lambda force_n: force_n - 3.0)),
    "sign": (Item.SIGN, lambda seed: SelfTestRig(seed, FORCE_N, reading=lambda force_n: -force_n)),
    "kgf": (Item.SCALE, lambda seed: SelfTestRig(seed, FORCE_N, reading=lambda force_n: force_n / 9.80665)),
    "span": (Item.SCALE, lambda seed: SelfTestRig(seed, FORCE_N, reading=lambda force_n: 4.0 * force_n)),
    "air": (Item.SCALE, lambda seed: SelfTestRig(seed, FORCE_N, machine=machine_of(seed, gain_n_per_v=0.0))),
    "slow": (Item.RESPONSE, slow),
    "leak": (Item.LEAK, lambda seed: SelfTestRig(seed, FORCE_N, leak_per_s=0.1)),
    "output line": (Item.OUTPUT_LINE, lambda seed: SelfTestRig(seed, FORCE_N, lost_answers=0.2)),
    "samples": (Item.CELL_LINE, lambda seed: SelfTestRig(seed, FORCE_N, lost_samples=0.2)),
    "garbage": (Item.CELL_LINE, lambda seed: SelfTestRig(seed, FORCE_N, garbled=0.2)),
}
SUPERVISED = {
    Item.RESOLUTION: FaultCode.SAMPLE_FROZEN,
    Item.SCALE: FaultCode.GAIN_WRONG,
    Item.OUTPUT_LINE: FaultCode.OUTPUT_SILENT,
}
"""What supervision, which does not wait for a test's end, may see of the same fault before."""


@pytest.mark.parametrize("has_worked", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_machine_passes_within_20_s_and_below_the_stated_force(seed: int, has_worked: bool) -> None:
    rig = SelfTestRig(seed, FORCE_N)
    report = (rig.worked() if has_worked else rig).tested()
    assert report.result is SelfTestResult.PASSED, report.sentences
    assert all(found.verdict is PASSED and found.text for found in report.findings)
    assert rig.took_s < LONGEST_S
    assert 0.5 * FORCE_N < rig.peak_n < FORCE_N
    assert rig.controller.state is State.OFF and rig.output and rig.output.voltage_v == 0.0


@pytest.mark.sampled
@pytest.mark.parametrize("name", BROKEN)
@pytest.mark.parametrize("seed", [5, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(20) if seed != 5)])
def test_each_fault_is_found_by_its_own_item_and_by_no_other(seed: int, name: str) -> None:
    item, broken = BROKEN[name]
    rig = broken(seed)
    report = rig.tested()
    failed = [found.item for found in report.findings if found.verdict is FAILED]
    assert failed == [item], report.sentences
    assert report.result is SelfTestResult.FAILED
    assert rig.peak_n < FORCE_N and rig.took_s < LONGEST_S
    assert rig.output and rig.output.fault in (FaultCode.NONE, SUPERVISED.get(item)), rig.events
    assert sum(sentence.startswith("A354 self-test") for sentence in rig.events) == 1


@pytest.mark.parametrize("factor", [2.5, 8.0])
def test_a_machine_that_is_stronger_than_its_calibration_stays_below_the_stated_force(factor: float) -> None:
    """The twin of the test above with the slide itself: what presses is what is measured."""
    strong = machine_of(5, gain_n_per_v=factor * KEPT[5].machine.gain_n_per_v)
    rig = SelfTestRig(5, FORCE_N, machine=strong)
    report = rig.tested()
    assert rig.peak_n < FORCE_N
    assert (
        verdict_on(report, Item.SCALE) in (WARNED, FAILED)
        or verdict_on(report, Item.SCALE) is SelfTestVerdict.NOT_TESTED
    )
    assert report.result in (SelfTestResult.WARNED, SelfTestResult.FAILED)


@pytest.mark.sampled
@pytest.mark.parametrize("force_n", [FORCE_N, 0.0])
@pytest.mark.parametrize(
    ("drift_n_per_s", "verdict"), [(0.02, PASSED), (0.15, WARNED), (-0.15, WARNED), (0.5, FAILED), (-0.5, FAILED)]
)
def test_a_cell_that_drifts_is_found_at_rest(drift_n_per_s: float, verdict: SelfTestVerdict, force_n: float) -> None:
    """One that gained 9 N a minute passed, or its regulator was blamed."""
    rig = SelfTestRig(5, force_n)
    begun_s = rig.now_s + 1.0
    rig.reading = lambda force_n: force_n + drift_n_per_s * (rig.now_s - begun_s)
    report = rig.tested()
    assert verdict_on(report, Item.ZERO) is verdict, report.sentences
    (zero,) = (found for found in report.findings if found.item is Item.ZERO)
    assert (f"moves by {drift_n_per_s:+.1f}"[:-1] in zero.text) is (verdict is not PASSED), zero.text


def test_what_the_pressure_loses_counts_from_where_it_is_held() -> None:
    """Its rise to there would hide a leak."""
    report = SelfTestRig(5, FORCE_N, leak_per_s=0.1, pressure_pa_per_v=1e5).tested()
    (leak,) = (found for found in report.findings if found.item is Item.LEAK)
    lost_percent = float(leak.text.partition("pressure ")[2].partition(" %")[0])
    assert lost_percent == pytest.approx(10.0, abs=2.0)


def test_without_a_force_nothing_moves_and_the_rest_is_tested() -> None:
    rig = SelfTestRig(1, 0.0)
    report = rig.tested()
    assert rig.peak_v == 0.0 and report.result is SelfTestResult.PASSED
    assert [found.item for found in report.findings if found.verdict is PASSED] == [
        Item.NOISE, Item.RESOLUTION, Item.ZERO, Item.OUTPUT_LINE, Item.CELL_LINE,
    ]  # fmt: skip
    assert "nothing moves" in report.sentences[3]


def test_where_friction_leaves_no_room_that_is_said_and_not_taken_for_a_fault() -> None:
    rig = SelfTestRig(5, 5.0).worked()
    report = rig.tested()
    assert report.result is SelfTestResult.WARNED
    assert rig.peak_n < 5.0
    assert "leave no room below self_test.force_n = 5 N: raise it" in report.sentences[3]
    assert rig.output and rig.output.calibration_progress == 1.0, "over is over, however early"


def test_clearing_bit_6_ends_it_and_nothing_is_claimed() -> None:
    rig = SelfTestRig(1, FORCE_N)
    rig.write(ControlBit.START_SELF_TEST)
    rig.run(5.0)
    assert rig.controller.active_run.self_test.result is SelfTestResult.RUNNING
    assert rig.output and rig.output.calibration_phase is CalibrationPhase.SELF_TEST
    assert 0.0 < rig.output.calibration_progress < 1.0 and rig.output.calibration_time_left_s > 0.0
    rig.write(ControlBit(0))
    rig.run(1.0)
    report = rig.controller.active_run.self_test
    assert rig.controller.state is State.OFF and report.result is SelfTestResult.STOPPED
    assert verdict_on(report, Item.LEAK) is SelfTestVerdict.NOT_TESTED
    assert verdict_on(report, Item.NOISE) is PASSED
    assert "self-test stopped by m" in rig.events


def test_a_fault_of_the_supervision_is_the_verdict_on_what_it_is_about() -> None:
    rig = SelfTestRig(1, FORCE_N)
    rig.write(ControlBit.START_SELF_TEST)
    rig.run(4.0)
    rig.lost_samples = 1.0
    rig.run(1.0)
    report = rig.controller.active_run.self_test
    assert rig.controller.state is State.FAULT and report.result is SelfTestResult.FAILED
    assert [found.item for found in report.findings if found.verdict is FAILED] == [Item.CELL_LINE]
    assert "A311" in next(found.text for found in report.findings if found.item is Item.CELL_LINE)
    assert set(report.sentences) <= set(rig.events)


def test_a_second_self_test_has_the_next_number() -> None:
    rig = SelfTestRig(1, 0.0)
    assert [rig.tested().number, rig.tested().number] == [1, 2]


@pytest.mark.sampled
@pytest.mark.parametrize("said_n", [-20.0, 60.0])
@pytest.mark.parametrize("at_s", [1.5, 2.8, 3.3, 3.5, 3.9, 4.1, 5.0, 7.0])
def test_one_reading_that_was_disturbed_on_its_wire_fails_no_machine(at_s: float, said_n: float) -> None:
    """It was a sign to be turned, or a span that is wrong, by a force that nobody had pressed."""
    rig = SelfTestRig(5, FORCE_N)
    begun_s, said = rig.now_s, list[float]()

    def read(force_n: float) -> float:
        if said or rig.now_s < begun_s + at_s:
            return force_n
        said.append(said_n)
        return said_n

    rig.reading = read
    report = rig.tested()
    assert said and report.result is SelfTestResult.PASSED, report.sentences


def test_a_force_that_still_leaves_when_the_test_begins_is_no_rest_to_rise_from() -> None:
    rig = SelfTestRig(5, FORCE_N)
    rig.reading = lambda force_n: force_n - 16.0
    rig.run(1.0)
    rig.write(ControlBit.START_SELF_TEST)
    rig.reading = lambda force_n: force_n  # the cell is back while the test is at rest still
    while rig.controller.state is State.CALIBRATING:
        rig.run(0.05)
    assert rig.output and rig.output.fault is FaultCode.NONE, rig.events
    assert verdict_on(rig.controller.active_run.self_test, Item.SCALE) is PASSED
