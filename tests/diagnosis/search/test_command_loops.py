"""The compiled search for steps of the command, against the plain way: numpy's sine, rounding, and a filter row by row."""

import numpy as np
import pytest

from gateway.diagnosis.search.command_loops import (
    ForceChain,
    correlate_dead_bands,
    correlate_roundings,
    fill_first_waves,
    fill_rounding_errors,
    sine_of_turns,
)
from gateway.diagnosis.search.command_search import _BANDS_V, _likely_bands_v

CHAIN = ForceChain(share=0.2, play_v=0.15)
COMMAND_V = 3.0 + 0.2 * np.cumsum(np.random.default_rng(1).normal(size=300))
STEPS_V = np.array([0.02, 0.25, 0.7])


def force_v(given_v):
    late = state = 0.0
    found = []
    for value in given_v:
        state = min(max(state, late - 0.5 * CHAIN.play_v), late + 0.5 * CHAIN.play_v)
        found.append(state)
        late += CHAIN.share * (value - late)
    return np.array(found)


def test_the_sine_is_that_of_numpy():
    turns = np.linspace(-3.0, 3.0, 4001)
    np.testing.assert_allclose([sine_of_turns(one) for one in turns], np.sin(2.0 * np.pi * turns), atol=6e-8)


def test_a_step_makes_of_the_force_what_its_rounding_makes():
    columns_v = np.empty((STEPS_V.size, COMMAND_V.size))
    fill_rounding_errors(COMMAND_V, STEPS_V, CHAIN, columns_v)
    for column_v, step_v in zip(columns_v, STEPS_V, strict=True):
        expected = force_v(np.round(COMMAND_V / step_v) * step_v) - force_v(COMMAND_V)
        np.testing.assert_allclose(column_v, expected, atol=1e-12)


def first_wave(size_v):
    return COMMAND_V - size_v / np.pi * np.sin(2.0 * np.pi * COMMAND_V / size_v)


def rounded(size_v):
    return np.round(COMMAND_V / size_v) * size_v


def noticed(size_v):
    found = [0.0]
    for value in COMMAND_V:
        found.append(value if abs(value - found[-1]) > size_v else found[-1])
    return np.array(found[1:])


@pytest.mark.parametrize(
    ("fill", "given_v"),
    [(fill_first_waves, first_wave), (correlate_roundings, rounded), (correlate_dead_bands, noticed)],
    ids=["first wave", "rounding", "dead band"],
)
def test_what_a_size_makes_of_the_force_is_likened_about_its_mean(fill, given_v):
    told = np.random.default_rng(2).normal(size=COMMAND_V.size)
    alike, squares = np.empty(STEPS_V.size), np.empty(STEPS_V.size)
    fill(COMMAND_V, told, STEPS_V, CHAIN, (alike, squares))
    for k, size_v in enumerate(STEPS_V):
        column = force_v(given_v(size_v)) - force_v(COMMAND_V)
        column -= column.mean()
        assert alike[k] == pytest.approx(told @ column, abs=1e-6)
        assert squares[k] == pytest.approx(column @ column, rel=1e-6)


def test_dead_bands_that_decide_alike_are_tried_by_their_ends_and_not_as_neighbours() -> None:
    """On stairs the likeliest twenty of 160 would be one."""
    alike = np.repeat([3.0, 9.0, 1.0, 8.0], 40)
    tried = _likely_bands_v(alike).tolist()
    assert tried[:5] == _BANDS_V[[40, 50, 60, 69, 79]].tolist()
    assert {_BANDS_V[40 * kind + end] for kind in range(4) for end in (0, 39)} <= set(tried)
    assert _likely_bands_v(np.arange(160.0)).tolist() == _BANDS_V[:-21:-1].tolist()
