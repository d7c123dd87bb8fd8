"""Thousands of drawn scenes of each line that the gateway speaks on, with the device of every shipped profile at its other end.

A scene is one seed: its device, speed and host, and what befalls wire and device. The laws are the witnesses' own.
"""

from collections.abc import Callable

import pytest

from tests.gate.budgets import scenes
from tests.service.running_rig.lines.drawn.cell_scene import CellScene
from tests.service.running_rig.lines.drawn.draws import CELLS, OUTPUTS, VALVES
from tests.service.running_rig.lines.drawn.output_scene import OutputScene
from tests.service.running_rig.lines.drawn.valve_scene import ValveScene

Scene = OutputScene | CellScene | ValveScene
SCENES = {OutputScene: (OUTPUTS, 14), CellScene: (CELLS, 8), ValveScene: (VALVES, 20)}
"""How many of each profile, of which the push gate plays one in three."""
KEPT = 141, 304, 789, 872, 938, 1130, 1132, 1492, 1633, 1888, 1901, 2597, 7720, 10251, 11640, 15197
"""Of outputs, whichever they draw: each broke a law once."""


@pytest.mark.parametrize("kind", SCENES)
def test_behind_whatever_befell_it_a_line_is_at_peace_and_tells_no_lie(kind: Callable[..., Scene], budget: int) -> None:
    """Takes a third of a second of processor for each of them but the valve's."""
    profiles, count = SCENES[kind]  # type: ignore[index]
    drawn = [
        (profile, seed)
        for number, profile in enumerate(profiles)
        for seed in range(1000 * number, 1000 * number + scenes(count, budget))
    ]
    played = [(profile.name, seed, kind(seed, profile).run().broken) for profile, seed in drawn]
    assert [scene for scene in played if scene[2]] == []


@pytest.mark.parametrize("seed", KEPT)
def test_a_scene_that_once_broke_a_law_does_so_no_more(seed: int) -> None:
    assert OutputScene(seed).run().broken == []
