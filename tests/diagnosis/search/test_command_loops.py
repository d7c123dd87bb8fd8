"""The compiled search for steps of the command, against the plain way: numpy's sine, rounding, and a filter row by row."""

import numpy as np
import pytest

from gateway.diagnosis.search.command_loops import ForceChain, fill_first_waves, fill_rounding_errors, sine_of_turns

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


def test_a_first_wave_is_likened_about_its_mean():
    told = np.random.default_rng(2).normal(size=COMMAND_V.size)
    alike, squares = np.empty(STEPS_V.size), np.empty(STEPS_V.size)
    fill_first_waves(COMMAND_V, told, STEPS_V, CHAIN, (alike, squares))
    for k, step_v in enumerate(STEPS_V):
        wave = force_v(COMMAND_V - step_v / np.pi * np.sin(2.0 * np.pi * COMMAND_V / step_v)) - force_v(COMMAND_V)
        wave -= wave.mean()
        assert alike[k] == pytest.approx(told @ wave, abs=1e-6)
        assert squares[k] == pytest.approx(wave @ wave, rel=1e-6)
