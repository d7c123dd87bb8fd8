"""What the tests ask of a store beyond what the gateway does: the contents of a slot, and a step back."""

from gateway.calibrations.store import CalibrationStore
from gateway.numbered_documents.selection import OWN, SelectionState, read_selection


def slot_number(store: CalibrationStore, slot: int) -> int | None:
    """Return the number of the calibration in a slot (0 .. 7), that of the built-in one included; None: empty."""
    number = read_selection(store.directory, store.noun)[0].slots[slot]
    return store.built_in.number if number == OWN and store.built_in else number


def go_back(store: CalibrationStore) -> SelectionState:
    """Put in use what was in use before the last change, as a rollback through the registers does."""
    previous = store.previous()
    return store.use(previous.number, previous.slot)
