"""The report of a diagnosis: the answer first, then what it stands on."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from html import escape
from typing import Final

from gateway.diagnosis.result import Diagnosis, Trace, Verdict
from gateway.reports.diagnosis import charts, headline, tables
from gateway.reports.diagnosis import wording as words
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
from gateway.reports.figures import Drawing, Panel, figure, grid
from gateway.reports.frame import Head, notes, page, section, tiles

_MOST_TRACES: Final = 2  # recordings that are drawn over time; the others count in all other charts
_MOST_COVARIATES: Final = 6
_MOST_NAMES: Final = 4  # of recordings on the first screen
_BANDS: Final = "Bands reach from the least to the greatest reading of each column of pixels."
_MOST_OPEN: Final = 8  # rows of a table that is shown unfolded


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
    return page(_head(diagnosis, circumstances), body, _provenance(diagnosis, circumstances))


def _head(diagnosis: Diagnosis, circumstances: ReportContext) -> Head:
    names = [trace.measurement.name for trace in diagnosis.traces]
    baseline = diagnosis.baseline
    listed = ", ".join(names[:_MOST_NAMES]) + (
        f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    )
    rig, plant = f"rig {circumstances.rig}", f"plant {circumstances.plant}"
    machine = words.machine_sentence(diagnosis)
    return Head(
        kind="Diagnosis",
        answer=headline.answer_sentence(diagnosis),
        badge=headline.badge(diagnosis),
        sentences=(
            headline.lack_sentence(diagnosis),
            headline.refit_sentence(diagnosis),
            machine[:1].upper() + machine[1:],
        ),
        facts=(listed, rig, plant, _extent(baseline.samples, baseline.duration_s)),
    )


def _extent(samples: int, duration_s: float) -> str:
    return f"{samples:,} readings in {duration_s:,.1f} s".replace(",", " ")


def _provenance(diagnosis: Diagnosis, circumstances: ReportContext) -> dict[str, str]:
    names = [trace.measurement.name for trace in diagnosis.traces]
    return {
        "recordings" if len(names) > 1 else "recording": ", ".join(names),
        "rig": circumstances.rig,
        "plant": circumstances.plant,
        "made": f"{circumstances.made_utc}, computed in {circumstances.runtime_s:.1f} s",
    }


def _summary(diagnosis: Diagnosis, circumstances: ReportContext) -> Iterator[str]:
    yield tiles(*_figures(diagnosis))
    yield _worst_residual(diagnosis)
    yield notes(words.all_notes(diagnosis, circumstances.notes))
    yield section("What is missing in the simulation", tables.causes_table(diagnosis, circumstances.about))
    yield section("What no effect explains", tables.leftover_table(diagnosis) + leftover_figures(diagnosis))
    yield section("What it is worth in commanded force, on the twin", _loop(circumstances.loop))


def _loop(sentences: Sequence[str]) -> str:
    """The answer, then its details."""
    if not sentences:
        return ""
    answer, *details = map(escape, sentences)
    lines = "".join(f"<li>{line}</li>" for line in details)
    return f"<p><strong>{answer}</strong></p>" + (f"<ul>{lines}</ul>" if lines else "")


def _figures(diagnosis: Diagnosis) -> Iterator[tuple[str, str, str]]:
    baseline, extended = diagnosis.baseline, diagnosis.extended
    model = "base model refitted" if diagnosis.machine is None else "the machine as it was"
    yield "Left before", words.force(baseline.rms_n), f"N RMS, {model}"
    if diagnosis.causes:
        reached = "at the noise floor" if extended.reaches_noise_floor else "above the noise floor"
        yield "Left after", words.force(extended.held_out_rms_n), f"N RMS with the causes, held out, {reached}"
        yield "Noise", words.force(baseline.noise_floor_n), f"N, {words.floor_source(diagnosis)}"
        yield "Explained", words.percent(words.explained_share(diagnosis)), "of the squared error above the noise"
        strongest = diagnosis.causes[0]
        yield "Confidence", words.confidence(strongest.confidence), f"in the name {strongest.name}, 0 to 1"
    else:
        yield "Noise", words.force(baseline.noise_floor_n), f"N, {words.floor_source(diagnosis)}"
        yield "Above the noise", words.force(words.excess_n(diagnosis)), "N RMS"


def _by_error(diagnosis: Diagnosis) -> list[Trace]:
    """The recordings that have rows to draw, the greatest error first."""
    traces = [trace for trace in diagnosis.traces if trace.measurement.usable.any()]
    return sorted(traces, key=lambda trace: -float((TraceResiduals.of(trace).before_n ** 2).mean()))


def _worst_residual(diagnosis: Diagnosis) -> str:
    """The residual of the recording with the greatest error: what was there before, and what is left."""
    traces = _by_error(diagnosis)
    if not traces:
        return ""
    name = f", {traces[0].measurement.name}" if len(traces) > 1 else ""
    drawn = charts.residual_over_time(traces[0], changed=bool(diagnosis.causes))
    return section("What the simulation leaves", figure(f"Residual over time{name}", drawn, _BANDS, "full"))


def _pictures(diagnosis: Diagnosis) -> Iterator[str]:
    traces = [trace for trace in diagnosis.traces if trace.measurement.usable.any()]
    if not traces:
        return
    worst = _by_error(diagnosis)
    top = worst[:_MOST_TRACES]
    changed = bool(diagnosis.causes)
    for rank, trace in enumerate(top):
        yield from _over_time(trace, f" · {trace.measurement.name}" if len(traces) > 1 else "", changed)
        if rank:  # the first one's is at the head of the page
            yield figure("Residual over time", charts.residual_over_time(trace, changed=changed), _BANDS, "full")
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
    yield grid(*loops, Panel("Spectrum of the residual", partial(charts.spectra, longest, changed=changed), caption))


def _over_time(trace: Trace, suffix: str, changed: bool) -> Iterator[str]:
    window = most_improved_window(TraceResiduals.of(trace))
    yield f"<h2>Measured and simulated{escape(suffix)}</h2>"
    yield figure("Before: the base model, refitted", charts.force_over_time(trace, after=False), style="full")
    if changed:
        yield figure("After: with the causes", charts.force_over_time(trace, after=True), style="full")
    close = f"Closer, {words.number(window[0])} to {words.number(window[1])} s"
    yield grid(*_before_and_after(close, partial(charts.force_over_time, trace, window=window), changed))


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
                partial(charts.residual_against, rows, name, changed=bool(diagnosis.causes)),
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
    yield section("What to record next", _next(diagnosis, circumstances.run))
    yield section("Alternatives, ranked", tables.rejected_table(diagnosis, circumstances.about))
    count = len(diagnosis.not_identifiable)
    if count:
        summary = (
            f"{count} effects, why, and what would show them"
            if count > 1
            else "One effect, why, and what would show it"
        )
        state = " open" if count <= _MOST_OPEN else ""
        details = f"<details{state}><summary>{summary}</summary>{tables.unseen_table(diagnosis)}</details>"
        yield section("What this recording cannot show", details)
    yield section("The base model", tables.base_table(diagnosis.base_parameters))


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
