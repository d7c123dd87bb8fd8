"""What is damaged is named and passed over; what was whole before it is used."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from gateway.calibrations.store import CalibrationStore
from gateway.numbered_documents import selection, store
from gateway.numbered_documents.selection import BUILT_IN
from gateway.numbered_documents.store import StoreError
from gateway.processes.durable_file import add_checksum, verify_checksum
from tests.calibrations.coefficients import calibration, mark_of
from tests.calibrations.slots import go_back
from tests.calibrations.store_bench import OWN, active_mark, used_store


@pytest.fixture
def used(tmp_path: Path) -> CalibrationStore:
    return used_store(tmp_path / "state")


def damages(data: bytes, rng: Random) -> Iterator[bytes]:
    """Torn, grown, altered in one bit, emptied, foreign."""
    yield from (data[:length] for length in sorted({0, 1, 9, len(data) // 2, len(data) - 1}))
    yield data + b"\n"
    for _ in range(12):
        altered = bytearray(data)
        altered[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        yield bytes(altered)
    yield bytes(len(data))
    yield add_checksum("number: [\n")
    yield add_checksum("\xff\udcff".encode("utf-8", "replace").decode())
    yield add_checksum("[]")
    yield add_checksum(json.dumps({"generation": 2, "active": {"number": 2}}))


def test_a_damaged_calibration_in_use_gives_way_to_the_one_before_it(used):
    path = used.directory / "0003.yaml"
    whole = path.read_bytes()
    for damaged in damages(whole, Random(1)):
        path.write_bytes(damaged)
        selected = used.find_selected()
        assert selected.document is not None
        assert mark_of(selected.document) == 2, damaged
        assert "E432" in selected.notes[0] and "0003.yaml" in selected.notes[0]
        assert used.list()[1].document is None and "E432" in used.list()[1].fault
        with pytest.raises(StoreError, match="E432"):
            used.use(3)
    path.write_bytes(whole)
    assert active_mark(used) == 3


def test_what_this_rig_cannot_take_is_not_gone_back_to_either(used):
    """The limits of the rig file are others since the last start."""
    for unusable, in_use in (({3}, 2), ({2, 3}, mark_of(OWN))):
        selected = used.find_selected(
            lambda own, unusable=unusable: "E401 beyond the cell" * (mark_of(own) in unusable)
        )
        assert selected.document is not None and mark_of(selected.document) == in_use
        assert len(selected.notes) == len(unusable)


def test_both_damaged_is_the_built_in_one(used):
    for name in ("0002.yaml", "0003.yaml"):
        (used.directory / name).write_bytes(b"number: 2\n")
    selected = used.find_selected()
    assert selected.document == OWN
    assert selected.selection == BUILT_IN
    assert len(selected.notes) == 2
    with pytest.raises(StoreError, match="0002"):
        go_back(used)


def test_a_damaged_selection_gives_way_to_the_generation_before_it(used):
    path = used.directory / "active.000002"
    for damaged in damages(path.read_bytes(), Random(2)):
        path.write_bytes(damaged)
        selected = used.find_selected()
        assert selected.document is not None and mark_of(selected.document) == 2, damaged
        assert "E432" in selected.notes[0] and "active.000002" in selected.notes[0]


def test_no_whole_selection_is_the_built_in_one_and_a_change_mends_it(used):
    for name in ("active.000001", "active.000002"):
        (used.directory / name).write_bytes(b"")
    selected = used.find_selected()
    assert selected.document == OWN
    assert len(selected.notes) == 2
    assert used.use(3).generation == 3
    assert active_mark(used) == 3
    assert used.find_selected().notes == ()


def test_after_damage_a_rollback_does_not_lead_to_the_damaged_one(used):
    used.use(used.add(calibration(4)))
    (used.directory / "0004.yaml").write_bytes(b"")
    used.use(2)
    assert go_back(used).active.number == 3


def test_a_rollback_leads_to_what_the_disk_did_not_give_for_a_moment(used, monkeypatch):
    """It may be whole, and has been in use until now."""

    def refuse(path: Path) -> bytes:
        if path.name == "0003.yaml":
            raise OSError(5, "Input/output error", str(path))
        return read(path)

    read = store.read_regular
    with monkeypatch.context() as patch:
        patch.setattr(store, "read_regular", refuse)
        used.use(used.add(calibration(4)))
    assert go_back(used).active.number == 3


def test_a_calibration_that_does_not_fit_the_rig_gives_way_too(used):
    selected = used.find_selected(lambda given: "E401 handle 2" if given.number == 3 else "")
    assert selected.document is not None and mark_of(selected.document) == 2
    assert selected.notes == ("E401 handle 2; the one before it is used instead of calibration 3",)


def test_a_file_under_another_number_is_no_calibration(used):
    (used.directory / "0007.yaml").write_bytes((used.directory / "0002.yaml").read_bytes())
    with pytest.raises(StoreError, match="says that it is calibration 2"):
        used.load(7)


@pytest.mark.parametrize(
    "data", [b"", b"a", b"# crc32 00000000 of all that follows\n", b"\n\n", Random(3).randbytes(64)]
)
def test_only_what_was_sealed_is_unsealed(data):
    with pytest.raises(ValueError, match=r"crc32|empty"):
        verify_checksum(data + b"x" if data.startswith(b"# crc32") else data)
    assert verify_checksum(add_checksum("é\n")) == "é\n".encode()


@pytest.mark.parametrize("name", ["0003.yaml", "active.000002"])
def test_a_pipe_or_a_device_is_no_file_and_is_not_waited_for(used, name):
    """A pipe kept the start waiting for good, and a device without an end took the memory."""
    path = used.directory / name
    assert path.exists()
    for put_there in (os.mkfifo, lambda path: path.symlink_to("/dev/zero")):
        path.unlink()
        put_there(path)
        selected = used.find_selected()
        assert selected.document is not None
        assert name in selected.notes[0] and "no file" in selected.notes[0]


@pytest.mark.parametrize("name", ["0003.yaml", "active.000002"])
def test_a_file_of_gigabytes_is_no_document_and_is_not_read(used, name):
    """3 GB of nothing kept a start from coming up within its 30 s, again and again."""
    path = used.directory / name
    os.truncate(path, 3 << 30)
    selected = used.find_selected()
    assert selected.document is not None
    assert name in selected.notes[0] and "no document has" in selected.notes[0]


def test_a_selection_that_the_disk_does_not_give_now_is_followed_by_none(used, monkeypatch):
    """It may be whole: whoever went on from the one before it would undo what was acknowledged."""
    read, newest = selection.read_regular, max(used.directory.glob("active.*"))
    before = selection.read_selection(used.directory, used.noun)

    def refuse(path: Path) -> bytes:
        if path == newest:
            raise OSError(5, "Input/output error", str(path))
        return read(path)

    monkeypatch.setattr(selection, "read_regular", refuse)
    for change in (lambda: used.use(2), used.previous):
        with pytest.raises(StoreError, match=r"Input/output error"):
            change()
    assert used.find_selected().notes, "but a start comes up with what it can read, and says so"
    monkeypatch.undo()
    assert selection.read_selection(used.directory, used.noun) == before
    assert active_mark(used) == 3


@pytest.mark.parametrize("spoilt", [{"generation": 8}, {"slots": [None] * 7}], ids=["renamed", "too few slots"])
def test_a_sealed_file_that_is_no_selection_of_its_name_is_passed_over(used, spoilt):
    newest = max(used.directory.glob("active.*"))
    facts = json.loads(verify_checksum(newest.read_bytes())) | {"generation": 9, "active": {"number": 2, "slot": None}}
    (used.directory / "active.000009").write_bytes(add_checksum(json.dumps(facts | spoilt)))
    assert active_mark(used) == 3
    assert "active.000009" in used.find_selected().notes[0]


def test_the_number_of_a_calibration_to_go_back_to_is_given_to_no_other_one(used):
    last = used.add(calibration(4))
    for number in (last, 3):
        used.use(number)
    used.use(2)
    used.use(last)
    used.use(3)
    (used.directory / f"{last:04d}.yaml").unlink()
    assert used.add(calibration(5)) == last + 1
