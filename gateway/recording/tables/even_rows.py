"""A recording of the gateway's own on even rows, driven by what was really sent.

Its rows stand where readings came in, late by chance and now and then two at once; `command_v` is what was wanted, of which
a wire at 9600 baud carries a part, 5 to 30 ms later. Replayed with what was wanted, a sine of the demo rig was off by
0.28 N; with what was sent, by the reading's own noise of 0.12 N. So the settings are put back to the moments at which they
were written, and rows are laid where an even clock would have put the readings: a row's command is the mean of what stood
on the wire until the next one, which keeps its integral, and a replay with even rows is four times as fast.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.diagnosis.measurement import Floats, Measurement, Settings

_CLOSEST_S: Final = 8.0e-3  # readings that come faster are taken together: a regulator's lag is tens of milliseconds
_FEWEST: Final = 3
_SAME_V: Final = 0.3  # by which what is wanted may differ from what was sent, usually
_SMOOTH: Final = 5  # readings over which the slope is taken that brings one to its tick
_SURE_ROWS: Final = 200
_KERNEL: Final = np.full(_SMOOTH, 1.0 / _SMOOTH)


def resample_evenly(measurement: Measurement, sent_v: Floats, sent_age_s: Floats) -> Measurement:
    """Resample the measurement to even rows.

    sent_v, sent_age_s: of each row, NaN where nothing had been sent. Returns the measurement itself where these do not
    tell its command.
    """
    sent = _distinct_settings(measurement.time_s - sent_age_s, sent_v)
    if measurement.command_v is None or not sent.volts.size or measurement.rows < _FEWEST:
        return measurement
    if not float(np.nanmedian(np.abs(sent_v - measurement.command_v))) < _SAME_V:
        return measurement  # columns of an exported table were renamed: which of them is the command is not ours to say
    clock = _EvenClock(measurement.time_s)
    sent = replace(sent, times_s=sent.times_s - clock.rows_s[0])
    time_s = clock.rows_s - clock.rows_s[0]
    position_m, pressure_pa = measurement.position_m, measurement.pressure_pa
    return replace(
        measurement,
        time_s=time_s,
        force_n=clock.mean(measurement.force_n, measurement.usable),
        usable=clock.count(measurement.usable) > 0,
        repeated=clock.count(measurement.repeated) > 0,
        command_v=sent.interval_means(np.append(time_s, time_s[-1] + clock.row_s)),
        pressure_pa=None if pressure_pa is None else clock.mean(pressure_pa),
        position_m=None if position_m is None else clock.mean(position_m),
        covariates={name: clock.mean(column) for name, column in measurement.covariates.items()},
        even_s=clock.row_s,
        jitter_s=clock.jitter_s,
        sent=sent,
    )


def _distinct_settings(times_s: Floats, volts: Floats) -> Settings:
    """Return what was sent and when, each setting once."""
    known = np.isfinite(times_s) & np.isfinite(volts)
    times_s, volts = times_s[known], volts[known]
    new = np.append(True, np.diff(times_s) > 1.0e-6)[: times_s.size]
    return Settings(times_s[new], volts[new])


class _EvenClock:
    """The even clock behind times that scatter, and means of columns about its ticks."""

    def __init__(self, time_s: Floats) -> None:
        usual_s = period_s = float(np.median(np.diff(time_s)))
        for rows in (
            _SURE_ROWS,
            _SURE_ROWS**2 // 20,
            time_s.size,
        ):  # a period that is a little off miscounts far away only
            part = time_s[:rows]
            ticks = np.round((part - part[0]) / period_s)
            fitted_s = float(np.polyfit(ticks, part, 1)[0]) if ticks[-1] > 0.0 else usual_s
            period_s = fitted_s if abs(fitted_s / usual_s - 1.0) < 0.01 else usual_s
        self.row_s = period_s * max(1, round(_CLOSEST_S / period_s))
        phase = np.exp(2.0j * np.pi * time_s / self.row_s)
        first_s = float(np.angle(np.mean(phase))) / (2.0 * np.pi) * self.row_s
        index = np.round((time_s - first_s) / self.row_s).astype(np.intp)
        self._index: NDArray[np.intp] = index - index[0]
        self.rows_s: Floats = first_s + self.row_s * (index[0] + np.arange(self._index[-1] + 1))
        self._time_s = time_s
        self.jitter_s = float(np.std(time_s - self.rows_s[self._index]))

    def count(self, flags: NDArray[np.bool_]) -> Floats:
        """Return how many flagged rows fall to each tick."""
        return np.asarray(np.bincount(self._index, weights=flags, minlength=self.rows_s.size), dtype=np.float64)

    def mean(self, column: Floats, usable: NDArray[np.bool_] | None = None) -> Floats:
        """Of the rows about each tick (of those that are usable where there are any), brought to its time by the slope
        around it; between neighbours where there is none."""
        weights = np.isfinite(column).astype(float)
        if usable is not None and usable.any():
            weights *= usable
        count = np.bincount(self._index, weights=weights, minlength=self.rows_s.size)
        there = count > 0.0
        if not there.any():
            return np.full(self.rows_s.size, np.nan)
        sums = (
            np.bincount(self._index, weights=weights * np.nan_to_num(values), minlength=count.size)
            for values in (column, self._time_s)
        )
        mean, time_s = (total[there] / count[there] for total in sums)
        resampled: Floats = np.interp(self.rows_s, time_s, mean)
        if mean.size > _SMOOTH:  # interpolated, neighbours would share their noise
            slope = np.gradient(np.convolve(np.pad(mean, _SMOOTH // 2, mode="edge"), _KERNEL, "valid"), time_s)
            resampled[there] = mean + slope * (self.rows_s[there] - time_s)
        return resampled
