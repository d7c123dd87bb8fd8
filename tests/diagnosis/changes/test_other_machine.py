"""A recording of something else, given for one of the same machine: it is doubted, and what has only changed is not."""

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from gateway.catalogue.effect import Effect
from gateway.diagnosis import Measurement, Options, find_changes
from gateway.diagnosis.changes.other_machine import doubt_machine
from gateway.diagnosis.notes import recording_notes
from tests.diagnosis.changes.foreign_rig import Wish, record

DURATION_S = 6.0
FEW = ("leak", "presliding", "creep", "slew-limit", "dead-band", "sensor-quadratic", "coulomb-friction")
"""Effects that there may be: to search for all takes seconds, and is not asked about here."""


@pytest.fixture(autouse=True)
def few_effects_are_searched_for(monkeypatch: pytest.MonkeyPatch) -> None:
    for place, name in (("diagnose", "effects_to_search"), ("changes.compare_recordings", "change_effects")):
        module = import_module(f"gateway.diagnosis.{place}")
        monkeypatch.setattr(module, name, few_of(getattr(module, name)))


def few_of(effects: Callable[..., tuple[Effect, ...]]) -> Callable[..., tuple[Effect, ...]]:
    return lambda *given: tuple(effect for effect in effects(*given) if effect.name in FEW)


def unrelated() -> Measurement:
    """A force that goes its own way."""
    time_s, rng = 0.01 * np.arange(1500), np.random.default_rng(3)
    wander_n = sum(2.5 * np.sin(rate * time_s + rate) for rate in (0.91, 1.73, 3.1, 5.3))
    return Measurement(
        name="unrelated.csv",
        time_s=time_s,
        force_n=20.0 + wander_n + rng.normal(0.0, 0.3, time_s.size),
        usable=np.ones(time_s.size, dtype=bool),
        repeated=np.zeros(time_s.size, dtype=bool),
        command_v=3.0 + 2.0 * np.sin(2.7 * time_s),
    )


@pytest.mark.long
@pytest.mark.parametrize("is_old", [True, False], ids=["given as the old one", "given as the new one"])
def test_a_file_of_something_else_is_doubted(is_old: bool) -> None:
    """`Something has changed on this machine` was all that its answer said."""
    own, _ = record(Wish(seed=3, duration_s=DURATION_S))
    new, old = (own, unrelated()) if is_old else (unrelated(), own)
    found = find_changes([new], [old], None, Options())
    assert found.notes and found.notes[0].startswith("unrelated.csv: drive and model explain ")


def test_a_short_file_of_something_else_is_doubted_by_the_zero_that_its_model_needs() -> None:
    """In four seconds three effects explained it, with a zero of -68 million newtons, and that was told as an offset of it."""
    own, _ = record(Wish(seed=3, duration_s=DURATION_S))
    time_s, rng = 0.01 * np.arange(400), np.random.default_rng(3)
    short = replace(
        unrelated(),
        time_s=time_s,
        force_n=40.0 - 5.0 * time_s + rng.normal(0.0, 0.1, time_s.size),
        usable=np.ones(time_s.size, dtype=bool),
        repeated=np.zeros(time_s.size, dtype=bool),
        command_v=2.0 + 2.0 * np.sin(2.0 * time_s),
    )
    found = find_changes([own], [short], None, Options())
    assert any("unrelated.csv" in note and "same machine" in note for note in found.notes), found.notes


@pytest.mark.parametrize(("zero_n", "doubts"), [(390.0, 0), (420.0, 1), (-420.0, 1)])
def test_a_zero_far_beyond_all_readings_is_no_machines(zero_n: float, doubts: int) -> None:
    short = unrelated()
    short.force_n[:] = np.linspace(0.0, 40.0, short.rows)
    notes = list(recording_notes([short], [zero_n], 0.1))
    assert sum("same machine" in note for note in notes) == doubts


@pytest.mark.long
def test_a_machine_that_has_changed_is_not_doubted() -> None:
    old, _ = record(Wish(seed=103, duration_s=DURATION_S))
    new, _ = record(Wish(seed=3, effect="leak", size=2.0, duration_s=DURATION_S))
    found = find_changes([new], [old], None, Options())
    assert not any("same machine" in note for note in found.notes)


@pytest.mark.parametrize(("left_n", "doubts"), [(2.0, 0), (3.0, 1)])
def test_from_half_of_the_variance_on_it_is_the_machines(left_n: float, doubts: int) -> None:
    assert len(doubt_machine([unrelated()], left_n)) == doubts


def test_a_force_that_is_held_moves_by_its_noise_alone() -> None:
    held = unrelated()
    held.force_n[:] = 12.0 + np.random.default_rng(5).normal(0.0, 0.1, held.rows)
    assert doubt_machine([held], 0.1) == () == doubt_machine([], 1.0)
