"""What the calibration verb does with a store: find, and change with or without a running gateway."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from gateway import defaults
from gateway.cli.change_in_use import ask_until_done, not_running
from gateway.cli.command_line.known_rigs import tell_rig_fault
from gateway.cli.errors import CliError
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.bsfm import Calibration
    from gateway.calibrations.store import CalibrationStore
    from gateway.profiles import Rig


def open_store(directory: Path, rig_name: str) -> "CalibrationStore":
    """Return the store of a state directory, with the built-in calibration of the rig where that can be read."""
    from gateway.calibrations.store import CalibrationStore

    rig = _rig(rig_name)
    return CalibrationStore(directory, rig.calibration if rig else None)


def find_calibration(store: "CalibrationStore", which: str) -> "Calibration":
    """Return a calibration by its number in the store, a shipped name or a file."""
    from gateway.numbered_documents.store import StoreError
    from gateway.profiles import load_calibration

    if not which.isdecimal():
        return load_calibration(which)
    try:
        return store.load(int(which))
    except StoreError as error:
        raise CliError(str(error), exit_codes.DATA) from None


def in_use(store: "CalibrationStore", rig_name: str) -> "Calibration":
    """Return the calibration in use, or the one that a gateway would start with."""
    calibration = store.find_selected().document
    if calibration is None:
        why = tell_rig_fault(rig_name) or "--rig names the rig's own"
        raise CliError(f"E433 nothing is stored in {store.directory}; {why}", exit_codes.DATA)
    return calibration


def change_calibration(directory: Path, rig_name: str, request: dict[str, Any]) -> dict[str, Any]:
    """Use another calibration or roll back. request: {"use": N, "force": bool} or {"rollback": True}.

    Return the gateway's answer when it is through, or what was done here where none runs."""
    with not_running(directory) as is_free:
        if is_free:
            return _change_without_gateway(directory, rig_name, request)
    answer = ask_until_done(directory, "calibration", request)
    if answer["failed"]:
        raise CliError(answer["said"], _exit_code(answer["reason"]))
    return answer


def _change_without_gateway(directory: Path, rig_name: str, request: dict[str, Any]) -> dict[str, Any]:
    from gateway.bsfm import CoefficientLimits
    from gateway.calibrations.activation import Activation, UnusableCalibration
    from gateway.numbered_documents.store import StoreError

    rig, store = _rig(rig_name), open_store(directory, rig_name)
    activation = Activation(
        store, CoefficientLimits(cell_range_n=rig.load_cell.range_n if rig else defaults.LARGEST_CELL_N)
    )
    before = store.find_selected().document
    try:
        force = bool(request.get("force"))
        selected = (
            activation.roll_back() if "rollback" in request else activation.use_offered(request["use"], force=force)
        )
    except UnusableCalibration as error:
        sentence = error.fault.sentence(before.number if before else 0)
        raise CliError(sentence, exit_codes.DATA) from None
    except StoreError as error:
        raise CliError(str(error), exit_codes.FAILED if error.code == "E431" else exit_codes.DATA) from None
    calibration, active = selected.calibration, selected.pointer.active
    said = f"calibration {calibration.number} ({calibration.name}) will be used from the next start: no gateway runs"
    fault = "" if rig else tell_rig_fault(rig_name)
    doubts = rig.doubts_on(calibration) if rig else fault and f"not judged by this rig's limits: {fault}"
    return {
        "active": calibration.number,
        "name": calibration.name,
        "slot": active.slot,
        "built_in": active.number is None,
        "said": f"{said}; {doubts}" if doubts else said,
    }


def _exit_code(reason: int) -> int:
    """Return the exit code: a disk that refuses, or an internal error, is a failure; all else is a wrong calibration or
    number."""
    from gateway.registers.words import UploadReason

    return exit_codes.FAILED if reason in (UploadReason.STORAGE, UploadReason.DEFECT) else exit_codes.DATA


def _rig(name: str) -> "Rig | None":
    from gateway.profiles import ProfileError, read_rig

    try:
        return read_rig(name)
    except ProfileError:
        return None
