"""Taking a calibration into use: nothing is selected that has no model, and a damaged neighbour hides nobody."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.bsfm import Calibration, CoefficientLimits
from gateway.calibrations.activation import Activation
from gateway.calibrations.store import CalibrationStore, as_text
from gateway.numbered_documents.store import StoreError
from gateway.registers.words import CommitNotice
from tests.calibrations.coefficients import calibration
from tests.calibrations.upload_bench import OWN, Bench


def test_what_makes_no_model_is_not_selected(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next start would come up with it, and without a model."""
    selected = list[Any]()
    store: Any = SimpleNamespace(load=lambda number: calibration(16), use=lambda *chosen: selected.append(chosen))

    def broken(self: Calibration) -> None:
        raise ValueError("no model")

    monkeypatch.setattr(Calibration, "model", broken)
    with pytest.raises(ValueError, match="no model"):
        Activation(store, CoefficientLimits(cell_range_n=100.0)).use(2)
    assert selected == []


def test_a_damaged_calibration_hides_none_that_was_made_of_the_same_data(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    first, second = store.add(calibration(8)), store.add(calibration(16))
    wanted = store.load(second).data_sha256
    path = tmp_path / "calibrations" / f"{first:04d}.yaml"
    path.write_bytes(path.read_bytes()[:-5])
    assert store.find_data("none") is None
    assert store.find_data(wanted) == second


def test_a_calibration_that_its_fit_rejected_is_used_for_who_insists_alone(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path, calibration(8))
    number = store.add(calibration(16, rejected="worse than the one in use"))
    activation = Activation(store, CoefficientLimits(cell_range_n=100.0))
    with pytest.raises(StoreError, match="E436 calibration 2 was rejected: worse"):
        activation.use_offered(number)
    assert store.find_selected().selection.number is None
    assert activation.use_offered(number, force=True).pointer.active.number == number


@pytest.mark.parametrize(
    ("line", "spoilt"),
    [
        ("x0_v: 0.0", "x0_v: 1e300"),
        ("x0_v: 0.0", 'x0_v: "zero"'),
        ("order: 2", "order: 99"),
        ("order: 2", "colour: 2"),
        ("order: 2", "order"),
        ("slip_radii_v: []", "slip_radii_v: null"),
        ("force_limits_n: []", "force_limits_n: [null, 3]"),
        ("rising_handles_n: [0.0, 26.0, 52.0]", "rising_handles_n: []"),
        ("rising_handles_n: [0.0, 26.0, 52.0]", 'rising_handles_n: {"0": 1}'),
    ],
)
def test_what_has_become_of_a_neighbour_keeps_no_upload_from_being_stored(bench: Bench, line: str, spoilt: str) -> None:
    bench.store.add(calibration(24))
    folder = bench.store.directory
    (folder / "0007.yaml").write_text(as_text(calibration(16, number=7)).replace(f"\n{line}\n", f"\n{spoilt}\n"))
    (folder / "0008.yaml").mkdir()
    bench.upload_of(calibration(16), 1)
    assert (bench.upload.status()["name"], bench.upload.status()["failed"]) == ("slot-1", False), bench.log
    assert bench.upload_of(calibration(24), 2) and bench.upload.status()["name"] == "mark 24"


def test_of_two_calibrations_with_the_same_words_the_one_in_the_slot_stays(bench: Bench) -> None:
    bench.upload_of(calibration(16), 1)
    uploaded = bench.upload.status()["active"]
    assert bench.store.add(calibration(16)) > uploaded
    bench.upload_of(calibration(24), 0)
    bench.upload_of(calibration(16), 1)
    assert bench.upload.status()["active"] == uploaded and bench.notice is CommitNotice.KNOWN_SET


def test_the_rigs_own_set_is_known_in_a_slot_that_held_another_one(bench: Bench) -> None:
    bench.upload_of(calibration(16), 2)
    bench.upload_of(OWN, 2)
    assert bench.upload.status()["built_in"] and bench.notice is CommitNotice.KNOWN_SET


def test_what_an_upload_was_made_of_is_told_apart_by_its_hash(bench: Bench) -> None:
    for mark in (16, 24):
        bench.upload_of(calibration(mark), 1)
    hashes = [one.document.data_sha256 for one in bench.store.list() if one.document]
    assert len(set(hashes)) == 2 and all(len(one) == 64 for one in hashes)


def test_where_what_was_in_use_is_damaged_status_tells_what_is_used_instead(bench: Bench) -> None:
    for slot, mark in enumerate((16, 24), 1):
        bench.upload_of(calibration(mark), slot)
    before, active = bench.store.numbers()
    (bench.store.directory / f"{active:04d}.yaml").write_bytes(b"")
    status = bench.restarted().upload.status()
    assert (status["active"], status["slot"]) == (before, 1)
