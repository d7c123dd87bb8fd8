"""A store that has been used, and what is in use in it as a process that starts now would find it."""

from pathlib import Path

from gateway.calibrations.store import CalibrationStore
from tests.calibrations.coefficients import calibration, mark_of

OWN = calibration(1000, number=1)


def used_store(state: Path) -> CalibrationStore:
    """Calibrations 2 and 3 (marks 2 and 3), 3 in use from slot 1 after 2 from slot 0."""
    store = CalibrationStore(state, OWN)
    for mark in (2, 3):
        store.use(store.add(calibration(mark)), mark - 2)
    return store


def active_mark(store: CalibrationStore) -> int:
    found = CalibrationStore(store.directory.parent, OWN).find_selected().document
    assert found is not None
    return mark_of(found)
