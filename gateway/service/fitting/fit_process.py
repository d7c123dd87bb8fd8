"""The fit of a recorded ladder, in a process of its own: `python -m gateway.service.fitting.fit_process '{"recording": ...}'`.

Reads the recording, checks, fits, chooses, validates, judges, stores a numbered calibration and its report, and prints one
JSON line. It activates nothing. A second fit of the same data stores nothing new: the number is told again, so that whoever
was interrupted in this moment may ask again. It runs at the lowest ordinary priority, whatever its parent had: control must
not feel it.
"""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gateway.calibrations.store import CalibrationStore
    from gateway.service.fitting.ladder_fit import LadderFit

from gateway.plain_file import exists
from gateway.processes.scheduling import priority


def fit_and_store(recording: Path, rig_name: str, state: Path) -> dict[str, Any]:
    """Fit a recorded run, store the calibration and return the answer of the process.

    {"stored": number, "report": path, "document": path}, the same with "rejected" and a sentence in "refused" for a fit that
    is kept but not offered, or {"refused": sentence}. "unreported" in place of both paths: a sentence, where the disk took the
    calibration and not its report.
    """
    from gateway.bsfm.fit.evaluation import FitRequest
    from gateway.bsfm.ladder.ladder_error import LadderError
    from gateway.calibrations.store import CalibrationStore
    from gateway.numbered_documents.store import StoreError
    from gateway.profiles import ProfileError, read_rig
    from gateway.recording import RecordingError
    from gateway.service.fitting.ladder_fit import calibration_of, fit_recording
    from gateway.service.fitting.ladder_source import RigContext, read_source

    try:
        rig = read_rig(rig_name)
        store = CalibrationStore(state, rig.calibration)
        selected = store.find_selected().document or rig.calibration
        has_span = selected.blend_span_n > 0.0 or not selected.slip_radii_v  # with stops a master may leave it 0
        request = FitRequest(reference_span_n=selected.blend_span_n if has_span else None)
        fit = fit_recording(read_source(recording), request, RigContext(rig=rig_name, state=state))
        fresh = calibration_of(fit, rig.load_cell.range_n)
        number = store.find_data(fresh.data_sha256)
        return (
            _describe_result(fit, store, number)
            if number
            else _describe_result(fit, store, store.add(fresh), is_new=True)
        )
    except LadderError as error:
        return {"refused": f"E421 {recording}: {error}"}
    except RecordingError as error:
        return {"refused": f"E403 {error}"}
    except (ProfileError, StoreError) as error:
        return {"refused": str(error)}
    except OSError as error:
        return {"refused": f"E106 {error.filename or recording}: {error.strerror}"}


def _describe_result(
    fit: "LadderFit", store: "CalibrationStore", number: int, *, is_new: bool = False
) -> dict[str, Any]:
    """What the calibration of this number is called, and whether it is offered. is_new: its report is still to be written."""
    from gateway.processes.durable_file import replace_text
    from gateway.service.fitting.ladder_fit import write_report

    report, document = (store.directory / f"{number:04d}.{suffix}" for suffix in ("html", "json"))
    paths = {"report": str(report), "document": str(document)}
    if is_new or not exists(document):
        fit.document.update(calibration=number, report=str(report))
        try:
            write_report(fit, report)
            replace_text(document, json.dumps(fit.document, indent=1))
        except OSError as error:  # what is stored is stored; asked again, it is written
            paths = {"unreported": f"E106 {error.filename or report}: {error.strerror}; only the report is missing"}
    rejected = store.load(number).rejected
    if rejected:
        return {"rejected": number, "refused": rejected_sentence(number, rejected)} | paths
    return {"stored": number} | paths


def rejected_sentence(number: int, why: str) -> str:
    """Return what a person is told of a calibration that is stored as rejected."""
    return f"E435 calibration {number} is stored as rejected and not offered: {why}"


def main(arguments: list[str]) -> int:
    """Fit, store and print the result; return the exit code. arguments: the request as JSON."""
    priority.lower_priority()
    options = json.loads(arguments[0])
    result = fit_and_store(Path(options["recording"]), options["rig"], Path(options["state"]))
    sys.stdout.write(json.dumps(result) + "\n")
    return 0 if "stored" in result else 65


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
