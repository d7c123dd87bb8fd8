"""From a recording to a fit, a report and, where asked for, a numbered calibration. Imports numpy and scipy.

Everything is worked out before anything is written; the report is written beside its name and renamed, the calibration
as the store does it. So a refused ladder, a full disk or a kill leaves no half of either.
"""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path

from gateway.bsfm import Calibration, CoefficientLimits, Coefficients, validate_coefficients
from gateway.bsfm.fit.evaluation import Evaluation, FitRequest, evaluate
from gateway.bsfm.ladder.check import CheckedLadder
from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
from gateway.bsfm.response.identification import MeasuredResponse
from gateway.processes.durable_file import replace_text
from gateway.profiles.rigs.rig import rehearsed
from gateway.recording import Recording
from gateway.reports.fit.document import Document, fit_document
from gateway.reports.fit.names import spell_groups
from gateway.reports.fit.page import fit_page
from gateway.reports.fit.raw_ladder import raw_ladder
from gateway.service.fitting.acceptance import Acceptance, judge_fit
from gateway.service.fitting.ladder_source import RigContext, acceptance_bounds, check_source, in_unit
from gateway.service.fitting.measured_response import measure_recorded_response
from gateway.service.fitting.recorded_rig import is_rehearsal


@dataclass(frozen=True, slots=True, eq=False)
class LadderFit:
    """A fit that may be reported and stored. measured: how the plant follows, or why that is not known."""

    recording: Recording
    evaluation: Evaluation
    document: Document
    verdict: Acceptance
    measured: MeasuredResponse


def fit_recording(recording: Recording, request: FitRequest, context: RigContext, name: str = "") -> LadderFit:
    """Check, fit, hold out, choose, judge. name: the user's, empty for the one given when it was recorded. LadderError with a
    sentence where the data must not be fitted."""
    recording, context = in_unit(recording, context.force_unit), replace(context, force_unit=None)
    evaluation = evaluate(check_source(recording, context), request)
    verdict = judge_fit(evaluation, *acceptance_bounds(recording, context), is_in_use=context.state is not None)
    document = fit_document(evaluation, recording.path, recording.header)
    document["data_sha256"] = data_sha256(evaluation.checked)
    response = measure_recorded_response(recording, evaluation)
    document["response"] = asdict(response.response) if response.response else None
    document["notes"].append(response.description)
    document["name"] = name or str(recording.header.get("name") or "") or default_name(document)
    document["measured"] = verdict.facts()
    return LadderFit(recording, evaluation, document, verdict, response)


def default_name(document: Document) -> str:
    """Return the name of a calibration that nobody has named: model and order, which slip stops may have raised."""
    return f"{document['chosen']['model']}-{len(document['model']['rising_weights']) - 1}"


def calibration_of(fit: LadderFit, cell_range_n: float) -> Calibration:
    """Return the chosen model as a calibration without a number. LadderError where its coefficients may not drive the rig."""
    model = fit.document["model"]
    coefficients = Coefficients.of(fit.evaluation.model.branches, fit.evaluation.span_n)
    faults = validate_coefficients(coefficients, CoefficientLimits(cell_range_n=cell_range_n))
    if faults:
        raise LadderError(LadderFlaw.NO_FIT, f"E401 the chosen model may not drive the rig: {faults[0].text}")
    return Calibration(
        number=0,
        name=fit.document["name"],
        order=len(coefficients.rising_weights) - 1,
        x0_v=coefficients.x0_v,
        x1_v=coefficients.x1_v,
        rising_handles_n=_plain(coefficients.rising_handles_n),
        rising_weights=_plain(coefficients.rising_weights),
        falling_handles_n=_plain(coefficients.falling_handles_n),
        falling_weights=_plain(coefficients.falling_weights),
        blend_span_n=float(fit.evaluation.span_n),
        rms_n=fit.verdict.error.rms_n,
        max_n=fit.verdict.error.max_n,
        date_utc=datetime.now(UTC).strftime("%Y-%m-%d"),
        source=_source(fit),
        rig=_made_on(fit),
        data_sha256=fit.document["data_sha256"],
        slip_radii_v=_plain(model["slip_radii_v"]),
        slip_shares=_plain(model["slip_shares"]),
        response=fit.measured.response,
        rejected=fit.verdict.rejected,
        noise_n=fit.document["ladder"]["noise_n"] or 0.0,
    )


def _made_on(fit: LadderFit) -> str:
    """Return the rig by name; of a rehearsal one that a real rig does not take for its own."""
    rig = str(fit.document["rig"] or "")
    return rehearsed(rig) if rig and is_rehearsal(fit.recording) else rig


def _plain(values: Iterable[float]) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _source(fit: LadderFit) -> str:
    ladder, fingerprint = fit.document["ladder"], str(fit.document["rig_fingerprint"] or "unknown")[:12]
    low_v, high_v = ladder["voltage_v"]
    return (
        f"recording {fit.recording.path.name}: {ladder['points']} stairs {low_v:g}-{high_v:g}-{low_v:g} V, "
        f"{spell_groups(ladder['groups'])}, {ladder['minor_points']} minor-loop points; rig fingerprint {fingerprint}"
    )


def write_report(fit: LadderFit, target: Path) -> None:
    """Write the HTML report, whole or not at all."""
    raw = raw_ladder(fit.recording.columns, fit.recording.header)
    replace_text(target, fit_page(fit.evaluation, fit.document, raw))


def data_sha256(joined: CheckedLadder) -> str:
    """Return the SHA-256 of every settled point that the fit has used, as text with fixed digits."""
    ladder = joined.ladder
    rows = zip(ladder.voltage_v, ladder.force_n, ladder.direction, ladder.group, strict=True)
    text = "".join(f"{volts:.4f},{newtons:.6f},{way},{group}\n" for volts, newtons, way, group in rows)
    text += "".join(
        f"{volts:.4f},{newtons:.6f}\n" for volts, newtons in zip(joined.minor_v, joined.minor_n, strict=True)
    )
    return sha256(text.encode()).hexdigest()
