"""Keep a run below the rig's largest force by what the load cell says, whatever the calibration in use expects.

Two checks. Before a higher stair: were the force to go on as it rose from the stair before to this one, in the shape of the
calibration in use, it must not pass the ceiling; nor as it rose to the highest stair so far, for behind a way down, and amid
friction, the stairs just before tell nothing. And at every sample of a rising stair, for what rises otherwise. The
ceiling is force_max_n less what noise makes of single readings. On the way down what the top has reached may still stand, but
nothing beyond force_max_n: an output that is limited in its slope, or a lag, may rise long after the plan has turned.
"""

from collections import deque
from typing import Final

from gateway.bsfm import Bsfm
from gateway.bsfm.ladder.plan import RISING
from gateway.control.runs.ladder_run import LadderRow
from gateway.control.sample_conditioning import Reading
from gateway.registers.words import CalibrationPhase

_SAMPLES: Final = 3  # in a row, as over-force takes; a mean of them would be reached by one false reading alone
_HIGHER: Final = 1.02  # times the voltage of the highest stair: of a nearer one noise alone would tell the slope
_LEAST_MARGIN_N: Final = 0.4  # below force_max_n: a few counts of a usual amplifier (0.1 N)
_SIGMAS: Final = 3.0  # of the noise of single readings, where that is more


class ForceCeiling:
    """force_max_n: contact force that the rig allows; model: the calibration in use."""

    def __init__(self, force_max_n: float, model: Bsfm, rest_v: float) -> None:
        self._force_max_n = force_max_n
        self._model = model
        self._rest_v = rest_v
        self._recent_n: deque[float] = deque(maxlen=_SAMPLES)
        self._given_n = 0.0
        self._last: tuple[float, float] | None = None
        self._before: tuple[float, float] | None = None
        self._top: tuple[float, float] | None = None  # the highest stair of the ladder or its check
        self._below_top: tuple[float, float] | None = None
        self._rest_n = 0.0

    @property
    def measured_n(self) -> float:
        """Contact force that none of the last samples is below, 0 before the first."""
        return min(self._recent_n, default=0.0)

    def observe(self, reading: Reading) -> None:
        """Take in every reading."""
        if reading.is_new and reading.is_usable:
            self._recent_n.append(reading.contact_n)
            self._given_n = reading.contact_n - reading.cell_n

    def observe_row(self, row: LadderRow) -> None:
        """Take in a stair that has ended."""
        self._rest_n = row.rest_n
        if row.stair.direction < 0:
            self._last = None
            return
        settled = row.stair.voltage_v, row.force_n
        self._before, self._last = self._last, settled
        if row.stair.phase is CalibrationPhase.MINOR_LOOPS:  # friction may have kept more, or less
            return
        if self._top is None or settled[0] > _HIGHER * self._top[0]:
            self._below_top, self._top = self._top, settled
        elif settled[0] >= self._top[0]:
            self._top = settled

    def is_reached(self, noise_n: float) -> bool:
        """Return whether the force of now is as high as it may be."""
        return len(self._recent_n) == _SAMPLES and self.measured_n >= self._ceiling_n(noise_n)

    def is_passed(self, noise_n: float) -> bool:
        """Return whether the force of now is beyond the largest one, whatever the noise."""
        return len(self._recent_n) == _SAMPLES and self.measured_n >= self._force_max_n + _margin_n(noise_n)

    def is_beyond(self, voltage_v: float, noise_n: float) -> bool:
        """Return whether a stair of this voltage would pass the ceiling, after the ones that have settled."""
        return self._expected_n(voltage_v) + self._given_n > self._ceiling_n(noise_n)

    def _ceiling_n(self, noise_n: float) -> float:
        return self._force_max_n - _margin_n(noise_n)

    def _expected_n(self, voltage_v: float) -> float:
        """Cell force of a higher stair, by those below it, and by the highest that the ladder has been at: of partial
        reversals those below it tell nothing behind a way down, and little amid friction. 0 where there is none to go by."""
        expected_n = 0.0
        if self._last:
            expected_n = self._extrapolate(voltage_v, self._last, self._before or (self._rest_v, self._rest_n))
        if self._top and self._below_top:
            expected_n = max(expected_n, self._extrapolate(voltage_v, self._top, self._below_top))
        return expected_n

    def _extrapolate(self, voltage_v: float, last: tuple[float, float], before: tuple[float, float]) -> float:
        """Go on as it rose from one stair (V, N) to the last; 0 for a stair that is no higher."""
        (last_v, last_n), (before_v, before_n) = last, before
        if voltage_v <= last_v:
            return 0.0
        before_model_n, last_model_n, model_n = (
            self._model.force_n(volts, float(RISING)) for volts in (before_v, last_v, voltage_v)
        )
        model_rise_n = last_model_n - before_model_n
        if model_rise_n <= 0.0:
            return last_n
        return last_n + max(0.0, last_n - before_n) * (model_n - last_model_n) / model_rise_n


def _margin_n(noise_n: float) -> float:
    return max(_LEAST_MARGIN_N, _SIGMAS * noise_n)
