"""The report of `diagnose --before A --after B`: the error of the commanded force in two real runs."""

from collections.abc import Iterator
from math import isfinite
from typing import Final

import numpy as np

from gateway.cli.diagnosis.before_after import BeforeAfter, answer_sentence, comparable_sentence
from gateway.diagnosis.force_error import ForceChange, GainVerdict
from gateway.diagnosis.measurement import Floats
from gateway.plants.recorded_force import RecordedForce
from gateway.reports.axis import Axis
from gateway.reports.diagnosis import peaks, series
from gateway.reports.diagnosis import wording as words
from gateway.reports.diagnosis.series_chart import SeriesChart, limits
from gateway.reports.figures import Drawing, drawing, figure
from gateway.reports.frame import Head, page, section, table, tiles

_WIDE, _HIGH, _COLUMNS = 1064, 220, 260
_BADGES: Final = {
    GainVerdict.BETTER: ("better", "good"),
    GainVerdict.WORSE: ("worse", "bad"),
    GainVerdict.UNKNOWN: ("cannot be told", "warn"),
}


def before_after_page(found: BeforeAfter) -> str:
    """Return a self-contained HTML page."""
    runs = (("before", found.before), ("after", found.after))
    head = Head(
        kind="Two runs compared",
        answer=answer_sentence(found),
        badge=_BADGES[found.whole.verdict],
        sentences=(f"{comparable_sentence(found)}.",),
        facts=tuple(
            f"{when}: {run.name} ({f'plant {run.plant}' if run.plant else 'no plant in use'})" for when, run in runs
        ),
    )
    errors = [_errors(run) for _, run in runs]
    heights = limits(*(error_n for _, error_n in errors), around=0.0)
    pictures = (
        figure(f"Force error {when}, {run.name}", _draw(time_s, error_n, when, heights), style="full")
        for (when, run), (time_s, error_n) in zip(runs, errors, strict=True)
    )
    parts = [
        tiles(*_figures(found)),
        section("The error over time", "".join(pictures)),
        section("Held, and on the way", table(("part", "before", "after", "gained [95 %]", "verdict"), _rows(found))),
    ]
    return page(head, parts, {"before": found.before.name, "after": found.after.name})


def _figures(found: BeforeAfter) -> Iterator[tuple[str, str, str]]:
    whole = found.whole
    if isfinite(whole.ratio):
        yield "Error before", words.force(whole.before_rms_n), "N RMS of the commanded force"
        yield "Error after", words.force(whole.after_rms_n), "N RMS, where the same was asked"
        yield "After / before", f"{whole.ratio:.2f}", _interval(whole.ratio_ci95)
    yield "Stretches compared", f"{whole.blocks[0]} and {whole.blocks[1]}", "before and after"


def _interval(ends: tuple[float, float]) -> str:
    return f"95 % interval {ends[0]:.2f} to {ends[1]:.2f}" if isfinite(ends[0]) else "no interval"


def _rows(found: BeforeAfter) -> Iterator[tuple[str, ...]]:
    for name, part in (("all", found.whole), ("held", found.held), ("on the way", found.moving)):
        yield name, *_cells(part)


def _cells(part: ForceChange) -> tuple[str, ...]:
    if not isfinite(part.ratio):
        return "–", "–", "–", "nothing to compare"
    before, after, gain = (f"{words.force(value)} N" for value in (part.before_rms_n, part.after_rms_n, part.gain_n))
    interval = f" {words.interval(part.gain_ci95)}" if isfinite(part.gain_ci95[0]) else ""
    return before, after, f"{gain}{interval}", part.verdict.value


def _errors(run: RecordedForce) -> tuple[Floats, Floats]:
    """Time from the start and measured minus commanded force, NaN where the row does not count."""
    force = run.force
    return force.time_s - force.time_s[0], np.where(force.counts, force.measured_n - force.wanted_n, np.nan)


def _draw(time_s: Floats, error_n: Floats, when: str, heights: tuple[float, float]) -> Drawing:
    chart = SeriesChart(
        Axis(0.0, max(float(time_s[-1]), 1e-9), "time (s)"),
        Axis(*heights, "measured − commanded (N)"),
        f"Error of the commanded force, {when}",
        width=_WIDE,
        height=_HIGH,
    )
    chart.envelope(series.envelope(time_s, error_n, _COLUMNS), when, when)
    chart.level(0.0)
    peak = peaks.largest(time_s, error_n)
    if peak is None:
        return drawing(chart)
    chart.mark(peak.x, peak.y, f"largest: {peaks.signed_force(peak.y)}")
    return drawing(chart, f"Largest: {peaks.signed_force(peak.y)} at {words.number(peak.x)} s.")
