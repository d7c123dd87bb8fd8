"""The report of `plant compare`: every number that differs, and both plants over a recording."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.cli.plants.descriptions import answer_sentence
from gateway.cli.plants.simulated_reading import simulate_reading
from gateway.diagnosis.measurement import Floats, Measurement
from gateway.profiles import PlantProfile
from gateway.reports.axis import Axis
from gateway.reports.diagnosis import peaks, series
from gateway.reports.diagnosis import wording as words
from gateway.reports.diagnosis.series_chart import SeriesChart, limits
from gateway.reports.figures import Drawing, drawing, figure
from gateway.reports.frame import Head, page, section, table, tiles

_WIDE, _HIGH = 1064, 220  # of a drawing, px
_COLUMNS: Final = 260


@dataclass(frozen=True, slots=True)
class SimulatedPair:
    """Both plants over one recording: readings of A and B, N, at its rows."""

    measurement: Measurement
    readings_n: tuple[Floats, Floats]

    @property
    def errors_n(self) -> tuple[Floats, Floats]:
        """Measured minus simulated at the rows that may be judged, of A and of B."""
        usable, measured_n = self.measurement.usable, self.measurement.force_n
        first, second = (measured_n[usable] - reading_n[usable] for reading_n in self.readings_n)
        return first, second

    @property
    def sentence(self) -> str:
        """Which of the two is closer to what was measured, and by how much."""
        errors_n = [_rms(error_n) for error_n in self.errors_n]
        first, second = (words.force(error_n) for error_n in errors_n)
        if first == second:
            return f"On {self.measurement.name}, A and B are both off by {first} N RMS"
        better = "B is closer than A" if errors_n[1] < errors_n[0] else "A is closer than B"
        return f"On {self.measurement.name}, {better}: A is off by {first} N RMS, B by {second} N RMS"


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values * values)))


def simulate_pair(measurement: Measurement, plants: tuple[PlantProfile, PlantProfile]) -> SimulatedPair:
    """Run both plants over a recording."""
    first, second = (simulate_reading(measurement, plant)[0] for plant in plants)
    return SimulatedPair(measurement, (first, second))


def plant_comparison_page(differing: dict[str, list[float]], names: tuple[str, str], pair: SimulatedPair | None) -> str:
    """Return a self-contained HTML page. pair: None where no recording was named."""
    difference = answer_sentence(differing, *names)
    head = Head(
        kind="Two plants compared",
        answer=pair.sentence if pair else difference,
        sentences=(f"{difference}.",) if pair else (),
        facts=tuple(f"{letter}: plant {name}" for letter, name in zip("AB", names, strict=True)),
    )
    rows = ([path, words.number(a, 4), words.number(b, 4)] for path, (a, b) in differing.items())
    parts = [
        _figures(differing, pair),
        section("Over the recording", _pictures(pair)) if pair else "",
        section("What differs", table(("number", "A", "B"), rows, "numbers") if differing else ""),
    ]
    return page(head, parts, {"recording": pair.measurement.name if pair else "", "A": names[0], "B": names[1]})


def _figures(differing: dict[str, list[float]], pair: SimulatedPair | None) -> str:
    count = ("Numbers that differ", str(len(differing)), "of the plant")
    if pair is None:
        return tiles(count)
    first, second = (words.force(_rms(error_n)) for error_n in pair.errors_n)
    return tiles(
        ("A is off by", first, "N RMS on the recording"), ("B is off by", second, "N RMS on the recording"), count
    )


def _pictures(pair: SimulatedPair) -> str:
    return (
        figure("Measured, and both plants", _forces(pair), style="full")
        + figure("What each leaves", _residuals(pair), style="full")
    )  # fmt: skip


def _time(pair: SimulatedPair) -> Axis:
    return Axis(0.0, max(pair.measurement.duration_s, 1e-9), "time (s)")


def _forces(pair: SimulatedPair) -> Drawing:
    measurement = pair.measurement
    chart = SeriesChart(
        _time(pair),
        Axis(*limits(measurement.force_n, *pair.readings_n), "force (N)"),
        "Measured and simulated force over time",
        width=_WIDE,
        height=_HIGH,
    )
    chart.envelope(series.envelope(measurement.time_s, measurement.force_n, _COLUMNS), "measured", "measured")
    for reading_n, style, letter in zip(pair.readings_n, ("before", "after"), "AB", strict=True):
        chart.envelope(series.envelope(measurement.time_s, reading_n, _COLUMNS), style, letter)
    return drawing(chart)


def _residuals(pair: SimulatedPair) -> Drawing:
    time_s = pair.measurement.time_s[pair.measurement.usable]
    heights = Axis(*limits(*pair.errors_n, around=0.0), "measured − simulated (N)")
    chart = SeriesChart(_time(pair), heights, "Residual of both plants over time", width=_WIDE, height=_HIGH)
    for error_n, style, letter in zip(pair.errors_n, ("before", "after"), "AB", strict=True):
        chart.envelope(series.envelope(time_s, error_n, _COLUMNS), style, letter)
    chart.level(0.0)
    said = []
    for error_n, letter in zip(pair.errors_n, "AB", strict=True):
        peak = peaks.largest(time_s, error_n)
        if peak is not None:
            size = peaks.signed_force(peak.y)
            chart.mark(peak.x, peak.y, f"{letter}: {size}")
            moment = peaks.describe_moment(pair.measurement, peak.x)
            said.append(f"{letter}: {size} at {words.number(peak.x)} s, {moment}")
    return drawing(chart, f"Largest of {'; of '.join(said)}." if said else "")
