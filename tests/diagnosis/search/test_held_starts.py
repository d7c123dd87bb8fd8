"""A lost sign and a force that friction holds at first look alike in a rest: both are asked, and the better one stands."""

from dataclasses import replace

import numpy as np

from gateway.diagnosis import BY_NAME, Measurement, Options, diagnose
from gateway.diagnosis.diagnose import prepare_search
from gateway.diagnosis.model_fit.base_fit import DEFAULT_PLANT
from gateway.diagnosis.model_fit.initial_state import with_known_rests
from gateway.diagnosis.model_fit.levenberg_marquardt import FitProblem
from gateway.diagnosis.search.hints import search_hints
from gateway.diagnosis.search.model_comparison import Competitors, compare_effects
from gateway.twin.plant import Plant
from tests.diagnosis.machine import MACHINE, command_v, measurement, readings_n, times_s

LOST = replace(MACHINE, cell=replace(MACHINE.cell, zero_n=-0.25, sign_lost=1.0))
PLAY = replace(MACHINE, contact=replace(MACHINE.contact, lost_n=0.4))


def recording_of(machine: Plant, noise_of_n: float) -> Measurement:
    time_s = times_s(30.0)
    volts = command_v(time_s)
    noise_n = np.random.default_rng(4).normal(0.0, noise_of_n, time_s.size)
    return measurement(time_s, volts, readings_n(machine, time_s, volts, {}) + noise_n, {})


def test_a_lost_sign_is_asked_beside_a_rest_where_the_base_model_holds_a_force() -> None:
    """It promises nothing beside the held force; begun there only, it was never tried, and another name took its work."""
    recording = recording_of(LOST, 0.02)
    start = prepare_search([recording], DEFAULT_PLANT, Options())
    assert with_known_rests(start.bench, FitProblem(start.base.parameters, start.base.free)), "a force is held"
    hints = search_hints(start.bench, start.base, start.whiten)
    rivals = Competitors([BY_NAME["sign-loss"], BY_NAME["backlash"]], hints)
    found = compare_effects(start.bench, start.base, rivals, start.whiten)
    assert found.winner.effect.name == "sign-loss"
    assert found.winner.gain > 10.0
    assert found.winner.fitted.parameters.plant.cell.zero_n == 0.0
    assert abs(found.winner.fitted.parameters.offsets_n[0] + 0.25) < 0.05


def test_lost_motion_that_friction_may_hold_at_first_is_told_as_unseen() -> None:
    """The slide never comes back to no force: a held start says all that the play does, and silence would be an all-clear."""
    found = diagnose([recording_of(PLAY, 0.1)])
    why = {each.name: each.why for each in found.not_identifiable}
    assert found.causes == ()
    assert "friction holds at the first row" in why["backlash"]
    assert "backlash" not in {each.name for each in diagnose([recording_of(MACHINE, 0.1)]).not_identifiable}
