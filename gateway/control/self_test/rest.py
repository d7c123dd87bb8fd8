"""What the readings at rest say: noise, resolution, zero and its drift; and whether a force may be tried after them."""

from collections.abc import Mapping
from typing import Final

from gateway.control.self_test import judgement
from gateway.control.self_test.items import FAILED, NOT_TESTED, PASSED, Finding, Item
from gateway.control.self_test.judgement import Known
from gateway.control.self_test.measurements import Slope, Trace, count_n, fit_slope, is_constant, mean_n, noise_n
from gateway.registers.words import SelfTestVerdict

_DRIFT_WARNS, _DRIFT_FAILS = 0.05, 0.2  # of self_test.zero_n per second: half of it in 10 s, twice as much
_SURE_SIGMAS: Final = 4.0  # of the slope, whose noise alone is no drift


def judge_rest(rest: Trace, known: Known, weight_n: float = 0.0, outside_n: float = 0.0) -> tuple[Finding, ...]:
    """Judge the readings without a force: noise, resolution, zero. weight_n, outside_n: as of `judge_zero`."""
    noise = Finding(Item.NOISE, NOT_TESTED, "all readings are the same")
    zero = judgement.judge_zero(mean_n(rest), known, weight_n, outside_n)
    return (
        noise if is_constant(rest) else judgement.judge_noise(noise_n(rest), known),
        judgement.judge_resolution(count_n(rest), len(rest), known),
        _judge_drift(_slope(rest), zero, known),
    )


def why_no_force(found: Mapping[Item, Finding], rest: Trace, known: Known) -> str:
    """Return why no force is tried behind these readings and what was found in them; empty where it is."""
    if known.settings.self_test and known.settings.self_test.force_n <= 0.0:
        return "self_test.force_n is 0: nothing moves"
    if found[Item.RESOLUTION].verdict is FAILED:
        return "the cell repeats itself" if is_constant(rest) else "the cell's counts are too coarse"
    if _drift_verdict(_slope(rest), known) is FAILED:
        return "the zero moves"  # a force would, too, and its sign might seem to be wrong
    if found[Item.ZERO].verdict is FAILED and mean_n(rest) > 0.0:
        return "the zero is off: tare first"  # below 0 it may be the sign
    return ""


def _slope(rest: Trace) -> Slope:
    """How fast the reading moves: of one that falls in the second half, for in the first a force may still leave."""
    slope = fit_slope(rest)
    return slope if slope.n_per_s >= 0.0 else fit_slope(rest[len(rest) // 2 :])


def _drift_verdict(slope: Slope, known: Known) -> SelfTestVerdict:
    assert known.settings.self_test
    zero_n = known.settings.self_test.zero_n
    moves_n_per_s = abs(slope.n_per_s) - _SURE_SIGMAS * slope.error_n_per_s
    return judgement.above(moves_n_per_s, _DRIFT_WARNS * zero_n, _DRIFT_FAILS * zero_n)


def _judge_drift(slope: Slope, zero: Finding, known: Known) -> Finding:
    """How fast the zero moves, beside where it is."""
    assert known.settings.self_test
    if (verdict := _drift_verdict(slope, known)) is PASSED:
        return zero
    zero_n = known.settings.self_test.zero_n
    bounds = judgement.bounds(_DRIFT_WARNS * zero_n, _DRIFT_FAILS * zero_n, "N/s", 2)
    why = f"{bounds}: cell or amplifier drifts, or something still moves the tool"
    return Finding(Item.ZERO, max(verdict, zero.verdict), f"{zero.text}; it moves by {slope.n_per_s:+.2f} N/s, {why}")
