"""The calibrations of the rig that runs: which one it starts with, and who serves uploads while it runs."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from gateway.bsfm import CoefficientLimits
from gateway.calibrations.activation import Activation, ActiveCalibration
from gateway.calibrations.store import CalibrationStore
from gateway.calibrations.upload import UploadRules, UploadService
from gateway.profiles import Rig
from gateway.registers import RegisterBank


class RigCalibrations:
    """rig: as its file says, but with the calibration that was last in use, if any; notes: what people should know of it."""

    def __init__(self, rig: Rig, state: Path) -> None:
        store = CalibrationStore(state, rig.calibration)
        self._activation = Activation(store, CoefficientLimits(cell_range_n=rig.load_cell.range_n))
        self._selected = selected = store.find_selected(self._activation.why_unusable)
        calibration = selected.document or rig.calibration
        self.rig = replace(rig, calibration=calibration)
        number = selected.selection.number
        chosen = () if number is None else (f"calibration {number} of {calibration.date_utc} from {store.directory}",)
        doubts = self.rig.doubts_on(calibration) if chosen else ""  # the rig's own is judged with its file
        self.notes = (*selected.notes, *chosen, *filter(None, (doubts,)))

    def serve(
        self,
        bank: RegisterBank,
        on_use: Callable[[ActiveCalibration], None],
        log: Callable[[str, str], None],
        on_failure: Callable[[str, str], None] = lambda what, sentence: None,
    ) -> UploadService:
        """Show the calibration in use in the bank, and take uploads from now on."""
        bank.set_active_model(self.rig.calibration, self._selected.selection.slot_word)
        rules = UploadRules.of(self.rig.name, self.rig.register_map, _today, self.rig.doubts_on)
        upload = UploadService(bank.staging, self._activation, self._selected, rules, log)
        upload.on_use, upload.on_failure = on_use, on_failure
        return upload


def _today() -> str:
    return datetime.now(UTC).strftime("%Y-%m-%d")
