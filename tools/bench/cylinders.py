#!/usr/bin/env python3
"""Diagnose every recording of a real cylinder in a folder, one line each: `tools/bench/cylinders.py FOLDER`.

The recordings are not part of the project; `--columns` says how their tables are read (as `diagnose --columns`), the default
is that of Zillen's data. The peer is plain least squares of the force on s, p, s p, z, z^2, z^3, s z and s z^2 (s: direction,
p: pressure, z: place in the stroke), judged as the diagnosis is: on blocks that the fit has not seen.
"""

import argparse
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from gateway.cli.diagnosis.progress_line import show_progress
from gateway.diagnosis import Diagnosis, Measurement, diagnose
from gateway.diagnosis.measurement import Floats
from gateway.progress import reported
from gateway.recording import read_table
from gateway.recording.measurement import measurement_of
from gateway.recording.tables.mapping_file import column_mapping

COLUMNS: Final = "time_s=1:ms,position_mm=5:mm,pressure_kpa=6:bar,force_n=7:n"
HEADER: Final = (
    "recording", "bar", "rows", "pressure alone", "and dry friction", "least squares", "with the causes", "found", "s"
)  # fmt: skip
_BLOCKS: Final = 20
_REACH_S: Final = 0.05
"""Of the slope that tells the direction, to either side."""


@dataclass(frozen=True, slots=True)
class CylinderResult:
    """One recording; errors in N, RMS. alone_n: of force = gain x pressure + offset; base_n: with dry friction besides; both
    where they were fitted. peer_n, left_n: on blocks that were not seen. seconds: of processor."""

    name: str
    bar: float
    rows: int
    alone_n: float
    base_n: float
    peer_n: float
    left_n: float
    found: tuple[str, ...]
    seconds: float

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells of its row in the table."""
        errors = (f"{each:.2f}" for each in (self.alone_n, self.base_n, self.peer_n, self.left_n))
        found = ", ".join(self.found) or "nothing"
        return (self.name, f"{self.bar:.1f}", f"{self.rows}", *errors, found, f"{self.seconds:.0f}")


def columns_of(measurement: Measurement) -> Floats:
    """Return what least squares may use, (rows, 9). ValueError where pressure or position was not recorded."""
    if measurement.pressure_pa is None or measurement.position_m is None:
        raise ValueError(f"{measurement.name}: least squares needs pressure and position")
    time_s, position_m = measurement.time_s, measurement.position_m
    ahead, behind = (np.interp(time_s + way * _REACH_S, time_s, position_m) for way in (1.0, -1.0))
    s, p = np.sign(ahead - behind), measurement.pressure_pa / 1.0e5
    z = (position_m - np.mean(position_m)) / np.ptp(position_m)
    return np.stack([np.ones_like(p), p, s, s * p, z, z**2, z**3, s * z, s * z**2], axis=1)


def held_out_rms_n(columns: Floats, force_n: Floats) -> float:
    """Return what least squares leaves of blocks that it has not seen, N."""
    block = np.arange(force_n.size) * _BLOCKS // force_n.size
    errors_n = np.empty_like(force_n)
    for one in range(_BLOCKS):
        seen = block != one
        sizes = np.linalg.lstsq(columns[seen], force_n[seen], rcond=None)[0]
        errors_n[~seen] = force_n[~seen] - columns[~seen] @ sizes
    return float(np.sqrt(np.mean(errors_n**2)))


def judge(measurement: Measurement) -> CylinderResult:
    """Return the diagnosis of one recording beside plain least squares."""
    began_s = time.process_time()
    found = diagnose([measurement])
    seconds = time.process_time() - began_s
    rows, columns = measurement.usable, columns_of(measurement)
    force_n = measurement.force_n[rows]
    sizes = np.linalg.lstsq(columns[rows, :2], force_n, rcond=None)[0]
    return CylinderResult(
        name=measurement.name.removesuffix(".csv"),
        bar=float(np.mean(columns[rows, 1])),
        rows=found.baseline.samples,
        alone_n=float(np.std(force_n - columns[rows, :2] @ sizes)),
        base_n=found.baseline.rms_n,
        peer_n=held_out_rms_n(columns[rows], force_n),
        left_n=found.extended.held_out_rms_n,
        found=names_of(found),
        seconds=seconds,
    )


def names_of(found: Diagnosis) -> tuple[str, ...]:
    """Return each cause, the strongest first, with those that the recording cannot tell from it."""
    return tuple(" or ".join((cause.name, *(n for n in cause.group if n != cause.name))) for cause in found.causes)


def table(results: Iterable[CylinderResult]) -> Iterator[str]:
    """Yield the lines of a Markdown table as the results come."""
    yield f"| {' | '.join(HEADER)} |"
    yield f"|{' --- |' * len(HEADER)}"
    for result in results:
        yield f"| {' | '.join(result.cells)} |"


def measurements_in(folder: Path, columns: str) -> Iterator[Measurement]:
    """Yield every table of a folder and of those in it, by name."""
    for path in reported("recordings", sorted(folder.rglob("*.csv"))):
        yield measurement_of(read_table(path, column_mapping(columns)))


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--columns", default=COLUMNS, help="as diagnose --columns")
    given = parser.parse_args()
    with show_progress("cylinders"):
        for line in table(judge(each) for each in measurements_in(given.folder, given.columns)):
            print(line, flush=True)


if __name__ == "__main__":
    main()
