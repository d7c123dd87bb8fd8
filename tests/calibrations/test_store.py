"""Calibrations are old or new, never mixed; what is said to be stored is stored; what is damaged is named and passed over."""

import errno
import fcntl
import os
import threading
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest

from gateway.calibrations.store import UNKNOWN_N, CalibrationStore
from gateway.numbered_documents.selection import BUILT_IN, Selection
from gateway.numbered_documents.store import StoreError
from gateway.processes import durable_file
from gateway.profiles import load_calibration
from tests.calibrations.coefficients import calibration, mark_of
from tests.calibrations.failing_disk import disk
from tests.calibrations.slots import go_back, slot_number
from tests.calibrations.store_bench import OWN, active_mark, used_store


@pytest.fixture
def store(tmp_path: Path) -> CalibrationStore:
    return CalibrationStore(tmp_path / "state", OWN)


@pytest.fixture
def used(tmp_path: Path) -> CalibrationStore:
    return used_store(tmp_path / "state")


def files(store: CalibrationStore) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in store.directory.iterdir()} if store.directory.is_dir() else {}


# -- numbers and content


def test_numbers_grow_and_never_that_of_the_built_in_one(store):
    assert [store.add(calibration(mark)) for mark in (5, 6, 7)] == [2, 3, 4]
    assert [mark_of(store.load(number)) for number in (2, 3, 4, 1)] == [5, 6, 7, 1000]
    assert [entry.number for entry in store.list()] == [2, 3, 4]
    assert CalibrationStore(store.directory.parent).add(calibration(8)) == 5


def test_a_file_of_the_store_is_a_shipped_calibration_in_form_and_digits(store):
    odd = calibration(9, x1_v=7.0 + 1.0 / 3.0, blend_span_n=1e-05, name='née "x": \\ 😀', source="a # b: [c]")
    number = store.add(odd)
    path = store.directory / f"{number:04d}.yaml"
    assert load_calibration(path) == store.load(number) == replace(odd, number=number)
    assert path.read_text(encoding="utf-8").startswith("# crc32 ")


def test_a_calibration_that_could_not_be_read_back_is_not_stored(store):
    for bad in (
        {"rms_n": float("nan")},
        {"rising_handles_n": (0.0, 50.0)},
        {"rising_weights": (1.0, -1.0, 1.0)},
        {"name": "a\x85b"},
    ):
        with pytest.raises(StoreError, match="E432"):
            store.add(calibration(1, **bad))
    assert store.list() == []


def test_a_number_that_a_slot_still_speaks_of_is_not_given_again(used):
    (used.directory / "0003.yaml").unlink()
    assert used.add(calibration(4)) == 4


def test_the_last_number_is_the_last(store):
    store.add(calibration(1))
    (store.directory / "0002.yaml").rename(store.directory / "9999.yaml")
    assert store.add(calibration(2)) == 10_000
    assert store.load(10_000).number == 10_000
    (store.directory / "9999.yaml").rename(store.directory / "65534.yaml")
    assert store.add(calibration(2)) == 0xFFFF, "which a register can show"
    with pytest.raises(StoreError, match="the last number"):
        store.add(calibration(2))


def test_an_unknown_number_is_told_with_those_that_there_are(used):
    with pytest.raises(StoreError, match=r"E433 there is no calibration 7 in .*; there are: 1, 2, 3"):
        used.use(7)
    with pytest.raises(StoreError, match="none yet"):
        CalibrationStore(used.directory / "elsewhere").load(1)


# -- which one is in use


def test_nothing_stored_is_the_built_in_calibration(store):
    selected = store.find_selected()
    assert (selected.document, selected.selection, selected.notes) == (OWN, BUILT_IN, ())
    assert slot_number(store, 0) is None
    with pytest.raises(StoreError, match="nothing to go back to"):
        go_back(store)
    assert not store.directory.exists()


def test_use_and_rollback_go_to_and_fro(used):
    assert active_mark(used) == 3
    assert go_back(used).active == Selection(2, 0)
    assert active_mark(used) == 2
    assert go_back(used).active == Selection(3, 1)
    assert active_mark(used) == 3


def test_the_first_rollback_leads_to_the_built_in_one(store):
    store.use(store.add(calibration(2)))
    assert go_back(store).active == BUILT_IN
    assert active_mark(store) == 1000
    go_back(store)
    assert active_mark(store) == 2


def test_the_built_in_one_is_used_by_its_number_or_by_none(used):
    assert used.use(1).active == BUILT_IN
    used.use(3)
    assert used.use(None).active == BUILT_IN
    assert go_back(used).active.number == 3


def test_using_the_same_again_keeps_what_could_be_gone_back_to(used):
    used.use(3, 1)
    used.use(3)
    assert go_back(used).active.number == 2


def test_slots_hold_what_was_put_there_last(used):
    assert [slot_number(used, slot) for slot in range(8)] == [2, 3, None, None, None, None, None, None]
    used.use(3, 0)
    assert slot_number(used, 0) == 3
    assert used.previous() == Selection(2, None), "slot 0 holds another one now"
    for slot in (-1, 8):
        with pytest.raises(StoreError, match="slot"):
            used.use(3, slot)


def test_two_generations_are_kept(used):
    for number in (2, 3, 2, 3, 2):
        used.use(number)
    assert sorted(name for name in files(used) if name.startswith("active")) == ["active.000006", "active.000007"]


def test_threads_that_add_at_once_get_numbers_of_their_own(store):
    numbers: list[int] = []
    threads = [threading.Thread(target=lambda: numbers.append(store.add(calibration(5)))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(numbers) == list(range(2, 10))


# -- the disk


def commit(store: CalibrationStore, mark: int) -> None:
    store.use(store.add(calibration(mark)), 2)


@pytest.mark.parametrize("fresh", [True, False])
@pytest.mark.parametrize(("error", "short"), [(errno.ENOSPC, False), (errno.EIO, False), (errno.ENOSPC, True)])
def test_whatever_call_fails_the_set_is_the_old_one_or_the_new_one(tmp_path, error, short, fresh):
    """The n-th call fails, for n = 1, 2, ... until a commit meets no failure."""
    refused = 0
    for n in count(1):
        store = CalibrationStore(tmp_path / str(n), OWN)
        for mark in () if fresh else (2, 3):
            store.use(store.add(calibration(mark)), mark - 2)
        old = active_mark(store)
        with disk(n, error, short=short) as there:
            try:
                commit(store, 4)
                acknowledged = True
            except StoreError as failure:
                acknowledged = False
                refused += 1
                assert str(failure).startswith(f"E431 calibration not stored: {os.strerror(error)}")
        assert active_mark(store) == (4 if acknowledged else old), (n, there.calls[-1])
        assert slot_number(store, 2) == (store.find_selected().selection.number if acknowledged else None)
        assert not any(entry.fault for entry in store.list()) and not store.find_selected().notes
        commit(store, 5)
        assert active_mark(store) == 5
        assert not [name for name in files(store) if name.endswith(".new")]
        if len(there.calls) < n:
            break
    print(f"{n - 1} calls, {refused} of them refuse the commit when they fail")
    assert refused >= 10


def test_a_disk_that_stays_broken_changes_nothing_either(used):
    """From the n-th call on all fail, taking back included: old or new, and only in one place not what was said."""
    said_otherwise = []
    for n in count(1):
        with disk(n, lasting=True) as there:
            try:
                commit(used, 9)
                break
            except StoreError:
                pass
        found = active_mark(used)
        assert found in (3, 9)
        if found == 9:
            said_otherwise.append(there.calls[n - 1])
            used.use(3)
    assert said_otherwise == [("fsync", "calibrations")], "the name stands, and neither fsync nor unlink is to be had"


def test_stored_means_written_renamed_and_both_synced_in_this_order(used):
    """After a power cut as well: the file is on the disk before it has its name, the name before anybody is told."""
    with disk() as there:
        commit(used, 4)
    wanted = ("open", "write", "fsync", "rename")
    expected = []
    for name in ("0004.yaml.new", "active.000003.new"):
        expected += [("open", "state"), ("fsync", "state")]
        expected += [("open", "calibrations"), ("open", name), ("write", name), ("fsync", name), ("rename", name)]
        expected.append(("fsync", "calibrations"))
    assert [call for call in there.calls if call[0] in wanted] == expected


def test_a_new_directory_is_synced_into_its_parent(store):
    with disk() as there:
        store.add(calibration(2))
    made = there.calls.index(("mkdir", "calibrations"))
    kept = [call for call in there.calls[made + 1 :] if call[0] in ("write", "fsync")]  # root looks whose it is before
    assert kept[0] == ("fsync", "state")


def test_what_a_killed_writer_left_is_nothing_to_anybody(used):
    for name in ("0004.yaml.new", "active.000003.new", "0017.yaml.new"):
        (used.directory / name).write_bytes(b"half")
    assert active_mark(used) == 3
    assert [entry.number for entry in used.list()] == [2, 3]
    commit(used, 4)
    assert active_mark(used) == 4


def test_a_directory_that_may_not_be_read_is_said(used, monkeypatch):
    def refuse(*arguments: object, **options: object) -> int:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    with disk() as there:
        monkeypatch.setattr(there, "_counted", lambda what: refuse)
        selected = used.find_selected()
    assert selected.document == OWN
    assert "cannot be read: Permission denied" in selected.notes[0]


def test_one_that_is_looked_for_in_a_folder_that_may_not_be_read_is_refused_by_a_sentence(used, monkeypatch):
    """And not called unknown."""
    monkeypatch.setattr(Path, "iterdir", lambda path: os.scandir(os.devnull + "/"))
    with pytest.raises(StoreError, match=r"E432 .* cannot be read: Not a directory"):
        used.use(77)


# -- beside others


def test_whoever_keeps_the_store_locked_keeps_no_start_waiting_and_no_change_for_ever(used, monkeypatch):
    monkeypatch.setattr(durable_file, "_READER_BOUND_S", 0.03)
    monkeypatch.setattr(durable_file, "_WRITER_BOUND_S", 0.03)
    holder = os.open(used.directory, os.O_RDONLY)
    fcntl.flock(holder, fcntl.LOCK_EX)
    selected = CalibrationStore(used.directory.parent, OWN).find_selected()
    assert (mark_of(selected.document), selected.notes) == (3, ())
    before = files(used)
    for change in (lambda: used.add(calibration(4)), lambda: used.use(2)):
        with pytest.raises(StoreError, match=r"E431 .* another program has kept it locked for 0\.03 s"):
            change()
    assert files(used) == before
    os.close(holder)
    assert used.add(calibration(4)) == 4


def test_a_search_for_a_set_reads_no_upload_of_another_one(store):
    """Thousands of them, parsed, take the time of the loop in whose process they are."""
    for mark in (2, 3, 4):
        store.add(calibration(mark, rms_n=UNKNOWN_N, max_n=UNKNOWN_N, data_sha256=f"{mark:064x}"))
    measured = store.add(calibration(9))
    assert [number for number, _ in store.iterate_unchecked(f"{3:064x}")] == [measured, 3]
    assert [number for number, _ in store.iterate_unchecked(f"{8:064x}")] == [measured]
