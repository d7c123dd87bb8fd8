"""Another plant is taken into use once, and not under force; what becomes of it is told."""

from pathlib import Path

import pytest

from gateway.plants.store import NumberedPlant, PlantStore, Provenance
from gateway.profiles import Rig
from gateway.profiles.kinds.plants import load_shipped_plant
from gateway.service.running_rig.rig_plants import PlantEdges, RigPlants
from tests.service.rigs import demo


class Edges:
    """Stands for the control. is_free: nothing presses."""

    def __init__(self, state: Path) -> None:
        self.is_free, self.now_s = True, 10.0
        self.taken: list[Rig] = []
        self.said: list[str] = []
        self.failed: list[tuple[str, str]] = []
        self.plants = RigPlants(demo(), state)
        self.plants.serve(
            PlantEdges(
                lambda: self.is_free,
                self.taken.append,
                lambda: self.now_s,
                lambda _, text: self.said.append(text),
                lambda what, sentence: self.failed.append((what, sentence)),
            )
        )


@pytest.fixture
def edges(tmp_path: Path) -> Edges:
    return Edges(tmp_path)


def test_what_waits_for_the_end_of_a_force_is_taken_once_it_is_over_and_once(edges: Edges) -> None:
    edges.is_free = False
    edges.plants._on_selected(demo())
    for _ in range(3):
        edges.plants.take_waiting()
    assert (edges.taken, edges.plants.status()["waiting"]) == ([], 0)
    edges.is_free, edges.now_s = True, 20.0
    for _ in range(3):
        edges.plants.take_waiting()
    assert len(edges.taken) == 1
    status = edges.plants.status()
    assert (status["waiting"], status["since_s"], status["failed"]) == (None, 20.0, False)
    assert edges.failed == []


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(28, "No space left on device"), "E431 No space left"),
        (OSError(13, "Permission denied", "/cell/plants"), "E431 /cell/plants: Permission denied"),
        (KeyError("x"), "A499"),
    ],
)
def test_a_change_that_came_to_nothing_is_told_as_failed_and_the_plant_stays(
    edges: Edges, error: Exception, words: str
) -> None:
    edges.plants._on_selected(error)
    status = edges.plants.status()
    assert status["failed"] and status["said"].startswith(words) and status["said"].endswith("stays in use")
    assert edges.taken == [] and status["since_s"] == 10.0
    assert edges.failed == [("", status["said"])]


def test_a_change_that_came_to_nothing_takes_away_none_that_waits(edges: Edges) -> None:
    """It is on the disk: a restart would find it, and until then control would know another plant than the disk."""
    edges.is_free = False
    edges.plants._on_selected(waits := demo())
    edges.plants._on_selected(OSError(28, "No space left on device"))
    edges.is_free = True
    edges.plants.take_waiting()
    assert edges.taken == [waits]


def test_a_rollback_does_not_go_to_a_plant_that_waited_and_was_never_in_use(edges: Edges, tmp_path: Path) -> None:
    """Behind 2, which took the place of 1 while both waited, it went to 1, which nobody had seen at work."""
    provenance = Provenance(made_utc="2026-11-22T17:30:00Z", version="1", rig="demo", start="demo", file="bench.yaml")
    for _ in range(2):
        PlantStore(tmp_path).add(
            NumberedPlant(number=0, profile=load_shipped_plant("paper-slide"), provenance=provenance)
        )
    edges.plants.run_in_background = lambda work, done: done(work())
    edges.is_free = False
    for number in (1, 2):
        edges.plants.answer({"use": number})
    edges.is_free = True
    edges.plants.take_waiting()
    assert edges.plants.status()["active"] == 2
    edges.plants.answer({"rollback": True})
    assert edges.plants.status()["active"] == 0, "the rig's own, as before"
    edges.plants.answer({"rollback": True})
    assert edges.plants.status()["active"] == 2
    assert list(edges.plants.status()["ends"]) == ["1", "2", "3", "4"], "each is told its own, whoever comes behind it"


def test_one_change_at_a_time(edges: Edges) -> None:
    """Two threads would select, and what is told as in use be the one that ended last."""
    work: list[object] = []
    edges.plants.run_in_background = lambda begun, done: work.append(begun)
    assert edges.plants.answer({"do": "plant", "use": 0})["busy"]
    for request in ({"use": 0}, {"rollback": True}):
        with pytest.raises(ValueError, match="plant use 0 is under way"):
            edges.plants.answer({"do": "plant", **request})
    assert len(work) == 1 and edges.plants.answer({"do": "plant"})["job"] == 1
