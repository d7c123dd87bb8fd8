"""A quiet recording stays quiet wherever it begins; what is remembered at its first row is fitted, and no row is left out."""

import numpy as np
import pytest

from gateway.diagnosis import Options, Verdict, diagnose
from gateway.diagnosis.bench.bench import bench_of
from gateway.diagnosis.model_fit.base_fit import DEFAULT_PLANT, base_parameters, fit_base
from gateway.diagnosis.noise.whitening import white_whitener
from tests.diagnosis.begun_anywhere import BEGINNINGS, COLOURS, NOISE_N, begun


@pytest.mark.sampled
@pytest.mark.parametrize("beginning", BEGINNINGS)
def test_the_base_model_leaves_the_noise_from_the_first_row_on(beginning: str) -> None:
    """The first second is no worse than the rest, by the root mean square of 100 readings; a mass rings after steps."""
    bench = bench_of([begun(beginning, 1, lasts_s=15.0)])
    assert bench.judged.all()
    whiten = white_whitener(bench, bench.measured_n)
    fitted = fit_base(bench, DEFAULT_PLANT, base_parameters(bench, frozenset()), whiten)
    assert np.std(fitted.residual_n) < 1.15 * NOISE_N
    assert np.sqrt(np.mean(fitted.residual_n[:100] ** 2)) < 1.3 * NOISE_N


def assert_quiet(beginning: str, seed: int, colour: str, floor_n: float | None) -> None:
    found = diagnose([begun(beginning, seed, colour)], None, Options(noise_floor_n=floor_n))
    assert found.causes == (), [(cause.name, cause.gain) for cause in found.causes]
    assert found.leftover == (), found.leftover
    assert found.verdict is Verdict.NOTHING_FOUND


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("beginning", "seed", "colour"),
    [("in a stroke", 3, "white"), ("after a wiggle", 9, "lorentzian"), ("in a stroke", 21, "lorentzian")],
)
def test_a_quiet_recording_that_begins_amid_motion_is_quiet(beginning: str, seed: int, colour: str) -> None:
    """The slow noise of the latter two was called warm-up and command-quantisation: its level was taken for a third of what
    it is, for a hundred candidates together leave next to nothing of it."""
    assert_quiet(beginning, seed, colour, None)


@pytest.mark.long
@pytest.mark.parametrize("colour", COLOURS)
def test_no_beginning_is_a_cause(colour: str) -> None:
    """Thirty recordings of each colour, the floor given for half of them. On 108 others of each colour one was named, a white
    one: the ringing of a mass, which a replay leaves out, as slew-limit."""
    named = []
    for seed in range(10):
        for place, beginning in enumerate(BEGINNINGS):
            if COLOURS[(seed + place) % 2] == colour:
                options = Options(noise_floor_n=NOISE_N if (seed // 2 + place) % 2 else None)
                found = diagnose([begun(beginning, seed, colour)], None, options)
                named += [(beginning, seed, cause.name) for cause in found.causes]
    assert named == []
