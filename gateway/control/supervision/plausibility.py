"""Compare the measured force with the model: residual, sign and gain.

There is no separate test move: the first rise in contact is the test. Expected is the model's force at the voltage
after a first-order lag, above its force at rest. SIGN_INVERTED: the cell goes down where the model goes up, watched for
as long as the output is enabled, with or without contact (a cell with swapped wires never reports contact). GAIN_WRONG:
in contact, under 30 % of the expected rise beyond friction, or over 300 % of it and off by more than friction explains, until
one rise has passed, or a smaller one has long been between half and twice of what is expected: a rig that presses little is
pushed by its workpiece, too. Later the same signature means lost air, which only warns, and so does a force that stays where it
was: friction keeps a vented tool pressed. A force that is still rising is not too low yet: on a rig that has not been
calibrated nobody knows how slow the plant is. While the first rise is too high the target is held back (`is_too_high`), so that
a wrong gain is named before it becomes over-force. What pressed already when the output was enabled, and still leaves, has not
risen: too high is judged by the rise above the lowest force since then. Below the contact threshold a cell that reads ten times
too little looks like air: the tool waits, and the warning A301 tells.
"""

from typing import Final

from gateway.bsfm import Bsfm
from gateway.codes.faults import FaultCode
from gateway.control.inputs import LineStatus
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.leaping_readings import LeapLimit

_SMOOTHING_S: Final = 0.05  # of the measured rise: five readings of a 100 Hz cell
_LASTING_S: Final = 0.3  # a violation must last this long: impacts and lag do not
_LEAST_RISE_N: Final = 1.0  # below it noise decides
_PROVING_RISE_N: Final = 5.0  # a rise of this size with the right gain ends the gain check
_NEAR_S: Final = 3.0  # and a smaller one that has been near what is expected for so long
_NEAR: Final = 2.0  # times more or less: no other unit is so near
_LOWEST_SHARE: Final = 0.3  # of the expected rise beyond friction: kgf read as N is a tenth
_HIGHEST_SHARE: Final = 3.0  # of it: N read as kgf is ten times
_MOVED_SHARE: Final = (
    0.05  # of the expected rise, from the force at rest: a force that has not moved has no wrong unit but no air
)
_TREND_S: Final = 0.2  # over which a force that still rises is told from one that has come to rest
_UNKNOWN_LAG_S: Final = 0.6  # for which it goes on: two lags of 0.3 s
_SLACK_N: Final = 1.0  # beside what friction explains: zero and noise


_RIGHT, _WRONG_GAIN = FaultCode.NONE, FaultCode.GAIN_WRONG


class ExpectedForce:
    """What the model expects now: both branches at the lagged voltage, N of cell force above rest. lag_s: dead time too.
    outside_n: known force that something else brings onto the workpiece (compensation), beside the model's; lacks_air: the
    output device measures too little pressure for its voltage, so that nothing moves the tool."""

    lacks_air = False

    def __init__(self, model: Bsfm, lag_s: float, rest_v: float, stands_v: float | None = None) -> None:
        """stands_v: voltage whose pressure stands at the beginning, None for rest_v."""
        self.lag_s, self.outside_n = lag_s, 0.0
        self._rest_v = rest_v
        self._lagged_v = self._voltage_v = rest_v if stands_v is None else stands_v
        self.use(model)

    def retime(self, lag_s: float) -> None:
        """Replace the lag, s."""
        self.lag_s = lag_s

    def note_around(self, outside_n: float, *, lacks_air: bool) -> None:
        """Note what is known beside the voltage, from now on."""
        self.outside_n, self.lacks_air = outside_n, lacks_air

    def use(self, model: Bsfm) -> None:
        """Expect by another model from now on; the lagged voltage stays."""
        self._model = model
        self._rest_n = model.force_n(self._rest_v, 1.0)
        self._standing_n = model.branch_forces_n(self._voltage_v)
        self._evaluate()

    def advance(self, voltage_v: float, dt_s: float) -> None:
        """Advance the model: voltage_v stood on the output for the last dt_s."""
        if voltage_v != self._voltage_v:
            self._voltage_v, self._standing_n = voltage_v, self._model.branch_forces_n(voltage_v)
        if dt_s > 0.0 and voltage_v != self._lagged_v:
            self._lagged_v += (voltage_v - self._lagged_v) * dt_s / (self.lag_s + dt_s)
            self._evaluate()

    def _evaluate(self) -> None:
        self.rising_n, self.falling_n = self._model.branch_forces_n(self._lagged_v)

    def force_n(self, branch_share: float) -> float:
        """Return the expected cell force at this branch share."""
        return self.falling_n + (0.5 + 0.5 * branch_share) * (self.rising_n - self.falling_n)

    def rise_n(self, branch_share: float) -> float:
        """Return the same above the force at rest."""
        return self.force_n(branch_share) - self._rest_n

    def leaving_n(self, branch_share: float) -> float:
        """Return what of the expected force is still leaving at rest, N: what friction keeps there stays."""
        return self.force_n(branch_share) - self._model.force_n(self._rest_v, branch_share)

    def bounds_n(self) -> tuple[float, float]:
        """Return the least and the most cell force, N, of a machine that follows at once, by the lag or in between: a dead
        time is in the lag, behind which a machine arrives sooner than a lag of that length."""
        rising_n, falling_n = self._standing_n
        return min(rising_n, self.rising_n), max(falling_n, self.falling_n)

    @property
    def kept_n(self) -> float:
        """Force that friction kept pressed at rest when the model was measured, N: a vented tool rises by so much more."""
        return max(0.0, self._rest_n)

    @property
    def width_n(self) -> float:
        """Force that friction alone can explain, N."""
        return abs(self.falling_n - self.rising_n)


class LeftForce:
    """Force that still leaves, at most, by what may stand on the output. A device that hears nothing may keep its voltage:
    what is wanted of it meanwhile takes no force away."""

    def __init__(self, model: Bsfm, lag_s: float, rest_v: float) -> None:
        self._rest_v = self._may_stand_v = self._lagged_v = rest_v
        self.use(model, lag_s)

    def use(self, model: Bsfm, lag_s: float) -> None:
        """Expect by another model and its lag, s, from now on; the lagged voltage stays."""
        self._model, self._lag_s = model, lag_s
        self._rest_n, _ = model.branch_forces_n(self._rest_v)

    @property
    def rise_n(self) -> float:
        """Force above that at rest, N."""
        rising_n, _ = self._model.branch_forces_n(self._lagged_v)
        return rising_n - self._rest_n

    def advance(self, wanted_v: float, line: LineStatus, dt_s: float) -> None:
        """Advance the model by dt_s. Of a line that tells nothing of its settings what is wanted stands."""
        tells = line.sent_v is not None or line.acknowledged_v is None
        stands_v = line.standing_v if tells else wanted_v
        self._may_stand_v = max(self._may_stand_v, wanted_v) if stands_v is None else stands_v
        if self._may_stand_v != self._lagged_v:
            self._lagged_v += (self._may_stand_v - self._lagged_v) * dt_s / (self._lag_s + dt_s)


class RiseCheck:
    """Smoothed rise of the cell force since enable, judged on every new sample."""

    def __init__(self, contact_threshold_n: float) -> None:
        """smooth_n: the cell force behind a low-pass, for sentences, and to hold the target back at once. A fault is judged
        from the same with only a part of a reading that leaps alone: of a cell of 10 Hz one was a wrong sign or gain."""
        self._threshold_n, self._leaps = contact_threshold_n, LeapLimit()
        self.smooth_n = self._calm_n = self._behind_n = self._weight_n = 0.0
        self._readings = 0
        self.start()

    def start(self) -> None:
        """Take the force at rest, at an enable. A positive rest counts as residual force in contact, not as zero error; one
        reading alone that leapt counts as none: it would make the whole rise too high, or too low."""
        self._at_rest_n = self._lowest_n = self._calm_n
        self._base_n = min(self._calm_n, self._threshold_n)
        self._weight_at_rest_n: float | None = None  # of the payload, as the next reading has it
        self._wrong_sign_s = self._wrong_gain_s = self._right_gain_s = self._near_s = 0.0
        self._proven = False
        self.is_too_high = False

    @property
    def is_proven(self) -> bool:
        """Decide whether one rise since the beginning had the right sign and gain."""
        return self._proven

    @property
    def measured_rise_n(self) -> float:
        """Rise of the measured force since the check began, N."""
        return self._calm_n - self._base_n

    @property
    def rise_since_lowest_n(self) -> float:
        """The same without what pressed at the beginning and has left since, N."""
        return self._calm_n - max(self._base_n, self._lowest_n)

    @property
    def wrong_rise_n(self) -> float:
        """Rise that a wrong gain is told with, N."""
        return self.rise_since_lowest_n if self.is_too_high else self.measured_rise_n

    def smooth(self, reading: Reading) -> None:
        """Smooth a new sample, enabled or not. The first ones are averaged: an enable right after the start has a rest too."""
        if reading.is_usable:
            self._weight_n = reading.contact_n - reading.cell_n
            if self._weight_at_rest_n is None:
                self._weight_at_rest_n = self._weight_n
            self._readings += 1
            weight = max(1.0 / self._readings, reading.interval_s / (_SMOOTHING_S + reading.interval_s))
            self.smooth_n += (reading.cell_n - self.smooth_n) * weight
            self._calm_n += (self._leaps.take(reading.cell_n) - self._calm_n) * weight
            self._lowest_n = min(self._lowest_n, self._calm_n)
            self._behind_n += (self._calm_n - self._behind_n) * reading.interval_s / (_TREND_S + reading.interval_s)

    def shift(self, moved_n: float) -> None:
        """Take over a zero that has moved: what was measured before reads that much less now."""
        self._leaps.forget()
        self.smooth_n -= moved_n
        self._calm_n -= moved_n
        self._behind_n -= moved_n
        self._at_rest_n -= moved_n
        self._lowest_n -= moved_n
        self._base_n = min(self._at_rest_n, self._threshold_n)

    def judge(self, response: "ExpectedForce", branch_share: float, touching: bool, interval_s: float) -> FaultCode:
        """Judge one new sample against the rise that the model expects at this branch share."""
        expected_n = response.rise_n(branch_share)
        weight_n = self._weight_at_rest_n or 0.0
        rise_n = self.measured_rise_n + max(0.0, self._weight_n - weight_n)  # in the air a tilt lets the payload pull
        may_leave_n = min(response.kept_n, response.width_n)  # by friction, taken for the zero
        wrong_sign = (
            expected_n >= _LEAST_RISE_N and rise_n <= -max(self._threshold_n, _LOWEST_SHARE * expected_n) - may_leave_n
        )
        self._wrong_sign_s = self._wrong_sign_s + interval_s if wrong_sign else 0.0
        if self._wrong_sign_s >= _LASTING_S:
            return FaultCode.SIGN_INVERTED
        if not self._proven and touching and expected_n >= _LEAST_RISE_N:
            return self._judge_gain(expected_n, response, interval_s)
        self.is_too_high = False
        return _RIGHT

    def _judge_gain(self, expected_n: float, response: "ExpectedForce", interval_s: float) -> FaultCode:
        """What is known to come from outside may show in the reading, or have been there at the last tare. A payload that hung
        on the cell in the air is carried by the workpiece: the reading rises by its weight without any thrust."""
        slack_n, outside_n, hung_n = (
            response.width_n + _SLACK_N,
            response.outside_n,
            max(0.0, self._weight_at_rest_n or 0.0),
        )
        least_n, highest_n = expected_n + min(0.0, outside_n), expected_n + max(0.0, outside_n) + hung_n
        most_n = max(highest_n + slack_n + response.kept_n, _HIGHEST_SHARE * highest_n)
        self.is_too_high = self.smooth_n - max(self._base_n, self._lowest_n) > most_n
        coming_n = max(0.0, self._calm_n - self._behind_n) * _UNKNOWN_LAG_S / _TREND_S
        is_low = least_n - self.measured_rise_n > slack_n
        too_low = is_low and self.measured_rise_n + coming_n < _LOWEST_SHARE * (least_n - slack_n)
        has_moved = self._calm_n - self._at_rest_n > _MOVED_SHARE * expected_n
        wrong = (self.is_too_high and self.rise_since_lowest_n > most_n) or (too_low and has_moved)
        self._wrong_gain_s = self._wrong_gain_s + interval_s if wrong else 0.0
        self._right_gain_s = self._right_gain_s + interval_s if expected_n >= _PROVING_RISE_N and not wrong else 0.0
        is_near = expected_n < _NEAR * self.measured_rise_n < _NEAR * _NEAR * expected_n
        self._near_s = self._near_s + interval_s if is_near else 0.0
        self._proven = self._right_gain_s >= _LASTING_S or self._near_s >= _NEAR_S
        return _WRONG_GAIN if self._wrong_gain_s >= _LASTING_S else _RIGHT
