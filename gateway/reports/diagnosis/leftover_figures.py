"""A picture of each leftover: the residual over what it depends on, or its spectrum where it is a line."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Final

from gateway.diagnosis.result import Diagnosis, Leftover, Trace
from gateway.reports.diagnosis import charts
from gateway.reports.diagnosis.series import ResidualRows, TraceResiduals, drive, is_constant, join_traces
from gateway.reports.figures import Panel, figure, grid

_OF_THE_DRIVE: Final = ("force", "direction", "speed", "command")  # drawn over the command or the pressure


def leftover_figures(diagnosis: Diagnosis) -> str:
    """Return a picture of each leftover as HTML; empty without any, or without rows to draw."""
    traces = [trace for trace in diagnosis.traces if trace.measurement.usable.any()]
    if not traces or not diagnosis.leftover:
        return ""
    rows = join_traces(traces)
    panels = [panel for rest in diagnosis.leftover for panel in _panels(rest, traces, rows)]
    over_time = [_over_time(rest, traces) for rest in diagnosis.leftover if _is_over_time(rest)]
    return "".join([grid(*panels), *over_time])


def _panels(rest: Leftover, traces: list[Trace], rows: ResidualRows) -> Iterator[Panel]:
    if rest.frequency_hz is not None:
        panel = partial(charts.spectra, _trace_of(rest, traces))
        yield Panel(f"Left: {rest.shape}", panel, "Spectrum of the residual.")
    elif not _is_over_time(rest):
        name, rows = _quantity(rest, traces, rows)
        if name in rows.quantities and not is_constant(rows.quantities[name]):
            title = f"Left: {rest.depends_on}, {rest.shape}"
            yield Panel(title, partial(charts.residual_against, rows, name), f"Residual over {name}.")


def _is_over_time(rest: Leftover) -> bool:
    return rest.depends_on == "time" and rest.frequency_hz is None


def _over_time(rest: Leftover, traces: list[Trace]) -> str:
    drawing = charts.residual_over_time(_trace_of(rest, traces))
    return figure(f"Left: {rest.shape}", drawing, "Residual over time.", "full")


def _trace_of(rest: Leftover, traces: list[Trace]) -> Trace:
    """The recording that has it, else the one with the greatest error."""
    own = [each for each in traces if each.measurement.name == rest.file]
    return own[0] if own else max(traces, key=lambda each: float((TraceResiduals.of(each).after_n ** 2).mean()))


def _quantity(rest: Leftover, traces: list[Trace], rows: ResidualRows) -> tuple[str, ResidualRows]:
    """What the residual is drawn over; a product becomes a quantity of its own."""
    if rest.depends_on in _OF_THE_DRIVE:
        return drive(traces[0].measurement)[0], rows
    if len(rest.columns) == 2 and all(name in rows.quantities for name in rest.columns):
        first, second = (rows.quantities[name] for name in rest.columns)
        return rest.depends_on, replace(rows, quantities={**rows.quantities, rest.depends_on: first * second})
    return rest.depends_on, rows
