"""The charts of a diagnosis: measured and simulated, the residual against whatever it may depend on, spectrum, loop.

`before` is the refitted base model, `after` the extended one, in the same colours everywhere.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.result import Trace
from gateway.reports.axis import Axis
from gateway.reports.diagnosis import peaks, series
from gateway.reports.diagnosis import wording as words
from gateway.reports.diagnosis.series import FALLING, RISING, ResidualRows, TraceResiduals
from gateway.reports.diagnosis.series_chart import SeriesChart, limits
from gateway.reports.figures import NOTHING, Drawing, drawing

_WIDE, _NARROW, _WIDE_HIGH, _HIGH = 1064, 484, 220, 248  # of the drawing, px
_COLUMNS: Final = 260  # of a full-width picture: bands of 4 pixels
_UNITS: Final = {
    "temperature_c": "temperature (°C)",
    "supply_kpa": "supply (kPa)",
    "spindle_rpm": "spindle (rpm)",
    "feed_mm_s": "feed (mm/s)",
    "tilt_deg": "tilt (°)",
    "position_mm": "position (mm)",
    "distance_m": "distance (m)",
}


def axis_name(quantity: str) -> str:
    """Return what stands at an axis; a covariate that nobody knows has its own name."""
    return _UNITS.get(quantity, quantity)


def _width(wide: bool) -> int:
    """Across both columns of the page, or one."""
    return _WIDE if wide else _NARROW


def force_over_time(
    trace: Trace, after: bool, window: tuple[float, float] | None = None, *, wide: bool = True
) -> Drawing:
    """Draw measured and simulated force over time; window: (start, end), s, of a closer look."""
    residuals = TraceResiduals.of(trace)
    start, end = window or (float(residuals.time_s[0]), float(residuals.time_s[-1]))
    in_window = (residuals.time_s >= start) & (residuals.time_s <= end)
    time_s, measured_n = residuals.time_s[in_window], residuals.measured_n[in_window]
    both = [measured_n - left_n[in_window] for left_n in (residuals.before_n, residuals.after_n)]
    chart = SeriesChart(
        Axis(start, max(end, start + 1e-9), "time (s)"),
        Axis(*limits(measured_n, *both), "force (N)"),
        f"Measured and simulated force over time, {'after' if after else 'before'}",
        width=_WIDE if wide else _WIDE // 2,
        height=_WIDE_HIGH,
    )
    columns = _COLUMNS if wide else _COLUMNS // 2
    name = "after" if after else "before"
    chart.envelope(series.envelope(time_s, measured_n, columns), "measured", "measured")
    chart.envelope(series.envelope(time_s, both[int(after)], columns), name, f"simulated, {name}")
    return drawing(chart)


def residual_over_time(trace: Trace, *, changed: bool = True) -> Drawing:
    """Return the chart of the residual over time, before and after, with its largest values named. changed: there is an
    after."""
    residuals = TraceResiduals.of(trace)
    chart = SeriesChart(
        Axis(0.0, max(trace.measurement.duration_s, 1e-9), "time (s)"),
        Axis(*limits(residuals.before_n, residuals.after_n, around=0.0), "measured − simulated (N)"),
        "Residual over time, before and after" if changed else "Residual over time",
        width=_WIDE,
        height=_WIDE_HIGH,
    )
    both = ((residuals.before_n, "before"), (residuals.after_n, "after"))[: 1 + changed]
    for left_n, name in both:
        chart.envelope(series.envelope(residuals.time_s, left_n, _COLUMNS), name, name)
    chart.level(0.0)
    for left_n, name in both:
        _mark_peak(chart, peaks.largest(residuals.time_s, left_n), name)
    return drawing(chart, peaks.describe_residual_over_time(trace.measurement, residuals, changed=changed))


def _mark_peak(chart: SeriesChart, peak: peaks.Peak | None, name: str) -> None:
    if peak is not None:
        chart.mark(peak.x, peak.y, f"{name}: {peaks.signed_force(peak.y)}")


def residual_against(rows: ResidualRows, quantity: str, *, wide: bool = False, changed: bool = True) -> Drawing:
    """Draw the residual over a quantity: clouds before and after, with the means over bins, of which the largest is named."""
    x = rows.quantities[quantity]
    finite = np.isfinite(x)
    chart = _residual_chart(x[finite], rows, quantity, wide)
    both = ((rows.before_n, "before"), (rows.after_n, "after"))[: 1 + changed]
    for left_n, name in both:
        chart.cloud(x[finite], left_n[finite], name)
    found = []
    for left_n, name in both:
        means = series.bin_means(x, left_n)
        chart.line(means.x.tolist(), means.mean.tolist(), f"{name} halo")
        chart.line(means.x.tolist(), means.mean.tolist(), f"{name} thick", f"mean, {name}")
        found.append(peaks.largest(means.x, means.mean))
    chart.level(0.0)
    _mark_peak(chart, found[0], "mean before")
    return drawing(chart, peaks.describe_means(found[0], found[1] if changed else None, _unit(quantity)))


def _unit(quantity: str) -> str:
    """Return ` V` of `command (V)`; empty where no unit is known."""
    _, bracket, unit = axis_name(quantity).partition(" (")
    return f" {unit.removesuffix(')')}" if bracket else ""


def residual_by_direction(rows: ResidualRows, quantity: str, after: bool, *, wide: bool = False) -> Drawing:
    """Draw the residual over the drive, rows of rising and of falling motion apart."""
    x, left_n = rows.quantities[quantity], rows.after_n if after else rows.before_n
    ways = ((RISING, "rising"), (FALLING, "falling"))
    chart = _residual_chart(x, rows, quantity, wide)
    for way, name in ways:
        mask = rows.direction == way
        chart.cloud(x[mask], left_n[mask], name)
    for way, name in ways:
        means = series.bin_means(x[rows.direction == way], left_n[rows.direction == way])
        chart.line(means.x.tolist(), means.mean.tolist(), f"{name} halo")
        chart.line(means.x.tolist(), means.mean.tolist(), f"{name} thick", f"mean, {name}")
    chart.level(0.0)
    return drawing(chart)


def _residual_chart(x: Floats, rows: ResidualRows, quantity: str, wide: bool) -> SeriesChart:
    """Before and after on one scale, so that they can be compared."""
    return SeriesChart(
        Axis(*limits(x, margin=0.02), axis_name(quantity)),
        Axis(*limits(rows.before_n, rows.after_n, around=0.0), "measured − simulated (N)"),
        f"Residual against {axis_name(quantity)}",
        width=_width(wide),
        height=_HIGH,
    )


def loop(traces: Sequence[Trace], after: bool, *, wide: bool = False) -> Drawing:
    """Draw the force over the drive, measured and simulated."""
    label = series.drive(traces[0].measurement)[0]
    alike = [trace for trace in traces if series.drive(trace.measurement)[0] == label]
    x = np.concatenate([series.drive(trace.measurement)[1][trace.measurement.usable] for trace in alike])
    parts = [TraceResiduals.of(trace) for trace in alike]
    measured_n = np.concatenate([part.measured_n for part in parts])
    residuals = [np.concatenate([getattr(part, name) for part in parts]) for name in ("before_n", "after_n")]
    name = "after" if after else "before"
    chart = SeriesChart(
        Axis(*limits(x, margin=0.02), label),
        Axis(*limits(measured_n, measured_n - residuals[0], measured_n - residuals[1]), "force (N)"),
        f"Force against {label}, {name}",
        width=_width(wide),
        height=_HIGH,
        cell_px=2.0,
    )
    left_n = residuals[int(after)]
    chart.cloud(x, measured_n, "measured wider", "measured")
    chart.cloud(x, measured_n - left_n, f"{name} strong", f"simulated, {name}")
    if not left_n.size:
        return drawing(chart)
    place = int(np.argmax(np.abs(left_n)))
    if np.isfinite(x[place]):
        chart.mark(float(x[place]), float(measured_n[place]), f"off by {peaks.signed_force(float(left_n[place]))}")
    return drawing(chart, "Ring: the reading that is furthest from the simulation.")


def spectra(trace: Trace, *, wide: bool = False, changed: bool = True) -> Drawing:
    """Draw the amplitude density of the residual, before and after; NOTHING for a recording that is too short."""
    residuals = TraceResiduals.of(trace)
    both = [series.spectrum(residuals.time_s, left_n) for left_n in (residuals.before_n, residuals.after_n)]
    frequency_hz, before = both[0]
    densities = np.concatenate([before, both[1][1]])
    densities = densities[densities > 0.0]
    if frequency_hz.size < 4 or densities.size == 0:
        return NOTHING
    top = float(densities.max()) * 1.5
    chart = SeriesChart(
        Axis(float(frequency_hz[0]), float(frequency_hz[-1]), "frequency (Hz)", logarithmic=True),
        Axis(max(float(densities.min()) / 1.5, top * 1e-5), top, "residual (N/√Hz)", logarithmic=True),
        "Spectrum of the residual, before and after",
        width=_width(wide),
        height=_HIGH,
    )
    for (hertz, density), name in list(zip(both, ("before", "after"), strict=True))[: 1 + changed]:
        chart.line(hertz.tolist(), np.maximum(density, chart.y.low).tolist(), f"{name} thick", name)
    peak = peaks.spectral_peak(*both[int(changed)])
    if peak is None:
        return drawing(chart, "No peak stands out.")
    chart.mark(peak.x, peak.y, f"{words.number(peak.x)} Hz")
    place = int(np.argmin(np.abs(frequency_hz - peak.x)))
    sizes = [f"{words.number(float(density[place]), 2)} N/√Hz" for _, density in both]
    change = f"{sizes[0]} before, {sizes[1]} after" if changed else sizes[0]
    return drawing(chart, f"The highest peak over what is beside it: {words.number(peak.x)} Hz, {change}.")
