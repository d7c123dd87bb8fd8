"""A rig that is read again while the gateway runs: as it was, or not at all."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from gateway.profiles import kept_rig as module
from gateway.profiles import shipped_profiles_folder
from gateway.profiles.kept_rig import ChangedRigError, keep_rig, kept_rig, unchanged_rig

DEMO = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "cell.yaml"
    path.write_text(DEMO, encoding="utf-8")
    return path


def test_a_rig_whose_files_are_as_they_were_is_read(file: Path) -> None:
    first = unchanged_rig(str(file), None, simulated=True)
    assert unchanged_rig(str(file), first.fingerprint, simulated=True) == first


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (DEMO.replace("lease_s: null", "lease_s: 0.5"), "have changed"),
        (DEMO + "# a comment\n", "have changed"),
        ("name: [", "have faults now"),
        ("", "have faults now"),
        (None, "have faults now"),
    ],
)
def test_a_rig_whose_files_have_changed_is_another_one(file: Path, text: str | None, words: str) -> None:
    """The page that was started again went by the lease of the edited file: each enable of its ended as a lost master."""
    fingerprint = unchanged_rig(str(file), None, simulated=True).fingerprint
    if text is None:
        file.unlink()
    else:
        file.write_text(text, encoding="utf-8")
    with pytest.raises(ChangedRigError, match=f"W247 .* {words}"):
        unchanged_rig(str(file), fingerprint, simulated=True)


@pytest.fixture
def memory() -> Iterator[int]:
    descriptor = os.memfd_create("kept rig")
    yield descriptor
    os.close(descriptor)


def test_what_the_first_has_left_in_the_memory_outlives_the_files(file: Path, memory: int) -> None:
    """Behind the death of the process that had read the rig a restart took the edited file, and the lease was gone."""
    first = kept_rig(str(file), simulated=True, memory=memory)
    file.write_text(DEMO.replace("force_max_n: 60", "force_max_n: 50"), encoding="utf-8")
    assert kept_rig(str(file), simulated=True, memory=memory) == first
    assert kept_rig(str(file), simulated=True).control.limits.force_max_n == 50.0


@pytest.mark.parametrize("left", [b"", bytes(8), bytes(8) + b"the beginning of a rig"])
def test_what_nobody_came_to_the_end_of_is_read_from_the_files(file: Path, memory: int, left: bytes) -> None:
    """Whoever is killed while it writes has left no length."""
    os.pwrite(memory, left, 0)
    first = kept_rig(str(file), simulated=True, memory=memory)
    file.unlink()
    assert kept_rig(str(file), simulated=True, memory=memory) == first


def test_a_memory_that_takes_nothing_costs_no_start(file: Path, tmp_path: Path) -> None:
    (tmp_path / "full").touch()
    with (tmp_path / "full").open("rb") as full:
        rig = kept_rig(str(file), simulated=True, memory=full.fileno())
        assert rig.name == "demo"
        file.write_text(DEMO.replace("name: demo", "name: other"), encoding="utf-8")
        assert kept_rig(str(file), simulated=True, memory=full.fileno()).name == "other"


@pytest.mark.parametrize("written", [0.5, 1.0])
def test_a_rig_counts_as_kept_once_all_of_it_is_there(
    file: Path, memory: int, monkeypatch: pytest.MonkeyPatch, written: float
) -> None:
    """Whoever dies between two writes, or gets half of one: a length before its rig would end each restart."""
    write, lengths = os.pwrite, list[int]()

    def write_part(descriptor: int, data: bytes, at: int) -> int:
        lengths.append(int.from_bytes(os.pread(descriptor, 8, 0)))
        return write(descriptor, data[: int(len(data) * written)] if at else data, at)

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", write_part)
        kept_rig(str(file), simulated=True, memory=memory)
    assert lengths == [0] * len(lengths), "no length while the rig is written"
    assert bool(int.from_bytes(os.pread(memory, 8, 0))) == (written == 1.0)
    assert kept_rig(str(file), simulated=True, memory=memory).name == "demo"


def test_a_rig_that_was_kept_for_a_simulation_is_not_the_real_one(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_kept", {})
    keep_rig(str(file), simulated=True)
    file.write_text(DEMO.replace("name: demo", "name: other"), encoding="utf-8")
    assert kept_rig(str(file), simulated=True).name == "demo"
    assert kept_rig(str(file), simulated=False).name == "other", "that one nobody has kept"


@pytest.mark.parametrize("text", [DEMO.replace("lease_s: null", "lease_s: 0.5"), "name: [", None])
def test_a_process_beside_control_goes_by_the_rig_that_runs_whatever_its_files_say(
    file: Path, memory: int, text: str | None
) -> None:
    """A page that was killed beside a half edited file was gone until the file was whole again."""
    first = kept_rig(str(file), simulated=True, memory=memory)
    if text is None:
        file.unlink()
    else:
        file.write_text(text, encoding="utf-8")
    assert unchanged_rig(str(file), first.fingerprint, simulated=True, memory=memory) == first
    with pytest.raises(ChangedRigError):
        unchanged_rig(str(file), "another", simulated=True, memory=memory)
