"""Least squares by sums over blocks: held-out errors, gains in chi-square and resampling cost no further simulation.

Everything is linear in small steps around a fitted model. For block b, G_b = X_b X_b^T and h_b = X_b r_b hold all that
a fit needs of it; leaving b out is a subtraction, a bootstrap is a weighted sum.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.parameters import StartParameter
from gateway.diagnosis.measurement import Flags, Floats
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.noise.whitening import Whitener

_SAME_COLUMN: Final = 1.0e-8  # share of a column that the model does not span: rounding
_RIDGE: Final = 0.01  # of a parameter's whole weight: a block that holds all of it says nothing about itself


@dataclass(frozen=True, slots=True)
class ColumnGain:
    """What adding columns would gain: chi-square, and the size of each."""

    gain: float
    sizes: Floats


@dataclass(frozen=True, slots=True)
class ModelSpan:
    """What a model's columns span, as orthonormal rows, and what of the residual they leave; for many NormalEquations."""

    basis: Floats
    left: Floats

    @classmethod
    def of(cls, model: Floats, residual: Floats) -> "ModelSpan":
        """Return the span of a model's columns (k, rows), and what it leaves of a residual (rows,); whitened, or spectra."""
        scale = np.sqrt(np.maximum(np.sum(model**2, axis=1), 1.0e-300))
        basis = orthonormal(model / scale[:, None])
        return cls(basis, residual - (residual @ basis.T) @ basis)


class NormalEquations:
    """Normal equations of candidate columns beside the columns of the present model (whitened, (k, rows), or their spectra).

    raw_power: sum of squares of each column; power: of what the model does not span of it; slope: that by the residual.
    """

    def __init__(self, span: ModelSpan, columns: Floats) -> None:
        self._columns, self._spanned = columns, columns @ span.basis.T
        self.raw_power = np.einsum("ij,ij->i", columns, columns)
        self.power = np.maximum(self.raw_power - np.sum(self._spanned**2, axis=1), 0.0)
        self.slope = columns @ span.left

    @cached_property
    def normal_matrix(self) -> Floats:
        """Products of the columns with each other beside the model, (columns, columns)."""
        return np.asarray(self._columns @ self._columns.T - self._spanned @ self._spanned.T)

    def add(self, indices: list[int]) -> ColumnGain:
        """Return the gain and sizes when these columns join the model; nothing where they are part of it already."""
        if min(self.power[index] / max(self.raw_power[index], 1.0e-300) for index in indices) < _SAME_COLUMN:
            return ColumnGain(0.0, np.zeros(len(indices)))
        scale = np.sqrt(self.power[indices])
        normal_matrix = self.normal_matrix[np.ix_(indices, indices)] / np.outer(scale, scale)
        sizes = np.linalg.lstsq(normal_matrix, self.slope[indices] / scale, rcond=1.0e-9)[0]
        gain = float(sizes @ (self.slope[indices] / scale))
        return ColumnGain(gain, sizes / scale)


def model_span(fitted: FittedModel, whiten: Whitener) -> ModelSpan:
    """Return what a fitted model spans, by spectra of the whitened columns."""
    columns, residual = whiten.spectra(fitted.jacobian), whiten.spectra(fitted.residual_n)
    columns[held_at_bounds(fitted, columns @ residual)] = 0.0
    return ModelSpan.of(columns, residual)


def held_at_bounds(fitted: FittedModel, slope: Floats) -> Flags:
    """Return which columns no step may use, (columns,): of a plant's number at the end of its range that would go on from
    there. What it would save beyond it is not the model's. slope: columns by the residual, both whitened."""
    first, held = len(fitted.parameters.offsets_n), np.zeros(slope.size, dtype=bool)
    for at, parameter in enumerate(fitted.free, first):
        if not isinstance(parameter, StartParameter):  # of a start nobody knows more than its fit
            value, rises = fitted.parameters.value(parameter), slope[at] > 0.0
            held[at] = value >= parameter.high if rises else value <= parameter.low
    return held


def orthonormal(rows: Floats) -> Floats:
    """Return orthonormal rows that span the same."""
    if not rows.shape[0]:
        return rows
    long, small = np.linalg.qr(rows.T)
    _, sizes, vectors = np.linalg.svd(small.T)
    return np.asarray(vectors[sizes > 1.0e-9 * sizes[0]] @ long.T)


def block_sums(bench: Bench, values: Floats) -> Floats:
    """Return the sum of values (rows,) in each block."""
    blocks = int(bench.block_of_row.max()) + 1
    sums: Floats = np.bincount(bench.block_of_row, weights=values, minlength=blocks).astype(np.float64)
    return sums


@dataclass(frozen=True, slots=True)
class HeldOutErrors:
    """Each block judged by the model fitted without it. errors: squared error of the judged force rows; counts: rows;
    squares: squared error of each row, 0 where it is not judged.

    steps: how far offsets and free parameters move when a block is left out, (blocks, size).
    """

    errors: Floats
    counts: Floats
    steps: Floats
    squares: Floats

    @property
    def rms_n(self) -> float:
        """Root mean square of the held-out errors."""
        return float(np.sqrt(np.sum(self.errors) / np.sum(self.counts)))

    @property
    def jackknife(self) -> Floats:
        """Standard error of each parameter, whatever the noise is like within a block."""
        blocks = self.steps.shape[0]
        apart = self.steps - self.steps.mean(axis=0)
        return np.asarray(np.sqrt((blocks - 1.0) / blocks * np.sum(apart**2, axis=0)))


def held_out_errors(bench: Bench, fitted: FittedModel, whiten: Whitener) -> HeldOutErrors:
    """Leave out one block after the other.

    To first order around the fitted point: the step that leaving out a block would cause is computed from the blocks'
    sums, and applied to the raw residual of the block.
    """
    columns, residual = whiten(fitted.jacobian), whiten(fitted.residual_n)
    held = held_at_bounds(fitted, columns @ residual)
    blocks = int(bench.block_of_row.max()) + 1
    scale = np.sqrt(np.maximum(np.sum(columns**2, axis=1), 1.0e-300))
    columns = columns / scale[:, None] * ~held[:, None]
    normal_matrix, slope = columns @ columns.T + _RIDGE * np.eye(columns.shape[0]), columns @ residual
    squares = np.zeros(bench.rows)
    errors, counts, steps = np.zeros(blocks), np.zeros(blocks), np.zeros((blocks, columns.shape[0]))
    for block in range(blocks):
        rows = bench.block_of_row == block
        inside = columns[:, rows]
        left = normal_matrix - inside @ inside.T
        steps[block] = np.linalg.lstsq(left, slope - inside @ residual[rows], rcond=1.0e-10)[0] * ~held / scale
        judged = rows & bench.judged
        error = fitted.residual_n[judged] - steps[block] @ fitted.jacobian[:, judged]
        squares[judged] = error**2
        errors[block], counts[block] = float(error @ error), float(judged.sum())
    return HeldOutErrors(errors, counts, steps, squares)


def covariance(fitted: FittedModel, whiten: Whitener) -> Floats:
    """Return the covariance of offsets and free parameters, from the whitened derivatives; (size, size)."""
    columns = whiten.spectra(fitted.jacobian)
    scale = np.sqrt(np.maximum(np.sum(columns**2, axis=1), 1.0e-300))
    normal_matrix = (columns @ columns.T) / np.outer(scale, scale)
    inverse: Floats = np.linalg.pinv(normal_matrix, rcond=1.0e-10) / np.outer(scale, scale)
    return inverse
