"""The bench: recordings beside the twin that replays them. One vector of residuals for all recordings and channels.

Channels of a recording: the force and, where command and pressure were both recorded, the pressure times a nominal
area, so that a loop between command and pressure is told from one between pressure and force. A pressure transducer has
a gain and an offset of its own: they are projected out. Rows that may not be judged are zero in every vector.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.diagnosis.measurement import Flags, Floats, Measurement
from gateway.diagnosis.search.parameters import Point
from gateway.twin.plant import with_value
from gateway.twin.replay.drive import Motion
from gateway.twin.replay.replay import Drive, Replay
from gateway.twin.surroundings import COLUMNS, Surroundings

MOTIONS: Final[tuple[Motion, ...]] = ("inferred", "measured", "measured-reversed")  # how the slide's may be known
BLOCKS: Final = 20  # per recording, for held-out errors and resampling
SETTLING_S: Final = 1.0  # of a recording's start are not judged, unless it begins at rest at its lowest:
_LOWEST: Final = 0.02  # of the drive's range
_FORGOTTEN: Final = 0.15  # of the drive's range: a drive that went so far has wiped out what friction remembered ...
_LATEST: Final = 0.25  # ... and this share of a recording may go by until it has
REST_S: Final = 0.2  # command and force stand still for so long
_SLACK: Final = 5.0e-3  # of the forces' range that a force at rest may wander
SURROUNDINGS: Final = COLUMNS  # what a drive takes of a recording's covariates, and of its position
NOMINAL_AREA_M2: Final = 1.0e-4  # turns a measured pressure into newtons


@dataclass(frozen=True, slots=True)
class Segment:
    """Rows of one channel of one recording within the stacked vectors."""

    rows: slice
    recording: int
    is_force: bool


class Bench:
    """Simulates points for all recordings at once and compares them with what was measured."""

    def __init__(self, measurements: Sequence[Measurement], motion: Motion = "inferred") -> None:
        self.measurements = tuple(measurements)
        self.motion = motion
        self._replays = [replay_of(each, motion) for each in measurements]
        self.segments = tuple(_segments(measurements))
        self.measured_n = np.concatenate([self._channel(segment) for segment in self.segments])
        self.usable = np.concatenate([measurements[segment.recording].usable for segment in self.segments])
        self.usable = self.usable & np.isfinite(self.measured_n) & ~self._settling()
        self.raw_n = self.measured_n
        self.measured_n = np.where(self.usable, self.measured_n, 0.0)
        self.force_rows = np.concatenate(
            [np.full(segment.rows.stop - segment.rows.start, segment.is_force) for segment in self.segments]
        )
        self.weights: Floats = np.ones(self.measured_n.size)  # of the rows, for who whitens
        self.young: Flags = np.zeros(self.measured_n.size, dtype=bool)  # rows that still feel how it began
        self.block_of_row = np.concatenate([_blocks(segment, self.usable) for segment in self.segments])
        self._taken_out: list[Floats] = []
        self._nuisance = _nuisance(self, self._taken_out)

    @property
    def rows(self) -> int:
        return int(self.measured_n.size)

    @property
    def judged(self) -> Flags:
        """Force rows that count."""
        return np.asarray(self.force_rows & self.usable)

    def simulate(self, points: Sequence[Point]) -> Floats:
        """Readings, N; shape (points, rows), all rows."""
        result = np.empty((len(points), self.rows))
        for recording, replay in enumerate(self._replays):
            plants = [with_value(point.plant, "cell", "zero_n", point.offsets_n[recording]) for point in points]
            response = replay.run(plants, [point.start(recording) for point in points])
            for segment in self.segments:
                if segment.recording == recording:
                    result[:, segment.rows] = (
                        response.reading_n if segment.is_force else response.pressure_pa * NOMINAL_AREA_M2
                    )
        return result

    def residuals(self, simulated_n: Floats) -> Floats:
        """Measured minus simulated, zero where a row does not count; same shape as given."""
        return self.reduced(self.measured_n - simulated_n)

    def reduced(self, columns: Floats) -> Floats:
        """The same vectors (..., rows) with rows that do not count at zero and the transducer's own errors taken out."""
        masked: Floats = columns * self.usable
        if self._nuisance.shape[1]:
            masked = masked - (masked @ self._nuisance) @ self._nuisance.T
        return masked

    def leave_out(self, rows: Flags) -> None:
        """Do not judge these rows any more."""
        self.usable = self.usable & ~rows
        self.measured_n = np.where(self.usable, self.measured_n, 0.0)
        self._nuisance = _nuisance(self, self._taken_out)

    def doubt_times(self, simulated_n: Floats, late_s: float, noise_n: float) -> None:
        """Readings may be early or late by chance, by `late_s` (standard deviation): while the force moves they say less."""
        slope = self.slope_n_per_s(simulated_n)
        self.weights = 1.0 / np.sqrt(1.0 + (slope * late_s / noise_n) ** 2)

    def slope_n_per_s(self, simulated_n: Floats) -> Floats:
        """Rate of the simulated force, per channel."""
        slope = np.zeros(self.rows)
        seconds = self.time_s()
        for segment in self.segments:
            slope[segment.rows] = np.gradient(simulated_n[segment.rows], seconds[segment.rows])
        return slope

    def take_out(self, columns: Floats) -> None:
        """From now on nothing that these columns (k, rows) explain counts: a dependence that no effect has a name for."""
        self._taken_out += list(columns)
        self._nuisance = _nuisance(self, self._taken_out)

    def put_back(self) -> None:
        """Let everything count again that was taken out."""
        self._taken_out = []
        self._nuisance = _nuisance(self, self._taken_out)

    def rms_n(self, residual_n: Floats) -> float:
        """Root mean square over the force rows that count."""
        return float(np.sqrt(np.mean(residual_n[self.judged] ** 2)))

    def covariate(self, name: str) -> Floats:
        """A column of all recordings along the stacked rows; NaN where a recording lacks it."""
        parts = []
        for segment in self.segments:
            measurement = self.measurements[segment.recording]
            parts.append(measurement.covariates.get(name, np.full(measurement.rows, np.nan)))
        return np.concatenate(parts)

    def time_s(self) -> Floats:
        return np.concatenate([self.measurements[segment.recording].time_s for segment in self.segments])

    def command(self) -> Floats:
        """Command, V, or pressure, Pa, whatever drives each recording."""
        parts = []
        for segment in self.segments:
            measurement = self.measurements[segment.recording]
            drive = measurement.command_v if measurement.command_v is not None else measurement.pressure_pa
            parts.append(np.zeros(measurement.rows) if drive is None else drive)
        return np.concatenate(parts)

    def columns(self) -> frozenset[str]:
        """Names of everything that at least one recording has."""
        names: set[str] = set()
        for each in self.measurements:
            names |= set(each.covariates)
            names |= {"command_v"} if each.command_v is not None else set()
            names |= {"pressure_kpa"} if each.pressure_pa is not None else set()
            names |= {"position_mm"} if each.position_m is not None else set()
        return frozenset(names)

    def _settling(self) -> Flags:
        """Rows before which nobody knows what went in; none where a recording begins at rest."""
        parts = []
        for segment in self.segments:
            measurement = self.measurements[segment.recording]
            parts.append(measurement.time_s < (0.0 if begins_at_rest(measurement) else _settled_s(measurement)))
        return np.concatenate(parts)

    def _channel(self, segment: Segment) -> Floats:
        measurement = self.measurements[segment.recording]
        if segment.is_force:
            return measurement.force_n
        assert measurement.pressure_pa is not None
        return measurement.pressure_pa * NOMINAL_AREA_M2


def _settled_s(measurement: Measurement) -> float:
    """When the state before the first row does not matter any more: lags have settled, and friction has slid."""
    settled_s = min(SETTLING_S, 0.1 * measurement.duration_s)
    drive = measurement.command_v if measurement.command_v is not None else measurement.pressure_pa
    if drive is None:
        return settled_s
    gone = np.maximum.accumulate(drive) - np.minimum.accumulate(drive)
    forgotten_s = float(measurement.time_s[int(np.argmax(gone >= _FORGOTTEN * gone[-1]))])
    return min(settled_s + forgotten_s, max(settled_s, _LATEST * measurement.duration_s))


def begins_at_rest(measurement: Measurement) -> bool:
    """Do command and force stand still at first, and the command at its lowest, so that the state before the first row is
    known? Rest further up may have been reached from either side."""
    rows = measurement.time_s < REST_S
    if measurement.command_v is None or rows.sum() < 8 or np.ptp(measurement.command_v[rows]) > 0.0:
        return False
    if measurement.command_v[0] > np.min(measurement.command_v) + _LOWEST * np.ptp(measurement.command_v):
        return False
    first, second = np.array_split(measurement.force_n[rows & measurement.usable], 2)
    if min(first.size, second.size) < 4:
        return False
    error_n = float(np.sqrt(np.var(first) / first.size + np.var(second) / second.size))
    slack_n = _SLACK * float(np.ptp(measurement.force_n[measurement.usable]))  # slow noise wanders, too
    return abs(float(np.mean(first) - np.mean(second))) < max(4.0 * error_n, slack_n) + 1.0e-9


def replay_of(measurement: Measurement, motion: Motion) -> Replay:
    """The twin over a recording; in steps as long as the rows where the reader has made them even."""
    return Replay(drive_of(measurement, motion), measurement.even_s or None)


def drive_of(measurement: Measurement, motion: Motion) -> Drive:
    """What drives the twin in a replay."""
    noise_m = 0.0
    if measurement.position_m is not None:
        noise_m = float(1.4826 * np.median(np.abs(np.diff(measurement.position_m, n=2))) / np.sqrt(6.0))
    columns = dict(measurement.covariates)
    if measurement.position_m is not None:
        columns["position_mm"] = measurement.position_m * 1.0e3
    return Drive(
        time_s=measurement.time_s,
        command_v=measurement.command_v,
        pressure_pa=measurement.pressure_pa,
        position_m=measurement.position_m,
        motion=motion if measurement.position_m is not None else "inferred",
        position_noise_m=noise_m,
        surroundings=Surroundings(**{name: columns[name] for name in SURROUNDINGS if name in columns}),
        repeated=measurement.repeated,
        before_v=None,
        settled_s=0.0 if begins_at_rest(measurement) else min(SETTLING_S, 0.1 * measurement.duration_s),
    )


def _segments(measurements: Sequence[Measurement]) -> list[Segment]:
    segments: list[Segment] = []
    start = 0
    for index, measurement in enumerate(measurements):
        both = measurement.command_v is not None and measurement.pressure_pa is not None
        for is_force in (True, False) if both else (True,):
            segments.append(Segment(slice(start, start + measurement.rows), index, is_force))
            start += measurement.rows
    return segments


def _blocks(segment: Segment, usable: Flags) -> NDArray[np.int64]:
    """Block of each row: blocks of one recording hold equally many rows that count."""
    counted = np.cumsum(usable[segment.rows])
    share = np.maximum(counted - 1, 0) * BLOCKS // max(int(counted[-1]), 1)
    return np.asarray(segment.recording * BLOCKS + share)


def _nuisance(bench: Bench, taken_out: Sequence[Floats]) -> Floats:
    """Orthonormal columns (rows, k): one and the pressure itself, for each pressure channel; and what was taken out."""
    columns = [column * bench.usable for column in taken_out]
    for segment in bench.segments:
        if not segment.is_force:
            for values in (np.ones(bench.rows), bench.measured_n):
                column = np.zeros(bench.rows)
                column[segment.rows] = (values * bench.usable)[segment.rows]
                columns.append(column)
    return np.linalg.qr(np.array(columns).T)[0] if columns else np.empty((bench.rows, 0))
