"""Taking a calibration into use, the part that waits for the disk: find or store it, check it for this rig, build its
model, and only then select it durably. The functions touch the store and nothing of the loop.
"""

import struct
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import sha256

from gateway.bsfm import Bsfm, Calibration, CoefficientLimits, Coefficients, validate_coefficients
from gateway.calibrations.store import UNKNOWN_N, CalibrationStore
from gateway.numbered_documents.selection import SelectionState
from gateway.numbered_documents.store import StoreError
from gateway.registers.upload.coefficients import CoefficientSet
from gateway.registers.upload.staging import Staged, StagedFault
from gateway.registers.words import NO_NOTICE, CommitNotice


@dataclass(frozen=True, slots=True)
class ActiveCalibration:
    """A calibration, its model (ready, for the loop has no time to prove one), and the selection that made it active.
    notice: what a master should know of the commit that led to it."""

    calibration: Calibration
    model: Bsfm
    pointer: SelectionState
    notice: CommitNotice = NO_NOTICE


class UnusableCalibration(Exception):  # noqa: N818  no failure of ours
    """A calibration that this rig cannot take."""

    def __init__(self, fault: StagedFault) -> None:
        super().__init__(fault.text)
        self.fault = fault


class Activation:
    """The store as one rig may use it. Methods raise UnusableCalibration and StoreError, and nothing has changed then."""

    def __init__(self, store: CalibrationStore, limits: CoefficientLimits) -> None:
        self.store = store
        self.limits = limits

    def why_unusable(self, calibration: Calibration) -> str:
        """Return a sentence for a calibration that this rig cannot take, empty for one that it can."""
        fault = self._fault(calibration)
        return f"E401 calibration {calibration.number}: {fault.text}" if fault else ""

    def use_offered(self, number: int, *, force: bool = False) -> ActiveCalibration:
        """Select a calibration that a person asks for. force: one that its fit's verdict has rejected, too."""
        rejected = self.store.load(number).rejected
        if rejected and not force:
            raise StoreError("E436", f"calibration {number} was rejected: {rejected}; --force uses it all the same")
        return self.use(number)

    def use(self, number: int | None, slot: int | None = None) -> ActiveCalibration:
        """Select a calibration that is there, None: the built-in one."""
        calibration = self.store.built_in if number is None else self.store.load(number)
        if calibration is None:
            raise StoreError("E433", "the built-in calibration of this rig is not known here")
        if (fault := self._fault(calibration)) is not None:
            raise UnusableCalibration(fault)
        model = calibration.model()
        return ActiveCalibration(calibration, model, self.store.use(number, slot))

    def roll_back(self) -> ActiveCalibration:
        """Select what was in use before."""
        previous = self.store.previous()
        return self.use(previous.number, previous.slot)

    def use_uploaded(self, fresh: Calibration, slot: int, known: SelectionState) -> ActiveCalibration:
        """Store an uploaded set, fill its slot and select it. One that is known already, word for word, keeps its number, its
        name and all that the words do not carry: what is in use before all, then what is in the slot."""
        for number in dict.fromkeys((known.active.number, known.slots[slot] or None, None, *self._candidates(fresh))):
            if self._is_same_set(number, fresh):
                return replace(self.use(number, slot), notice=CommitNotice.KNOWN_SET)
        return self.use(self.store.add(fresh), slot)

    def _candidates(self, fresh: Calibration) -> Iterator[int]:
        """Yield numbers of the store that seem to be this set, the last one first."""
        words = _words(fresh)
        for number, stored in self.store.iterate_unchecked(fresh.data_sha256):
            with suppress(ArithmeticError, LookupError, TypeError, ValueError, struct.error):  # edited by hand, say
                if _words(stored) == words:
                    yield number

    def _is_same_set(self, number: int | None, fresh: Calibration) -> bool:
        """Return whether a stored set, None: the built-in one, is whole and the very same."""
        try:
            stored = self.store.built_in if number is None else self.store.load(number)
        except StoreError:
            return False
        return stored is not None and _words(stored) == _words(fresh)

    def _fault(self, calibration: Calibration) -> StagedFault | None:
        for fault in validate_coefficients(Coefficients.of_calibration(calibration), self.limits):
            return StagedFault(fault.index, fault.reason, fault.text)
        return None


def make_uploaded(staged: Staged, *, name: str, rig: str, date_utc: str, source: str) -> Calibration:
    """Return a checked set as a calibration.
    What it was fitted to is not known here: no residuals, and the hash is the set's."""
    coefficients = staged.coefficients
    fresh = Calibration(
        number=0,
        name=name,
        order=len(coefficients.rising_weights) - 1,
        x0_v=coefficients.x0_v,
        x1_v=coefficients.x1_v,
        rising_handles_n=coefficients.rising_handles_n,
        rising_weights=coefficients.rising_weights,
        falling_handles_n=coefficients.falling_handles_n,
        falling_weights=coefficients.falling_weights,
        blend_span_n=coefficients.blend_span_n,
        rms_n=UNKNOWN_N,
        max_n=UNKNOWN_N,
        date_utc=date_utc,
        source=source,
        rig=rig,
        data_sha256="",
        slip_radii_v=coefficients.slip_radii_v,
        slip_shares=coefficients.slip_shares,
        force_limits_n=staged.force_limits_n,
        response=coefficients.response and replace(coefficients.response, source=source),
    )
    return replace(fresh, data_sha256=sha256(_words(fresh)).hexdigest())


def _words(calibration: Calibration) -> bytes:
    return CoefficientSet.of_calibration(calibration).to_words()
