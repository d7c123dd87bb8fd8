"""The n-th call to the disk fails, for n = 1, 2, ... until nothing fails any more, of everything that is stored."""

from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from tests.disk.acts.acts import Act
from tests.disk.acts.all_acts import REFUSED
from tests.disk.acts.file_acts import Restored
from tests.disk.failing_disks import FailingDisk, describe
from tests.disk.watched_disk import watching

STRIDE = 19
"""In the push gate every so many n, of each kind of failure others; all of them with --long."""


def disks(folder: Path, kind: str, stride: int) -> Iterator[tuple[Path, FailingDisk]]:
    """A fresh directory for each n, until one has met no failure."""
    for n in count(1 + 3 * FailingDisk.KINDS.index(kind) % stride, stride):
        state = folder / str(n)
        state.mkdir()
        disk = FailingDisk(state, kind, n)
        yield state, disk
        if not disk.has_failed and len(disk.calls) < n:
            return


def try_once(act: Act, said: list[Any]) -> Exception | None:
    """What refused it; anything but a refusal that is meant for people is raised."""
    try:
        act.run(said.append)
    except act.refusals as refusal:
        return refusal
    return None


@pytest.mark.parametrize("kind", FailingDisk.KINDS)
@pytest.mark.parametrize("kind_of_act", REFUSED)
def test_whatever_call_fails_nothing_is_half_and_what_was_said_stays(
    fast_folder: Path, kind_of_act: type[Act], kind: str, budget: int
) -> None:
    refused = 0
    for state, disk in disks(fast_folder, kind, 1 if budget > 1 else STRIDE):
        act, said, again = kind_of_act(state), [], []
        act.prepare()
        with watching(disk):
            refusal = try_once(act, said)
        refused += refusal is not None
        assert str(refusal), "a refusal without words"
        try:
            act.check(said)
            assert try_once(act, again) is None, "the disk is well again"
            act.check(again)
        except Exception as error:
            raise AssertionError(f"{describe(disk)}; {said} were acknowledged") from error
    print(f"{len(disk.calls)} calls, {refused} refusals")
    assert refused or budget == 1


def test_a_restore_that_one_call_has_failed_leaves_the_state_where_it_was(fast_folder: Path) -> None:
    """Also where it has been set aside already: one call alone does not take it away."""
    refused = 0
    for state, disk in disks(fast_folder, "once", 1):
        act = Restored(state)
        act.prepare()
        with watching(disk):
            refused += try_once(act, []) is not None
        assert (state / "cell").is_dir(), describe(disk)
    assert refused > 20
