"""Wider scenes: serial faces, certificates, more spellings, other leases, standstills."""

import pytest

from tests.service.running_rig.masters.drawn.test_drawn_programs import STEPS
from tests.service.running_rig.masters.drawn.wide_scene import WideScene

SEEDS = 50000, 50100, 50200, 50300, 50400, 50500


@pytest.mark.parametrize("first", SEEDS)
def test_what_hangs_begins_nothing_on_any_face_and_what_goes_on_has_its_force(first: int, budget: int) -> None:
    for seed in range(first, first + budget):
        scene = WideScene(seed)
        scene.play(STEPS)
        assert scene.rig.trace
