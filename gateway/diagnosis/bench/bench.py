"""The bench: recordings beside the twin that replays them. One vector of residuals for all recordings and channels.

Channels of a recording: the force and, where command and pressure were both recorded, the pressure times a nominal
area, so that a loop between command and pressure is told from one between pressure and force. A pressure transducer has
a gain and an offset of its own: they are projected out. Rows that may not be judged are zero in every vector.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.diagnosis.bench.parameters import ModelParameters
from gateway.diagnosis.bench.recording_drive import (
    begins_at_rest,
    replays_of,
    rows_after_unseen_settings,
    settled_s,
)
from gateway.diagnosis.measurement import Flags, Floats, Measurement
from gateway.twin.replay.drive import Motion
from gateway.twin.replay.replay import Replay
from gateway.twin.surroundings import COLUMNS

_AT_ONCE: Final = 24  # plants of a replay: a search tries hundreds, and what is between them and the readings is large
BLOCKS: Final = 20  # per recording, for held-out errors and resampling
SURROUNDINGS: Final = COLUMNS  # what a drive takes of a recording's covariates, and of its position
NOMINAL_AREA_M2: Final = 1.0e-4  # turns a measured pressure into newtons


@dataclass(frozen=True, slots=True)
class Channel:
    """Rows of one channel of one recording within the stacked vectors."""

    rows: slice
    recording: int
    is_force: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class Bench:
    """Simulates points for all recordings at once and compares them with what was measured; a value: nothing changes it.

    raw_n, usable, block_of_row, unsettled: (rows,) of all segments; usable: rows that count; block_of_row: the block that
    each is held out with; unsettled: rows that still feel how their recording began. taken_out: columns (rows,) whose
    share of every vector counts as explained: dependences that no effect has a name for. character_n_per_s: (rows,) what
    the time of a character on the settings' line changes in the readings, None where it cannot matter. witnesses: recordings
    that a model is judged by, None for all; the others are fitted with them.
    """

    measurements: tuple[Measurement, ...]
    motion: Motion
    replays: tuple[Replay, ...]
    channels: tuple[Channel, ...]
    raw_n: Floats
    usable: Flags
    block_of_row: NDArray[np.int64]
    unsettled: Flags
    taken_out: tuple[Floats, ...] = ()
    witnesses: frozenset[int] | None = None
    character_n_per_s: Floats | None = None

    @cached_property
    def measured_n(self) -> Floats:
        """Measured readings, (rows,), N, zero where a row does not count."""
        return np.where(self.usable, self.raw_n, 0.0)

    @cached_property
    def force_rows(self) -> Flags:
        """Rows of force channels."""
        return np.concatenate([np.full(each.rows.stop - each.rows.start, each.is_force) for each in self.channels])

    @cached_property
    def nuisance(self) -> Floats:
        """Orthonormal columns (rows, k) that count as explained in every vector."""
        return _nuisance_basis(self)

    @property
    def rows(self) -> int:
        """Number of rows of all segments."""
        return int(self.raw_n.size)

    @cached_property
    def judged(self) -> Flags:
        """Force rows that count, of the recordings that a model is judged by."""
        if self.witnesses is None:
            return np.asarray(self.force_rows & self.usable)
        asked = [np.full(each.rows.stop - each.rows.start, each.recording in self.witnesses) for each in self.channels]
        return np.asarray(self.force_rows & self.usable & np.concatenate(asked))

    def simulate(self, parameter_sets: Sequence[ModelParameters]) -> Floats:
        """Return readings, N; shape (points, rows), all rows."""
        result = np.empty((len(parameter_sets), self.rows))
        for recording, replay in enumerate(self.replays):
            for first in range(0, len(parameter_sets), _AT_ONCE):
                some = slice(first, first + _AT_ONCE)
                models = [(each.plant_of(recording), each.start(recording)) for each in parameter_sets[some]]
                places = {model: place for place, model in enumerate(dict.fromkeys(models))}
                response = replay.run([plant for plant, _ in places], [start for _, start in places])
                of_each = [places[model] for model in models]
                for channel in self.channels:
                    if channel.recording == recording and channel.is_force:
                        result[some, channel.rows] = response.reading_n[of_each]
                    elif channel.recording == recording:
                        result[some, channel.rows] = [response.pressure_pa[place] for place in of_each]
                        result[some, channel.rows] *= NOMINAL_AREA_M2
        if self.character_n_per_s is not None:
            result += np.outer([parameters.character_s for parameters in parameter_sets], self.character_n_per_s)
        return result

    def residuals(self, simulated_n: Floats) -> Floats:
        """Return measured minus simulated, zero where a row does not count; same shape as given."""
        return self.reduce(self.measured_n - simulated_n)

    def reduce(self, columns: Floats) -> Floats:
        """Return the same vectors (..., rows) with rows that do not count at zero and the transducer's own errors taken out."""
        masked: Floats = columns * self.usable
        if self.nuisance.shape[1]:
            masked = masked - (masked @ self.nuisance) @ self.nuisance.T
        return masked

    def without_rows(self, rows: Flags) -> "Bench":
        """Return the same bench without these rows: they are no witness."""
        return replace(self, usable=self.usable & ~rows)

    def without_columns(self, columns: Floats) -> "Bench":
        """Return the same bench where nothing counts that these columns (k, rows) explain."""
        return replace(self, taken_out=(*self.taken_out, *columns))

    def with_measurements(self, measurements: Sequence[Measurement]) -> "Bench":
        """Return the same bench driven by other commands: measurements that are alike but for these."""
        return replace(
            self,
            measurements=tuple(measurements),
            replays=replays_of(measurements, self.motion),
        )

    def slope_n_per_s(self, simulated_n: Floats) -> Floats:
        """Return the rate of the simulated force, per channel."""
        slope = np.zeros(self.rows)
        seconds = self.time_s()
        for channel in self.channels:
            slope[channel.rows] = np.gradient(simulated_n[channel.rows], seconds[channel.rows])
        return slope

    def rms_n(self, residual_n: Floats) -> float:
        """Return the root mean square over the force rows that count."""
        return float(np.sqrt(np.mean(residual_n[self.judged] ** 2)))

    def covariate(self, name: str) -> Floats:
        """Return a column of all recordings along the stacked rows; NaN where a recording lacks it."""
        parts = []
        for channel in self.channels:
            measurement = self.measurements[channel.recording]
            parts.append(measurement.covariates.get(name, np.full(measurement.rows, np.nan)))
        return np.concatenate(parts)

    def time_s(self) -> Floats:
        """Return the times of all rows, (rows,), s."""
        return np.concatenate([self.measurements[channel.recording].time_s for channel in self.channels])

    def command(self) -> Floats:
        """Return the command, V, or the pressure, Pa, whatever drives each recording, (rows,)."""
        parts = []
        for channel in self.channels:
            measurement = self.measurements[channel.recording]
            drive = measurement.command_v if measurement.command_v is not None else measurement.pressure_pa
            parts.append(np.zeros(measurement.rows) if drive is None else drive)
        return np.concatenate(parts)

    def columns(self) -> frozenset[str]:
        """Return names of everything that at least one recording has."""
        names: set[str] = set()
        for each in self.measurements:
            names |= set(each.covariates)
            names |= {"command_v"} if each.command_v is not None else set()
            names |= {"pressure_kpa"} if each.pressure_pa is not None else set()
            names |= {"position_mm"} if each.position_m is not None else set()
        return frozenset(names)


def bench_of(measurements: Sequence[Measurement], motion: Motion = "inferred") -> Bench:
    """Return the bench of these recordings before anything is known of them."""
    channels = tuple(_channels(measurements))
    raw_n = np.concatenate([_channel_n(measurements[each.recording], each) for each in channels])
    flags = np.concatenate([measurements[each.recording].usable for each in channels])
    usable = flags & np.isfinite(raw_n) & ~_unknown_rows(measurements, channels, motion)
    return Bench(
        measurements=tuple(measurements),
        motion=motion,
        replays=replays_of(measurements, motion),
        channels=channels,
        raw_n=raw_n,
        usable=usable,
        block_of_row=np.concatenate([_blocks(each, usable) for each in channels]),
        unsettled=np.zeros(raw_n.size, dtype=bool),
    )


def unsettled_rows(bench: Bench) -> Flags:
    """Return the rows (rows,) that still feel how their recording began: none where it begins at rest."""
    return _unsettled_rows(bench.measurements, bench.channels)


def _unsettled_rows(measurements: Sequence[Measurement], channels: Sequence[Channel]) -> Flags:
    parts = []
    for channel in channels:
        measurement = measurements[channel.recording]
        parts.append(measurement.time_s < (0.0 if begins_at_rest(measurement) else settled_s(measurement)))
    return np.concatenate(parts)


def _unknown_rows(measurements: Sequence[Measurement], channels: Sequence[Channel], motion: Motion) -> Flags:
    """Rows before which nobody knows what went in: after gaps; at the beginning where the motion is measured, for else the
    start is fitted."""
    unseen = np.concatenate([rows_after_unseen_settings(measurements[each.recording]) for each in channels])
    return unseen if motion == "inferred" else unseen | _unsettled_rows(measurements, channels)


def _channel_n(measurement: Measurement, channel: Channel) -> Floats:
    if channel.is_force:
        return measurement.force_n
    assert measurement.pressure_pa is not None
    return measurement.pressure_pa * NOMINAL_AREA_M2


def _channels(measurements: Sequence[Measurement]) -> list[Channel]:
    channels: list[Channel] = []
    start = 0
    for index, measurement in enumerate(measurements):
        both = measurement.command_v is not None and measurement.pressure_pa is not None
        for is_force in (True, False) if both else (True,):
            channels.append(Channel(slice(start, start + measurement.rows), index, is_force))
            start += measurement.rows
    return channels


def _blocks(channel: Channel, usable: Flags) -> NDArray[np.int64]:
    """Block of each row: blocks of one recording hold equally many rows that count."""
    counted = np.cumsum(usable[channel.rows])
    share = np.maximum(counted - 1, 0) * BLOCKS // max(int(counted[-1]), 1)
    return np.asarray(channel.recording * BLOCKS + share)


def _nuisance_basis(bench: Bench) -> Floats:
    """Orthonormal columns (rows, k): one and the pressure itself, for each pressure channel; and what was taken out."""
    columns = [column * bench.usable for column in bench.taken_out]
    for channel in bench.channels:
        if not channel.is_force:
            for values in (np.ones(bench.rows), bench.measured_n):
                column = np.zeros(bench.rows)
                column[channel.rows] = (values * bench.usable)[channel.rows]
                columns.append(column)
    return np.linalg.qr(np.array(columns).T)[0] if columns else np.empty((bench.rows, 0))
