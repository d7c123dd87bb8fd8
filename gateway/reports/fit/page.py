"""The report of a fit: one HTML file, no scripts, nothing loaded; light and dark, and fit for paper."""

from html import escape
from pathlib import Path
from typing import Final

from gateway import VERSION
from gateway.bsfm.fit.evaluation import Evaluation
from gateway.reports.fit import charts
from gateway.reports.fit.document import Document
from gateway.reports.style import inline_style

_WORDS: Final = " class='words'"
_FRAME: Final = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>{style}</style></head>
<body><main>
{body}
</main></body></html>
"""


def fit_page(evaluation: Evaluation, document: Document) -> str:
    """Return the whole page. document: `fit_document` of the evaluation, with `calibration` where one was stored."""
    parts = [
        _heading(document),
        _figures(document),
        _notes(document["notes"]),
        _pair(
            _figure(
                "Hysteresis loop",
                charts.draw_loop(evaluation),
                "Settled readings over the two branches of the chosen model.",
            ),
            _figure("Residuals", charts.draw_residuals(evaluation), "Measured minus model at each stair."),
        ),
        "<h2>Choice of model and order</h2>",
        _pair(
            _figure(
                "Order sweep",
                charts.draw_order_sweep(document),
                "Error on a group that the fit has not seen. Hollow: may not drive a plant. Ring: chosen.",
            ),
            f"<div>{_why(document)}</div>",
        ),
        _table(document),
        _reversal(evaluation, document),
        _provenance(document),
    ]
    body = "\n".join(part for part in parts if part)
    return _FRAME.format(title=escape(_title(document)), style=inline_style(), body=body)


def _title(document: Document) -> str:
    """Return the name that the user gave, and where to find it."""
    number = f"calibration {document['calibration']}" if document.get("calibration") else ""
    return f"{document['name']} · {number or 'fit of ' + Path(document['recording']).name}"


def _heading(document: Document) -> str:
    ladder = document["ladder"]
    low_v, high_v = ladder["voltage_v"]
    facts = [
        _model(document["chosen"]),
        str(document["rig"] or "unnamed rig"),
        Path(document["recording"]).name,
        f"{ladder['points']} stairs in {ladder['groups']} groups, {low_v:g} to {high_v:g} V",
    ]
    if document["started_utc"]:
        facts.append(document["started_utc"][:16].replace("T", " ") + " UTC")
    number = f"Calibration {document['calibration']} · " if document.get("calibration") else ""
    return (
        f"<header><p class='kicker'>{escape(number)}force-gateway {VERSION}</p>"
        f"<h1>{escape(document['name'])}</h1><p>{escape(' · '.join(facts))}</p>{_rejection(document)}</header>"
    )


def _rejection(document: Document) -> str:
    why = document["measured"]["rejected"]
    return f"<p><strong>Rejected, not offered for use:</strong> {escape(why)}</p>" if why else ""


def _model(fit: Document) -> str:
    return f"{fit['model'].upper()} of order {fit['order']}"


def _figures(document: Document) -> str:
    chosen, reversal, measured = document["chosen"], document["reversal"], document["measured"]
    low_n, high_n = chosen["force_range_n"]
    heldout = f"{chosen['heldout_rms_n']:.3f}" if chosen["heldout_rms_n"] else "not tried"
    reversals = "reversals included" if measured["reversals"] else "no reversals measured"
    tiles = (
        ("RMS error", f"{measured['rms_n']:.3f}", f"N on all {measured['points']} points, {reversals}"),
        ("Largest", f"{measured['max_n']:.2f}", "N at one of them"),
        ("Held out", heldout, "N by branch, on a group not seen"),
        ("Range", f"{low_n:.1f} – {high_n:.1f}", "N on both branches"),
        ("Reversal", *_reversal_tile(reversal)),
    )
    cells = "".join(
        f"<div><dt>{name}</dt><dd>{value}</dd><dd class='unit'>{unit}</dd></div>" for name, value, unit in tiles
    )
    return f"<dl class='tiles'>{cells}</dl>"


def _reversal_tile(reversal: Document) -> tuple[str, str]:
    if reversal["policy"] == "slip-stops":
        return f"{reversal['rms_n']:.2f}", "N RMS, slip stops"
    return f"{reversal['span_n']:g} N", "blend, identified" if reversal["identified"] else "blend, assumed"


def _notes(notes: list[str]) -> str:
    if not notes:
        return ""
    lines = "".join(f"<li>{escape(note)}</li>" for note in notes)
    return f"<section class='notes'><h2>Notes</h2><ul>{lines}</ul></section>"


def _figure(title: str, svg: str, caption: str) -> str:
    return f"<figure><h3>{title}</h3>{svg}<figcaption>{escape(caption)}</figcaption></figure>" if svg else ""


def _pair(*blocks: str) -> str:
    return f"<div class='pair'>{''.join(blocks)}</div>"


def _why(document: Document) -> str:
    chosen = document["chosen"]
    if chosen["constrained"]:
        words = (
            "Free optima describe the data better, but are not increasing or cross; this one was searched under these "
            "conditions."
        )
    else:
        words = (
            "It has the fewest coefficients of all fits whose held-out error is not certainly larger than the best, among "
            "those that may drive a plant: increasing on both branches, no crossing, at least 0.5 N per volt."
        )
    branches = f"Rising branch {chosen['rising_rms_n']:.3f} N RMS, falling {chosen['falling_rms_n']:.3f} N."
    certainty = (
        "identifiable"
        if chosen["identifiable"]
        else "not identifiable from these data, though the curve is: never compare fits by them"
    )
    return (
        f"<h3>Why {escape(_model(chosen))}</h3><p>{words}</p>"
        f"<p>{branches} Its {chosen['coefficients']} coefficients are {certainty}.</p>{_coefficients(chosen)}"
    )


def _coefficients(chosen: Document) -> str:
    rows = "".join(
        f"<tr><th>{way}</th><td>{_numbers(chosen[f'{way}_handles_n'], '.3f')}</td>"
        f"<td>{_numbers(chosen[f'{way}_weights'], '.4g')}</td></tr>"
        for way in ("rising", "falling")
    )
    head = "<thead><tr><th>branch</th><th>handles (N)</th><th>weights</th></tr></thead>"
    return f"<table>{head}<tbody>{rows}</tbody></table>"


def _numbers(values: list[float], form: str) -> str:
    return ", ".join(format(value, form).replace("-", "−") for value in values)


def _table(document: Document) -> str:
    heads = ("model", "order", "coefficients", "RMS N", "max N", "held-out RMS N", "verdict", "paper's norm*")
    head = "".join(f"<th>{name}</th>" for name in heads)
    rows = "".join(_row(fit) for fit in document["fits"])
    return (
        f"<div class='wide'><table class='fits'><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
        "<p class='small'>RMS and max: of the stairs, each by its own branch. "
        "* the paper's normalised figure (2-norm of the group means' residuals over the number of points), "
        "for comparison with its tables; it is no force.</p>"
    )


def _row(fit: Document) -> str:
    error = f" ± {fit['heldout_error_n']:.3f}" if fit["heldout_error_n"] is not None else ""
    heldout = f"{fit['heldout_rms_n']:.3f}{error}" if fit["heldout_rms_n"] is not None else "–"
    verdict = "may drive" if fit["usable"] else escape("; ".join(fit["verdicts"]))
    style = " class='chosen'" if fit["chosen"] else "" if fit["usable"] else " class='unusable'"
    mark = " ◂ chosen" if fit["chosen"] else ""
    cells = (
        f"{fit['model'].upper()}{mark}",
        fit["order"],
        fit["coefficients"],
        f"{fit['rms_n']:.3f}",
        f"{fit['max_n']:.2f}",
        heldout,
        verdict,
        f"{fit['paper_norm']:.4f}",
    )
    return f"<tr{style}>" + "".join(f"<td{_WORDS if cell is verdict else ''}>{cell}</td>" for cell in cells) + "</tr>"


def _reversal(evaluation: Evaluation, document: Document) -> str:
    walk = charts.draw_minor_loops(evaluation)
    if not walk:
        return ""
    points = document["ladder"]["minor_points"]
    return "<h2>Reversals inside the loop</h2>" + _pair(
        _figure(
            "Partial reversals", walk, f"{points} points of partial reversals; two branches alone cannot describe them."
        ),
        _figure(
            "Error of the command",
            charts.draw_minor_errors(evaluation),
            _why_reversal(document["reversal"]),
        ),
    )


def _why_reversal(reversal: Document) -> str:
    if reversal["slip_heldout_n"] is None:
        return "The blend span is the one with the smallest error; the walk is too short to fit slip stops to."
    figures = (
        f"{reversal['slip_heldout_n']:.2f} N RMS by slip stops, {reversal['blend_heldout_n']:.2f} N by the linear blend"
    )
    return f"On the half of the walk that was not fitted to: {figures}."


def _provenance(document: Document) -> str:
    facts = {
        "recording": document["recording"],
        "rig": document["rig"],
        "rig fingerprint": document["rig_fingerprint"],
        "data SHA-256": document.get("data_sha256"),
        "noise of a reading": f"{document['ladder']['noise_n']:.3f} N" if document["ladder"]["noise_n"] else None,
    }
    rows = "".join(f"<tr><th>{name}</th><td>{escape(str(value))}</td></tr>" for name, value in facts.items() if value)
    return f"<h2>Provenance</h2><table class='facts'><tbody>{rows}</tbody></table>"
