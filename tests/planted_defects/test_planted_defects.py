"""The suite would notice: each planted defect is seen by tests near it, within the push gate's own budget.

All of them take some minutes (--long); the push gate plants two, and asks of the others that their places still exist.
"""

from pathlib import Path

import pytest

from tests.planted_defects.copied_tree import ROOT, copy_tree, failing_test, planted
from tests.planted_defects.defects import (
    clients,
    commands,
    devices,
    faces,
    force,
    on_disk,
    page_and_telemetry,
    processes,
    registers,
    running_rig,
    stored,
    supervision,
    told,
)
from tests.planted_defects.defects.defect import Defect

ROOMS = (
    force,
    supervision,
    commands,
    running_rig,
    processes,
    registers,
    faces,
    devices,
    clients,
    page_and_telemetry,
    stored,
    on_disk,
    told,
)
ALL = tuple(one for room in ROOMS for one in room.DEFECTS)
IN_GATE = ("the slew limit is dropped", "a damaged calibration is read")


def every_defect() -> list[object]:
    return [pytest.param(one, id=one.name, marks=() if one.name in IN_GATE else pytest.mark.long) for one in ALL]


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_tree(tmp_path_factory.mktemp("planted"))


@pytest.mark.parametrize("defect", every_defect())
def test_a_planted_defect_is_seen(tree: Path, defect: Defect) -> None:
    with planted(tree, defect):
        seen_by = failing_test(tree, defect.tests)
    print(f"{defect.name}: seen by {seen_by}")
    assert seen_by is not None, f"{defect.name}: nobody sees it among {', '.join(defect.tests)}"


@pytest.mark.long
def test_without_a_defect_the_same_tests_pass(tree: Path) -> None:
    asked = tuple(dict.fromkeys(place for one in ALL for place in one.tests))
    assert failing_test(tree, asked) is None


def test_every_defect_has_its_place_and_its_tests() -> None:
    """A change of the source takes the place of a defect away in silence."""
    lost = [one.name for one in ALL if (ROOT / "gateway" / one.file).read_text(encoding="utf-8").count(one.before) != 1]
    assert lost == []
    assert [place for one in ALL for place in one.tests if not (ROOT / "tests" / place).exists()] == []
    assert len({one.name for one in ALL}) == len(ALL) >= 40
