"""The power is cut behind any write: whoever reads the directory afterwards finds the old or the new, and all that was told."""

from itertools import product
from pathlib import Path
from random import Random

import pytest

from gateway.calibrations.store import CalibrationStore
from gateway.processes.state_directory import put_back
from tests.calibrations.coefficients import calibration
from tests.disk.acts.acts import Act, AuditedWrites
from tests.disk.acts.all_acts import SYNCED
from tests.disk.acts.file_acts import Restored
from tests.disk.power_cut import JournaledDisk
from tests.disk.test_failing_calls import try_once
from tests.disk.watched_disk import watching

CUTS = 12
SEEDS = 5
"""In the push gate so many cuts of each act, all of those that change little, and the one behind all of it; with --long all of
them, each with so many mixtures of what was not synced."""


def journal(act: Act) -> JournaledDisk:
    """What the act does to the disk."""
    act.prepare()
    disk = JournaledDisk(act.state)
    with watching(disk):
        act.run(disk.say)
    assert disk.said and disk.changes
    return disk


@pytest.mark.parametrize("kind_of_act", SYNCED)
def test_after_a_power_cut_it_is_the_old_or_the_new_and_what_was_said_stays(
    fast_folder: Path, kind_of_act: type[Act], budget: int
) -> None:
    state = fast_folder / "state"
    state.mkdir()
    disk = journal(kind_of_act(state))
    every = range(len(disk.changes) + 1)
    cuts = every if budget > 1 else sorted({every[-1], *Random(1).sample(every, min(CUTS, len(every)))})
    count = 0
    for seed in range(SEEDS if budget > 1 else 1):
        for cut in cuts:
            for mode, tree in disk.states(cut, seed):
                count += 1
                after = kind_of_act(fast_folder / f"{seed}-{cut}-{mode}")
                tree.write_to(after.state)
                said = disk.said_before(cut)
                try:
                    after.check(said)
                    again: list[object] = []
                    assert try_once(after, again) is None, "cannot go on"
                    after.check(again)
                except Exception as error:
                    place = disk.changes[cut - 1] if cut else "before all"
                    raise AssertionError(f"cut behind change {cut} ({place}), {mode}, {said} were told") from error
    print(f"{count} states after cuts behind {len(disk.changes)} changes")
    assert count >= len(cuts)


def test_what_is_stored_in_a_folder_whose_maker_was_killed_outlives_a_power_cut(fast_folder: Path) -> None:
    """Nobody has synced the folder's own name."""
    (state := fast_folder / "state").mkdir()
    disk = JournaledDisk(state)
    with watching(disk):
        (state / "calibrations").mkdir()
        number = CalibrationStore(state).add(calibration(1))
    for mode, tree in disk.states(len(disk.changes), 0):
        tree.write_to(fast_folder / mode)
        assert CalibrationStore(fast_folder / mode).numbers() == [number]


def test_what_is_stored_in_a_state_directory_that_is_made_for_it_outlives_a_power_cut(fast_folder: Path) -> None:
    """Of a fresh rig neither it nor the folder of all rigs is there."""
    (home := fast_folder / "home").mkdir()
    disk = JournaledDisk(home)
    with watching(disk):
        number = CalibrationStore(home / "force-gateway" / "demo").add(calibration(1))
    for mode, tree in disk.states(len(disk.changes), 0):
        tree.write_to(fast_folder / mode)
        assert CalibrationStore(fast_folder / mode / "force-gateway" / "demo").numbers() == [number], mode


class FirstAuditedWrite(AuditedWrites):
    BATCHES = 1


def test_a_power_cut_while_an_audit_begins_is_not_called_tampering(fast_folder: Path) -> None:
    """Its head, its first file's name and its first line come about one after the other, and any of them may be lost."""
    (fast_folder / "state").mkdir()
    disk = journal(FirstAuditedWrite(fast_folder / "state"))
    for cut, seed in product(range(len(disk.changes) + 1), range(8)):
        for mode, tree in disk.states(cut, seed):
            if seed and mode != "some":
                continue
            after = FirstAuditedWrite(fast_folder / f"{seed}-{cut}-{mode}")
            tree.write_to(after.state)
            after.check(disk.said_before(cut))
            again: list[object] = []
            assert try_once(after, again) is None, (cut, mode)
            after.check(again)


def test_a_state_that_a_restore_had_set_aside_is_put_back_by_the_next_start(fast_folder: Path) -> None:
    """Wherever the power went: else the gateway would begin anew, and its calibrations would stand beside it."""
    state = fast_folder / "state"
    state.mkdir()
    disk, set_aside = journal(Restored(state)), 0
    for cut in range(len(disk.changes) + 1):
        for mode, tree in disk.states(cut, 0):
            cell = fast_folder / f"{cut}-{mode}" / "cell"
            tree.write_to(cell.parent)
            if not cell.exists():
                set_aside += 1
                assert put_back(cell) and cell.exists(), f"cut behind change {cut}, {mode}"
    assert set_aside
