"""The common error of a machine: what its model leaves in every recording, as columns of what drives it.

No machine is the twin. Its regulator has another order, its seals another law of friction, its pad another bend: what the model
leaves depends on what was commanded, and comes again when that comes again. So it is described by smooth functions of the
simulated pressure and force, with coefficients that all recordings share: delayed pressures (any linear lag is a sum of
them), powers of the force, stop operators of several widths (any hysteresis without rates is a sum of them: Prandtl and
Ishlinskii). A share of every vector that they explain belongs to the machine; what only the new recordings have is not
explained by them, as far as the old ones move through the same states.

A regulator that overshoots turns friction around where the model's does not: on a foreign rig that was most of what was
left. So the delayed pressures are fitted first, and friction is driven by the pressure with what they add: 0.142 N instead of
0.165 N were left there (noise 0.1 N), and a fourth round added nothing.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.catalogue.cylinder import AREA
from gateway.compiled import loop
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.parameters import ModelParameters
from gateway.diagnosis.measurement import Flags, Floats
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.twin.replay.drive import Floats as Series

_DELAYS_S: Final = (-0.04, 0.03, 0.07, 0.12, 0.18, 0.26, 0.4)  # about a regulator's lag, finer where it moves most
_SLOW_LAGS_S: Final = (0.7, 2.0, 6.0, 18.0)  # of pads, seals and amplifiers
_WIDTHS: Final = (0.002, 0.004, 0.008, 0.016, 0.03, 0.06, 0.12, 0.25)  # of the largest pressure: half widths of loops
_ROUNDS: Final = 3  # of driving friction by the pressure as it was found
_RIDGE: Final = (
    1.0e-3  # of a column's own power: with 1e-5 the pressure was found wrong, and 0.16 N were left for 0.142 N
)
_INDEPENDENT: Final = 1.0e-5  # singular value of normalised columns below which they are the same column
_LEAST_SPREAD: Final = 1.0e-6  # of a column, of its own scale: less is rounding

Columns = Callable[[int], Iterator[Floats]]


@dataclass(frozen=True, slots=True)
class ErrorModel:
    """How large each column is on one machine."""

    largest_pa: float  # by which pressure is measured
    largest_n: float  # by which force is measured
    area_m2: float
    added: tuple[tuple[float, ...], ...]  # sizes of the delayed pressures in each round, by which friction is driven
    scale: tuple[float, ...]  # of each column; 0 for one without a spread
    sizes: tuple[float, ...]  # of the scaled columns, N
    common_n: float  # RMS of what they explain beside the model
    left_n: float  # RMS of what neither explains

    def columns(self, bench: Bench, parameters: ModelParameters) -> Floats:
        """Return the scaled columns (k, rows) of these recordings; zero beyond the force channels."""
        series = _Series.of(bench, parameters, self.largest_pa, self.largest_n)
        driving = series.pressure
        for sizes in self.added:
            driving = _drive_friction(
                bench, driving, np.array(sizes) @ series.linear / (self.area_m2 * self.largest_pa)
            )
        scale = np.array(self.scale)
        return np.asarray(series.with_stops(bench, driving)[scale > 0.0] * scale[scale > 0.0, None])

    def error_n(self, columns: Floats) -> Floats:
        """Return the common error at every row, N. columns: of `columns`."""
        return np.asarray(np.array(self.sizes) @ columns)


def fit_error(bench: Bench, fitted: FittedModel) -> ErrorModel:
    """Return the common error of the recordings that a model was fitted to."""
    rows, parameters = bench.judged, fitted.parameters
    largest_pa, largest_n = (max(float(np.max(np.abs(one))) for one in each) for each in _simulate(bench, parameters))
    largest_pa, largest_n = max(largest_pa, 1.0), max(largest_n, 1.0e-9)
    series = _Series.of(bench, parameters, largest_pa, largest_n)
    area_m2, driving, added = parameters.value(AREA), series.pressure, list[tuple[float, ...]]()
    for _ in range(_ROUNDS):
        sizes = _fit_columns(fitted, series.with_stops(bench, driving), rows)[: series.linear.shape[0]]
        added.append(tuple(map(float, sizes)))
        driving = _drive_friction(bench, driving, sizes @ series.linear / (area_m2 * largest_pa))
    columns = series.with_stops(bench, driving)
    spread = np.sqrt(np.mean(columns[:, bench.usable] ** 2, axis=1))
    is_column = spread > _LEAST_SPREAD
    scale = np.where(is_column, 1.0 / np.where(is_column, spread, 1.0), 0.0)
    columns = columns[is_column] * scale[is_column, None]
    sizes = _fit_columns(fitted, columns, rows)
    common_n, left_n = _rms_with_and_without(fitted, columns, rows)
    scales, found = tuple(map(float, scale)), tuple(map(float, sizes))
    return ErrorModel(largest_pa, largest_n, area_m2, tuple(added), scales, found, common_n, left_n)


@dataclass(frozen=True, slots=True)
class _Series:
    """Simulated pressure and force of each recording as shares of the largest, and the columns that do not depend on how
    friction is driven, stacked along the rows."""

    pressure: list[Floats]
    force: list[Floats]
    linear: Floats
    curved: Floats

    @classmethod
    def of(cls, bench: Bench, parameters: ModelParameters, largest_pa: float, largest_n: float) -> "_Series":
        time_s = [each.time_s for each in bench.measurements]
        pressures_pa, forces_n = _simulate(bench, parameters)
        pressure, force = [each / largest_pa for each in pressures_pa], [each / largest_n for each in forces_n]
        linear = _stack(bench, lambda k: _delayed_pressures(time_s[k], pressure[k]))
        return cls(
            pressure, force, linear, _stack(bench, lambda k: _smooth_functions(time_s[k], pressure[k], force[k]))
        )

    def with_stops(self, bench: Bench, driving: list[Floats]) -> Floats:
        """All columns, those of friction as it is driven by this pressure."""
        stops = _stack(bench, lambda k: _stop_operators(driving[k], self.force[k]))
        return np.vstack([self.linear, self.curved, stops])


def _drive_friction(bench: Bench, driving: list[Floats], added: Floats) -> list[Floats]:
    """The pressure with what the delayed ones add to it, a share of the largest."""
    return [each + part for each, part in zip(driving, _split(bench, added), strict=True)]


def _simulate(bench: Bench, parameters: ModelParameters) -> tuple[list[Floats], list[Floats]]:
    """Simulated pressure, Pa, and force, N, of each recording."""
    pressures, forces = [], []
    for recording, replay in enumerate(bench.replays):
        plant = parameters.plant_of(recording)
        result = replay.run([plant], [parameters.start(recording)])
        pressures.append(result.pressure_pa[0])
        forces.append(result.reading_n[0] - plant.cell.zero_n)
    return pressures, forces


def _stack(bench: Bench, columns_of: Columns) -> Floats:
    """Columns of each recording, stacked along the rows of its force channel."""
    channels = [each for each in bench.channels if each.is_force]
    parts = [np.array(list(columns_of(each.recording))) for each in channels]
    stacked = np.zeros((parts[0].shape[0], bench.rows))
    for channel, part in zip(channels, parts, strict=True):
        stacked[:, channel.rows] = part
    return stacked


def _split(bench: Bench, stacked: Floats) -> list[Floats]:
    return [stacked[each.rows] for each in bench.channels if each.is_force]


def _rms_with_and_without(fitted: FittedModel, columns: Floats, rows: Flags) -> tuple[float, float]:
    """RMS at these rows of what the model alone cannot explain but the columns can, and of what neither can, N."""
    model = _drop_unfelt_columns(fitted, rows)
    alone_n, both_n = (
        _rms_beside(each[:, rows], fitted.residual_n[rows]) for each in (model, np.vstack([model, columns]))
    )
    return float(np.sqrt(max(alone_n**2 - both_n**2, 0.0))), both_n


def _rms_beside(columns: Floats, residual_n: Floats) -> float:
    """RMS of what these columns cannot explain."""
    scaled = _normalise(columns)
    sizes = np.linalg.lstsq(scaled.T, residual_n, rcond=_INDEPENDENT)[0]
    return float(np.sqrt(np.mean((residual_n - sizes @ scaled) ** 2)))


def _fit_columns(fitted: FittedModel, columns: Floats, rows: Flags) -> Floats:
    """Size of each column beside the model, by least squares over these rows with a ridge: columns are nearly alike."""
    model = _drop_unfelt_columns(fitted, rows)
    both = np.vstack([model, columns])[:, rows]
    scaled = _normalise(both)
    normal_matrix = scaled @ scaled.T + _RIDGE * np.eye(scaled.shape[0])
    sizes = np.linalg.solve(normal_matrix, scaled @ fitted.residual_n[rows]) / _norms(both)
    return np.asarray(sizes[model.shape[0] :])


def _drop_unfelt_columns(fitted: FittedModel, rows: Flags) -> Floats:
    """The model's derivatives that these rows feel at all."""
    return np.asarray(fitted.jacobian[np.any(fitted.jacobian[:, rows] != 0.0, axis=1)])


def _normalise(columns: Floats) -> Floats:
    return np.asarray(columns / _norms(columns)[:, None])


def _norms(columns: Floats) -> Floats:
    return np.asarray(np.sqrt(np.maximum(np.sum(columns**2, axis=1), 1.0e-300)))


def _delayed_pressures(time_s: Floats, pressure: Floats) -> Iterator[Floats]:
    for delay_s in _DELAYS_S:
        yield np.interp(time_s - delay_s, time_s, pressure) - pressure


def _smooth_functions(time_s: Floats, pressure: Floats, force: Floats) -> Iterator[Floats]:
    """Powers of the force, slow lags, and what grows with the rate."""
    rate = np.gradient(pressure, time_s)
    yield from (pressure, force, force**2, force**3, force**4)
    for lag_s in _SLOW_LAGS_S:
        slow = np.empty_like(pressure)
        _apply_lag(time_s, pressure, lag_s, slow)
        yield from (slow, slow * force)
    yield from (rate * force, np.abs(rate), np.abs(rate) * force, rate**2, rate * np.abs(rate))


def _stop_operators(pressure: Floats, force: Floats) -> Iterator[Floats]:
    """Friction of several widths: as it is, with the force, and rounded."""
    for width in _WIDTHS:
        stopped = np.empty_like(pressure)
        _apply_stop(pressure, width, stopped)
        share = stopped / width
        yield from (share, share * force, share**3)


@loop
def _apply_stop(series: Series, width: float, stopped: Series) -> None:
    """Fill in the stop operator: what a spring of friction `width` is strained by."""
    state = 0.0
    stopped[0] = 0.0
    for row in range(1, series.size):
        state = min(max(state + series[row] - series[row - 1], -width), width)
        stopped[row] = state


@loop
def _apply_lag(time_s: Series, series: Series, lag_s: float, lagged: Series) -> None:
    """Fill in the series behind a first-order lag."""
    lagged[0] = series[0]
    for row in range(1, series.size):
        share = (time_s[row] - time_s[row - 1]) / (lag_s + time_s[row] - time_s[row - 1])
        lagged[row] = lagged[row - 1] + share * (series[row] - lagged[row - 1])
