"""The report of a fit: which model, how well it holds, how it reverses, and what it was made from."""

from html import escape
from pathlib import Path
from typing import Final

from gateway.bsfm.fit.evaluation import Evaluation
from gateway.reports.figures import figure
from gateway.reports.fit import charts
from gateway.reports.fit.document import Document
from gateway.reports.fit.headline import answer_sentence, policy, reversal_sentence
from gateway.reports.fit.names import describe_model, spell_groups, spell_held_out, spell_model
from gateway.reports.fit.raw_ladder import RawLadder
from gateway.reports.frame import Head, notes, page, section, table, tiles

_WORDS: Final = " class='words'"


def fit_page(evaluation: Evaluation, document: Document, raw: RawLadder | None) -> str:
    """Return the whole page. document: `fit_document` of the evaluation, with `calibration` where one was stored; raw: the
    rows of its recording."""
    held_out = spell_held_out(document["ladder"]["groups"])
    parts = [
        _figures(document),
        "<h2>Measured and model</h2>",
        _pair(
            figure(
                "Hysteresis loop",
                charts.draw_loop(evaluation),
                "Rings: settled readings, one for each stair. Lines: the two branches of the chosen model.",
            ),
            figure("Residuals", charts.draw_residuals(evaluation), "Measured minus model at each stair."),
        ),
        notes(document["notes"]),
        _raw(raw),
        "<h2>Choice of model and order</h2>",
        _pair(
            figure(
                "Order sweep",
                charts.draw_order_sweep(document),
                f"Error on {held_out} that the fit has not seen. Hollow: may not drive a plant.",
            ),
            f"<div>{_why(document)}</div>",
        ),
        _table(document),
        _reversal(evaluation, document),
    ]
    return page(_head(document), parts, _provenance(document))


def _raw(raw: RawLadder | None) -> str:
    if raw is None:
        return ""
    force = figure("Force", charts.draw_raw_ladder(raw), style="full")
    return section("The ladder as recorded", force + figure("Command", charts.draw_raw_command(raw), style="full"))


def _head(document: Document) -> Head:
    ladder, why = document["ladder"], document["measured"]["rejected"]
    low_v, high_v = ladder["voltage_v"]
    name = Path(document["recording"]).name
    number = f"calibration {document['calibration']}" if document.get("calibration") else ""
    return Head(
        kind=f"{number.capitalize() or 'Fit of a ladder'} · {document['name']}",
        answer=answer_sentence(document),
        badge=("rejected", "bad") if why else ("may drive the rig", "good"),
        sentences=(f"Rejected, not offered for use: {why}" if why else "", reversal_sentence(document["reversal"])),
        facts=(
            f"rig {document['rig']}" if document["rig"] else "unnamed rig",
            name,
            f"{ladder['points']} stairs in {spell_groups(ladder['groups'])}, {low_v:g} to {high_v:g} V",
        ),
        title=f"{document['name']} · {number or 'fit of ' + name}",
    )


def _model(fit: Document) -> str:
    return spell_model(fit["model"], fit["order"])


def _figures(document: Document) -> str:
    chosen, reversal, measured = document["chosen"], document["reversal"], document["measured"]
    low_n, high_n = chosen["force_range_n"]
    heldout = f"{chosen['heldout_rms_n']:.3f}" if chosen["heldout_rms_n"] else "not tried"
    reversals = "reversals included" if measured["reversals"] else "no reversals measured"
    off = f"{reversal['rms_n']:.2f}" if reversal["identified"] else "assumed"
    return tiles(
        ("Error", f"{measured['rms_n']:.3f}", f"N RMS on all {measured['points']} points, {reversals}"),
        ("Largest", f"{measured['max_n']:.2f}", "N at one of them"),
        ("Held out", heldout, f"N RMS by branch, on {spell_held_out(document['ladder']['groups'])} not seen"),
        ("Reversals", off, f"{'N RMS, ' if reversal['identified'] else ''}{policy(reversal)}"),
        ("Range", f"{low_n:.1f} – {high_n:.1f}", "N on both branches"),
    )


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
        f"<h3>Why {escape(_model(chosen))}</h3><p>{chosen['model'].upper()}: {describe_model(chosen['model'])}. {words}</p>"
        f"<p>{branches} Its {chosen['coefficients']} coefficients are {certainty}.</p>{_coefficients(chosen)}"
    )


def _coefficients(chosen: Document) -> str:
    rows = (
        (way, _numbers(chosen[f"{way}_handles_n"], ".3f"), _numbers(chosen[f"{way}_weights"], ".4g"))
        for way in ("rising", "falling")
    )
    return table(("branch", "handles (N)", "weights"), rows)


def _numbers(values: list[float], form: str) -> str:
    return ", ".join(format(value, form).replace("-", "−") for value in values)


def _table(document: Document) -> str:
    heads = ("model", "order", "coefficients", "RMS N", "max N", "held-out RMS N", "verdict", "paper's norm*")
    head = "".join(f"<th>{name}</th>" for name in heads)
    rows = "".join(_row(fit) for fit in document["fits"])
    return (
        f"<div class='wide' tabindex='0'><table class='fits'><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
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
    caption = f"{points} points of partial reversals; two branches alone cannot describe them."
    errors = charts.draw_minor_errors(evaluation)
    return section(
        "Reversals inside the loop",
        _pair(
            figure("Partial reversals", walk, caption),
            figure("Error of the command", errors, _why_reversal(document["reversal"])),
        ),
    )


def _why_reversal(reversal: Document) -> str:
    if reversal["slip_heldout_n"] is None:
        return "The blend span is the one with the smallest error; the walk is too short to fit slip stops to."
    figures = (
        f"{reversal['slip_heldout_n']:.2f} N RMS by slip stops, {reversal['blend_heldout_n']:.2f} N by the linear blend"
    )
    return f"On the half of the walk that was not fitted to: {figures}."


def _provenance(document: Document) -> dict[str, object]:
    noise_n = document["ladder"]["noise_n"]
    return {
        "recording": document["recording"],
        "recorded": (document["started_utc"] or "")[:16].replace("T", " ") + " UTC" if document["started_utc"] else "",
        "rig": document["rig"],
        "rig fingerprint": document["rig_fingerprint"],
        "data SHA-256": document.get("data_sha256"),
        "noise of a reading": f"{noise_n:.3f} N" if noise_n else "",
    }
