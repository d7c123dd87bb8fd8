"""The tables of a diagnosis' report: causes with their gains, what is left, what lost, what cannot be seen, directions."""

from collections.abc import Mapping
from html import escape
from math import sqrt
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.result import Cause, Diagnosis, Estimate
from gateway.reports.diagnosis import wording as words
from gateway.reports.diagnosis.series import FALLING, RISING, ResidualRows
from gateway.reports.frame import table

_MOST_REJECTED: Final = 12


def causes_table(diagnosis: Diagnosis, about: Mapping[str, str]) -> str:
    """Return the table of causes, strongest first. about: what each effect is, by name."""
    if not diagnosis.causes:
        return ""
    heads = ("cause", "confidence", "held-out RMS", "gain", "of the excess", "parameters [95 %]")
    return table(heads, (_cause(diagnosis, cause, about) for cause in diagnosis.causes), "causes")


def _cause(diagnosis: Diagnosis, cause: Cause, about: Mapping[str, str]) -> tuple[str, ...]:
    gain = cause.gain
    won_n = gain.held_out_rms_before_n - gain.held_out_rms_after_n
    low_n, high_n = gain.ci95
    share = min(1.0, max(0.0, gain.share_of_excess)) if np.isfinite(gain.share_of_excess) else 0.0
    return (
        _name(cause, about),
        words.confidence(cause.confidence),
        words.gain_text(cause),
        f"{words.force(won_n)} N<br><small>[{words.force(low_n)}, {words.force(high_n)}]</small>",
        f"<span class='meter'><i style='width:{100.0 * share:.0f}%'></i></span> {words.percent(gain.share_of_excess)}",
        "<br>".join(
            escape(f"{name} {words.estimate(estimate)}{words.previous_value(diagnosis, name, estimate)}")
            for name, estimate in cause.parameters.items()
        ),
    )


def _name(cause: Cause, about: Mapping[str, str]) -> str:
    group = words.others(cause)
    what = f"<br><small>{escape(about[cause.name])}</small>" if about.get(cause.name) else ""
    alike = f"<br><small class='alike'>or {escape(', or '.join(group))}: not told apart here</small>" if group else ""
    return f"<b>{escape(cause.name)}</b>{alike}{what}"


def leftover_table(diagnosis: Diagnosis) -> str:
    """Return the table of what no cause explains; empty where nothing is left."""
    rows = (
        (
            escape(rest.depends_on),
            escape(rest.shape + (f", in {rest.file}" if rest.file else "")),
            words.percent(rest.share),
            escape(rest.experiment or "–"),
        )
        for rest in diagnosis.leftover
    )
    heads = ("depends on", "form", "of what is left", "what would show its nature")
    return table(heads, rows) if diagnosis.leftover else ""


def rejected_table(diagnosis: Diagnosis, about: Mapping[str, str]) -> str:
    """Return the table of causes that competed and lost, the nearest first."""
    ranked = sorted(diagnosis.rejected, key=lambda cause: -cause.gain)
    rows = (
        (escape(cause.name), f"{words.force(cause.gain)} N", escape(about.get(cause.name, "")))
        for cause in ranked[:_MOST_REJECTED]
    )
    more = len(ranked) - _MOST_REJECTED
    rest = f"<p class='small'>{more} more gain less than these.</p>" if more > 0 else ""
    return table(("alternative", "held-out gain", "what it is"), rows) + rest if ranked else ""


def unseen_table(diagnosis: Diagnosis) -> str:
    """Return the table of effects that the recordings cannot show; empty where there is none."""
    rows = ((escape(item.name), escape(item.why), escape(item.experiment)) for item in diagnosis.not_identifiable)
    heads = ("effect", "why it cannot be seen here", "what would show it")
    return table(heads, rows, "unseen") if diagnosis.not_identifiable else ""


def base_table(parameters: Mapping[str, Estimate]) -> str:
    """Return the base model's refitted parameters."""
    rows = (
        (escape(f"{estimate.section}.{name}" if estimate.section else name), escape(words.estimate(estimate)))
        for name, estimate in parameters.items()
    )
    return table(("parameter of the base model", "refitted [95 %]"), rows, "facts") if parameters else ""


def directions_table(rows: ResidualRows) -> str:
    """Return mean and RMS of the residual by the direction of motion."""
    ways = (
        ("rising", rows.direction == RISING),
        ("falling", rows.direction == FALLING),
        ("not yet moved", rows.direction == 0),
    )
    lines = [
        (
            name,
            f"{int(mask.sum()):,}".replace(",", " "),
            *_mean_and_rms(rows.before_n[mask]),
            *_mean_and_rms(rows.after_n[mask]),
        )
        for name, mask in ways
        if mask.any()
    ]
    heads = ("direction", "rows", "mean before", "RMS before", "mean after", "RMS after")
    return table(heads, lines, "numbers")


def _mean_and_rms(left_n: Floats) -> tuple[str, str]:
    return f"{words.force(float(left_n.mean()))} N", f"{words.force(sqrt(float(np.mean(left_n * left_n))))} N"
