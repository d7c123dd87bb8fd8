"""What a residual may depend on, asked without a name for the cause: columns, time, direction, speed, force, lines.

`outside` questions are of things that no effect of the catalogue has: a foreign column, a jump in time, a square of the
temperature, a line in part of the time. They compete with the effects, so that a cause without a name takes none from
the catalogue. The others (direction, speed, curves of the force) are what a wrong form of a named effect leaves, and are
asked only at the end.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from gateway.diagnosis.bench.bench import BLOCKS, SURROUNDINGS, Bench
from gateway.diagnosis.light_statistics import follow_exponentially
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.noise.whitening import fast_noise_n
from gateway.diagnosis.search.hints import lines_hz

_JUMPS_TRIED: Final = 40  # places where a jump in time is looked for
_LAGS_S: Final = (1.0, 4.0, 16.0)
_MOST_PAIRED: Final = 8  # covariates whose products are asked


@dataclass(frozen=True, slots=True)
class Regressors:
    """What the residual may depend on, in which shape; columns (k, rows); among: how many places were tried.

    kind: of the experiment that would show its nature (leftovers.py). names: columns of the recording that it looks at.
    frequency_hz: of a line; at_s: of a jump; slow: (k, rows), what each column is in time before it is multiplied.
    """

    depends_on: str
    shape: str
    columns: Floats
    outside: bool
    among: int = 1
    kind: str = "columns"
    names: tuple[str, ...] = ()
    frequency_hz: float | None = None
    at_s: float | None = None
    slow: Floats | None = None


def list_regressors(bench: Bench, residual_n: Floats, white: Floats) -> Iterator[Regressors]:
    """Yield all regressors, for the raw and the whitened residual of the present model."""
    simulated = bench.measured_n - residual_n
    force = standardise(simulated, bench)
    yield from _column_regressors(bench, force)
    yield from _time_regressors(bench, force)
    yield from _line_regressors(bench, white)
    if float(np.std(simulated[bench.judged])) > fast_noise_n(residual_n[bench.judged]):  # else a trim follows the noise
        yield from _motion_regressors(bench, simulated, force)


def standardise(column: Floats, bench: Bench) -> Floats:
    """Return the column with mean 0 and spread 1 over the judged force rows, zero elsewhere."""
    rows = bench.judged & np.isfinite(column)
    if not rows.any():
        return np.zeros(bench.rows)
    centred = np.where(rows, column - float(np.mean(column[rows])), 0.0)
    spread = float(np.sqrt(np.mean(centred[rows] ** 2)))
    return centred / spread if spread > 1.0e-12 else np.zeros(bench.rows)


def _column_regressors(bench: Bench, force: Floats) -> Iterator[Regressors]:
    columns = {}
    for name in sorted(bench.columns() - {"command_v", "pressure_kpa"}):
        column = standardise(bench.covariate(name), bench)
        if np.any(column):
            columns[name] = column
    for name, column in columns.items():
        foreign = name not in SURROUNDINGS
        own = (name,)
        yield Regressors(name, "in proportion", column[None], foreign, names=own)
        yield Regressors(name, "in proportion to it times the force", (column * force)[None], foreign, names=own)
        yield Regressors(name, "curved", np.vstack([column, column**2]), name != "position_mm", names=own)
        yield Regressors(name, "follows it late, by seconds", _lagged_columns(bench, column), True, names=own)
    for first, second in combinations(list(columns)[:_MOST_PAIRED], 2):
        product = standardise(columns[first] * columns[second], bench)
        shape, both = "in proportion to their product", (first, second)
        yield Regressors(f"{first} x {second}", shape, product[None], True, kind="product", names=both)


def _lagged_columns(bench: Bench, column: Floats) -> Floats:
    """The column behind first-order lags of 1, 4 and 16 s."""
    found = np.zeros((len(_LAGS_S), bench.rows))
    for channel in bench.channels:
        if channel.is_force:
            row_s = float(np.median(np.diff(bench.measurements[channel.recording].time_s)))
            for k, late_s in enumerate(_LAGS_S):
                share = 1.0 - np.exp(-row_s / late_s)
                start = column[channel.rows][0]
                found[k, channel.rows] = start + follow_exponentially(column[channel.rows] - start, share)
    return np.asarray(found * bench.force_rows)


def _slow_waves(bench: Bench) -> Floats:
    """Sines and cosines of one to three periods over each recording, (6, rows)."""
    phase = np.zeros(bench.rows)
    for channel in bench.channels:
        rows = channel.rows.stop - channel.rows.start
        phase[channel.rows] = 2.0 * np.pi * np.arange(rows) / rows
    return np.vstack([turn(count * phase) for count in (1, 2, 3) for turn in (np.sin, np.cos)])


def _time_regressors(bench: Bench, force: Floats) -> Iterator[Regressors]:
    seconds = bench.time_s()
    time = standardise(seconds, bench)
    trend, waves = np.vstack([time, time**2, time**3]), _slow_waves(bench)
    yield Regressors("time", "a slow wander", trend, False, kind="slow", slow=trend)
    yield Regressors("time", "the gain drifts with the time", trend[:2] * force, True, kind="slow", slow=trend[:2])
    yield Regressors("time", "the gain wanders", waves * force, True, kind="slow", slow=waves)
    for place in range(1, _JUMPS_TRIED):
        part = np.zeros(bench.rows)
        for channel in bench.channels:
            if channel.is_force:
                rows = channel.rows.stop - channel.rows.start
                part[channel.rows] = np.arange(rows) * _JUMPS_TRIED >= place * rows
        at_s = float(np.min(seconds[part > 0.0])) if np.any(part) else 0.0
        jump, gain = (part * bench.force_rows)[None], np.vstack([part * force, part])
        yield Regressors("time", f"a jump at {at_s:.0f} s", jump, True, kind="jump", at_s=at_s)
        yield Regressors("time", f"the gain jumps at {at_s:.0f} s", gain, True, kind="jump", at_s=at_s)


def _line_regressors(bench: Bench, white: Floats) -> Iterator[Regressors]:
    seconds = bench.time_s()
    for line_hz in lines_hz(bench, white):
        angle = 2.0 * np.pi * line_hz * seconds
        waves = np.vstack([np.sin(angle), np.cos(angle)]) * bench.force_rows
        among = max(bench.rows // 2, 1)
        shape = f"a line at {line_hz:.3g} Hz"
        yield Regressors("time", shape, waves, False, among, kind="line", frequency_hz=line_hz)
        for name, half in (("first", 0), ("second", 1)):
            inside = (bench.block_of_row % BLOCKS) // (BLOCKS // 2) == half
            half_shape = f"{shape} in the {name} half"
            yield Regressors("time", half_shape, waves * inside, True, among, kind="line", frequency_hz=line_hz)


def _motion_regressors(bench: Bench, simulated_n: Floats, force: Floats) -> Iterator[Regressors]:
    slope = bench.slope_n_per_s(simulated_n)
    moving = np.sign(slope) * bench.force_rows
    time = standardise(bench.time_s(), bench)
    command = standardise(bench.command(), bench)
    yield Regressors("force", "curved", np.vstack([force**2, force**3, force**4]), False, kind="force")
    differs = "differs between rising and falling"
    yield Regressors("direction", differs, moving[None], False, kind="direction")
    yield Regressors("direction", f"{differs}, with the force", (moving * force)[None], False, kind="direction")
    drifting = np.vstack([time, time**2, _slow_waves(bench)]) * moving
    changes = "the difference between rising and falling changes in time"
    yield Regressors("direction", changes, drifting, True, kind="direction")
    rate = standardise(slope, bench)[None]
    yield Regressors("speed", "in proportion to the rate of the force", rate, False, kind="speed")
    yield Regressors("command", "curved", np.vstack([command, command**2, command**3]), False, kind="command")
