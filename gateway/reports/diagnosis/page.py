"""The report of a diagnosis: one HTML file, no scripts, nothing loaded; light and dark, and fit for paper."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from html import escape
from typing import Final

from gateway import VERSION
from gateway.diagnosis.result import Diagnosis, Trace, Verdict
from gateway.reports.diagnosis import charts, tables
from gateway.reports.diagnosis import wording as words
from gateway.reports.diagnosis.charts import Drawing
from gateway.reports.diagnosis.grid import Panel, figure, grid
from gateway.reports.diagnosis.leftover_figures import leftover_figures
from gateway.reports.diagnosis.series import (
    ResidualRows,
    TraceResiduals,
    dependence,
    drive,
    is_constant,
    join_traces,
    most_improved_window,
)
from gateway.reports.style import inline_style

_MOST_TRACES: Final = 2  # recordings that are drawn over time; the others count in all other charts
_MOST_COVARIATES: Final = 6
_MOST_OPEN: Final = 8  # rows of a table that is shown unfolded
_FRAME: Final = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title><style>{style}</style></head>
<body><main>
{body}
</main></body></html>
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportContext:
    """What the diagnosis itself does not know. about: what each effect is; made_utc: date and time as text;
    notes: on how recordings and plant were found; loop: sentences on the gain in commanded force; run: how to run what to
    record next, where a plan of it was written."""

    rig: str
    plant: str
    made_utc: str
    runtime_s: float
    about: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    loop: tuple[str, ...] = ()
    run: str = ""


def diagnosis_page(diagnosis: Diagnosis, circumstances: ReportContext) -> str:
    """Return the whole page. Text from recordings and profiles is escaped."""
    body = [*_summary(diagnosis, circumstances), *_pictures(diagnosis), *_outlook(diagnosis, circumstances)]
    text = "\n".join(part for part in body if part)
    return _FRAME.format(title=escape(f"Diagnosis: {words.title(diagnosis)}"), style=inline_style(), body=text)


def _summary(diagnosis: Diagnosis, circumstances: ReportContext) -> Iterator[str]:
    yield _heading(diagnosis, circumstances)
    yield _tiles(diagnosis)
    yield _notes(words.all_notes(diagnosis, circumstances.notes))
    yield _section("What is missing in the simulation", tables.causes_table(diagnosis, circumstances.about))
    yield _section("What no effect explains", tables.leftover_table(diagnosis) + leftover_figures(diagnosis))
    lines = "".join(f"<li>{escape(line)}</li>" for line in circumstances.loop)
    yield _section("What it is worth in commanded force, on the twin", f"<ul>{lines}</ul>" if lines else "")


def _heading(diagnosis: Diagnosis, circumstances: ReportContext) -> str:
    names = [trace.measurement.name for trace in diagnosis.traces]
    listed = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
    baseline = diagnosis.baseline
    facts = (
        listed,
        f"rig {circumstances.rig}",
        f"plant {circumstances.plant}",
        _extent(baseline.samples, baseline.duration_s),
    )
    return (
        f"<header><p class='kicker'>Diagnosis · force-gateway {VERSION} · {escape(circumstances.made_utc)}</p>"
        f"<h1>{escape(words.title(diagnosis))}</h1><p class='verdict'>{words.sentence(diagnosis)}</p>"
        f"<p>{escape(words.machine_sentence(diagnosis))}</p>"
        f"<p>{escape(' · '.join(fact for fact in facts if fact))}</p></header>"
    )


def _extent(samples: int, duration_s: float) -> str:
    return f"{samples:,} readings in {duration_s:,.1f} s".replace(",", " ")


def _tiles(diagnosis: Diagnosis) -> str:
    cells = "".join(
        f"<div><dt>{name}</dt><dd>{value}</dd><dd class='unit'>{unit}</dd></div>"
        for name, value, unit in _figures(diagnosis)
    )
    return f"<dl class='tiles'>{cells}</dl>"


def _figures(diagnosis: Diagnosis) -> Iterator[tuple[str, str, str]]:
    baseline, extended = diagnosis.baseline, diagnosis.extended
    yield "Simulation off by", words.force(baseline.rms_n), "N RMS, base model refitted"
    if diagnosis.causes:
        reached = "at the noise floor" if extended.reaches_noise_floor else "above the noise floor"
        yield "With the causes", words.force(extended.held_out_rms_n), f"N RMS, held out, {reached}"
        yield "Noise floor", words.force(baseline.noise_floor_n), f"N, {words.floor_source(diagnosis)}"
        yield "Explained", words.percent(words.explained_share(diagnosis)), "of the squared error above the noise"
    else:
        yield "Noise floor", words.force(baseline.noise_floor_n), f"N, {words.floor_source(diagnosis)}"
        yield "Above the noise", words.force(words.excess_n(diagnosis)), "N RMS"


def _notes(notes: Sequence[str]) -> str:
    lines = "".join(f"<li>{escape(note)}</li>" for note in notes)
    return f"<section class='notes'><h2>Notes</h2><ul>{lines}</ul></section>" if notes else ""


def _section(title: str, content: str) -> str:
    return f"<h2>{title}</h2>{content}" if content else ""


def _pictures(diagnosis: Diagnosis) -> Iterator[str]:
    traces = [trace for trace in diagnosis.traces if trace.measurement.usable.any()]
    if not traces:
        return
    worst = sorted(traces, key=lambda trace: -float((TraceResiduals.of(trace).before_n ** 2).mean()))
    top = worst[:_MOST_TRACES]
    changed = bool(diagnosis.causes)
    for trace in top:
        yield from _over_time(trace, f" · {trace.measurement.name}" if len(traces) > 1 else "", changed)
    if len(traces) > len(top):
        yield f"<p class='small'>The {len(top)} recordings with the greatest error are drawn over time, of {len(traces)}.</p>"
    rows = join_traces(traces)
    yield from _dependences(rows, drive(top[0].measurement)[0], diagnosis)
    yield "<h2>Spectrum and loop</h2>"
    longest = max(traces, key=lambda trace: trace.measurement.rows)
    caption = "Greatest density in each band; a flat line is white noise, a peak is an oscillation."
    loops = [Panel("Loop, before", partial(charts.loop, traces, after=False), "Base model, refitted.")]
    if changed:
        loops.append(Panel("Loop, after", partial(charts.loop, traces, after=True), "Extended model."))
    yield grid(*loops, Panel("Spectrum of the residual", partial(charts.spectra, longest), caption))


def _over_time(trace: Trace, suffix: str, changed: bool) -> Iterator[str]:
    window = most_improved_window(TraceResiduals.of(trace))
    yield f"<h2>Measured and simulated{escape(suffix)}</h2>"
    yield figure("Before: the base model, refitted", charts.force_over_time(trace, after=False), style="full")
    if changed:
        yield figure("After: with the causes", charts.force_over_time(trace, after=True), style="full")
    close = f"Closer, {words.number(window[0])} to {words.number(window[1])} s"
    yield grid(*_before_and_after(close, partial(charts.force_over_time, trace, window=window), changed))
    caption = "Bands reach from the least to the greatest reading of each column of pixels."
    yield figure("Residual over time", charts.residual_over_time(trace), caption, "full")


def _before_and_after(title: str, draw: Callable[..., Drawing], changed: bool) -> list[Panel]:
    """Return the same of both models; of the base model alone where nothing was added to it."""
    panels = [Panel(f"{title}, before", partial(draw, after=False))]
    return [*panels, Panel(f"{title}, after", partial(draw, after=True))] if changed else panels


def _dependences(rows: ResidualRows, axis: str, diagnosis: Diagnosis) -> Iterator[str]:
    yield "<h2>What the residual depends on</h2>"
    if not is_constant(rows.quantities[axis]):
        draw = partial(charts.residual_by_direction, rows, axis)
        yield grid(*_before_and_after("By direction", draw, bool(diagnosis.causes)))
    yield f"<h3>By direction, in figures</h3>{tables.directions_table(rows)}"
    moving = [name for name, values in rows.quantities.items() if not is_constant(values)]
    named = {rest.depends_on for rest in diagnosis.leftover}
    strength = {
        name: (dependence(rows.quantities[name], rows.before_n), dependence(rows.quantities[name], rows.after_n))
        for name in moving
    }
    covariates = sorted(
        (name for name in moving if name != axis), key=lambda name: (name not in named, -max(strength[name]))
    )
    quantities = ([axis] if axis in moving else []) + covariates[:_MOST_COVARIATES]
    yield grid(
        *(
            Panel(
                f"Against {charts.axis_name(name)}",
                partial(charts.residual_against, rows, name),
                _dependence_caption(*strength[name]),
            )
            for name in quantities
        )
    )
    yield _not_drawn(rows, covariates)


def _dependence_caption(before: float, after: float) -> str:
    return f"Its means carry {words.percent(before)} of the residual's variance before, {words.percent(after)} after."


def _not_drawn(rows: ResidualRows, covariates: Sequence[str]) -> str:
    still = [name for name, values in rows.quantities.items() if is_constant(values)]
    sentences = []
    if len(covariates) > _MOST_COVARIATES:
        sentences.append(f"{len(covariates) - _MOST_COVARIATES} more columns carry less than these.")
    if still:
        names = words.join_words(still[:8] + ([f"{len(still) - 8} more"] if len(still) > 8 else []))
        sentences.append(f"Constant, so nothing can be said about: {names}.")
    return f"<p class='small'>{escape(' '.join(sentences))}</p>" if sentences else ""


def _outlook(diagnosis: Diagnosis, circumstances: ReportContext) -> Iterator[str]:
    yield _section("What to record next", _next(diagnosis, circumstances.run))
    yield _section("Alternatives, ranked", tables.rejected_table(diagnosis, circumstances.about))
    count = len(diagnosis.not_identifiable)
    if count:
        summary = (
            f"{count} effects, why, and what would show them"
            if count > 1
            else "One effect, why, and what would show it"
        )
        state = " open" if count <= _MOST_OPEN else ""
        details = f"<details{state}><summary>{summary}</summary>{tables.unseen_table(diagnosis)}</details>"
        yield _section("What this recording cannot show", details)
    yield _section("The base model", tables.base_table(diagnosis.base_parameters))
    yield f"<p class='small'>Computed in {circumstances.runtime_s:.1f} s.</p>"


def _next(diagnosis: Diagnosis, run: str) -> str:
    """Only what matters after this verdict: a confirmed cause needs no more recordings."""
    proposals = words.next_recordings(diagnosis)
    lines = "".join(f"<li>{escape(proposal)}{_shown_effects(names)}</li>" for proposal, names in proposals)
    first = (
        "The cause is confirmed; these would show what this recording could not."
        if diagnosis.verdict is Verdict.CONFIRMED
        else ""
    )
    last = f"<p>{escape(run)}</p>" if run else ""
    return (f"<p>{first}</p>" if first else "") + f"<ol class='next'>{lines}</ol>{last}" if lines else last


def _shown_effects(names: Sequence[str]) -> str:
    return f" <small>shows {escape(words.join_words(names))}</small>" if names else ""
