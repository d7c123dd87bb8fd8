"""Decide whether the output moves, waits or holds, by how long the force has been in band and how long it has not.

In band means: target at its goal, contact, and the measured force within the tolerance, for the in-band time without a
break. Without contact there is no band: a reading of 0.2 N in free air is not a held force. Target-unreachable means
the same wait in vain, longer, and that by the force behind a low-pass: of a cell whose noise is as large as the band single
readings are inside however far off the force is. With an in-band time that a single reading fills they are in band, but end no
wait, and where the target is unreachable they are not in band, either. A force that was missed is found again where it is well
inside the band; at its very edge, where noise would let the alarm come and go, once it has been inside for as long as it takes
to be missed. On a long ramp the force is compared with where the target is now, more roughly: air that fails on its way would
else be told at its end, minutes later. A target that comes no nearer to its setpoint, because the first rise looks wrong again
and again, is missed as well.

Bounds: Supervision.unreachable_s, Defaults.in_band_time_s and Defaults.in_band_tolerance_n in control/settings.py.
"""

from math import inf, isfinite, nan
from typing import Final

from gateway.control.demand import Demand
from gateway.control.inputs import LoopInputs
from gateway.control.sample_conditioning import Reading
from gateway.control.state_table import StateEvent

_WAIT, _MOVE, _SETTLE = StateEvent.WAIT, StateEvent.MOVE, StateEvent.SETTLE
_RAMP_BANDS: Final = 2.0  # tolerances, so far a force in contact may be off on a ramp, ...
_RAMP_LATE_S: Final = 0.5  # ... and what the ramp gains in this time: lags that nobody has measured
_SMOOTHING_S: Final = 0.3  # of the force that is called missed
_LASTING_S: Final = 0.5  # inside, from which on it counts against noise: less comes and goes
_WELL_INSIDE_SHARE: Final = 0.8  # of the tolerance, within which a missed force is found again at once
_NOISY_S: Final = 5.0  # beyond the in-band time, so much more neither in band nor unreachable than in band; ...
_NOISY_WAITS: Final = 2.0  # ... and so many times what makes a target unreachable: that is told first
_ANSWER_N: Final = 2.0  # expected force from which a silent cell in voltage mode is worth a warning
_LEAST_SHARE: Final = 0.3  # of the expected force: less is no answer, though friction may keep the tool in contact, ...
_SLACK_N: Final = 1.0  # ... but for so much, which zero and noise may hide


class InBandTimer:
    """unreachable_s: how long out of band until the target counts as unreachable; inside_s: how long it has been inside without
    a break. Times are monotonic seconds."""

    def __init__(self, unreachable_s: float) -> None:
        self._unreachable_s = unreachable_s
        self.restart()

    def retime(self, unreachable_s: float) -> None:
        """Replace the time out of band until the target counts as unreachable, s; what has passed of it counts."""
        self._unreachable_s = unreachable_s

    def restart(self) -> None:
        """Restart both timers: nothing is pursued, or something new."""
        self._in_since_s = self._well_since_s = inf
        self.inside_s = 0.0
        self._out_since_s = inf
        self.in_band = False
        self.unreachable = False

    def update(
        self,
        now_s: float,
        is_inside: bool,
        in_band_time_s: float,
        *,
        is_out: bool | None = None,
        is_well_inside: bool = False,
    ) -> None:
        """Compare once more. is_inside: the comparison of this moment, with the target at its goal; is_out: whether that is
        missed, where it is not the same; is_well_inside: whether it is so far inside that it need not be for long to be
        missed no more."""
        self._in_since_s = min(self._in_since_s, now_s) if is_inside else inf
        self._well_since_s = min(self._well_since_s, now_s) if is_well_inside else inf
        self.inside_s = inside_s = now_s - self._in_since_s
        well_s = now_s - self._well_since_s
        is_found = well_s >= max(in_band_time_s, _SMOOTHING_S) or inside_s >= max(in_band_time_s, self._unreachable_s)
        is_out = not is_inside if is_out is None else is_out and not is_found
        self._out_since_s = min(self._out_since_s, now_s) if is_out else inf
        self.unreachable = now_s - self._out_since_s >= self._unreachable_s
        self.in_band = inside_s >= in_band_time_s and not self.unreachable

    @property
    def is_lasting(self) -> bool:
        """Decide whether the force is in band, and has not only just come into it."""
        return self.in_band and self.inside_s >= _LASTING_S

    def go_along(self, now_s: float, is_near: bool) -> None:
        """Compare on the way to the goal: nothing is in band yet, and what is not near counts as out of it."""
        self.update(now_s, is_near, inf)
        self._in_since_s = inf


class _Approach:
    """How long ago a target has last come nearer to its setpoint than ever before."""

    def __init__(self) -> None:
        self.begin_anew()

    def begin_anew(self) -> None:
        self._setpoint_n, self._least_n, self._since_s = nan, inf, -inf

    def is_held_back(self, now_s: float, setpoint_n: float, applied_n: float, tolerance_n: float) -> bool:
        """Decide it once more. What has been held back goes on again where it comes nearer by the tolerance, not by less."""
        left_n = abs(setpoint_n - applied_n)
        nearer_n = tolerance_n if now_s - self._since_s > _RAMP_LATE_S else 0.0
        if setpoint_n != self._setpoint_n or left_n < self._least_n - nearer_n:
            self._setpoint_n, self._least_n, self._since_s = setpoint_n, left_n, now_s
        return now_s - self._since_s > _RAMP_LATE_S


class SettlingCheck:
    """Decides which event of the state table a step of the force loop is. Times are monotonic seconds.

    unreachable_s: how long out of band, or without an answer in voltage mode, until the target counts as unreachable. is_noisy:
    readings keep crossing the edges of the band, so that for half of the time the force is neither missed nor lastingly held.
    """

    def __init__(self, unreachable_s: float) -> None:
        self._unreachable_s = unreachable_s
        self._band = InBandTimer(unreachable_s)
        self._answer = InBandTimer(unreachable_s)
        self._smooth_n: float | None = None  # contact force behind a low-pass, None where it begins anew
        self._noisy_s = 0.0  # so much longer neither in band nor unreachable than in band
        self._judged_s, self.is_noisy = inf, False
        self._approach = _Approach()
        self._driven_v: float | None = None  # that the band is of; None: it is of a force, or of nothing

    @property
    def in_band(self) -> bool:
        """Decide whether the force has been within the tolerance of the setpoint for the in-band time."""
        return self._band.in_band

    @property
    def holds_force(self) -> bool:
        """Decide whether what is in band is a force, and not a voltage."""
        return self._band.in_band and self._driven_v is None

    @property
    def unreachable(self) -> bool:
        """Decide whether the target has been missed, or a voltage has made no force, for too long."""
        return self._band.unreachable or self._answer.unreachable

    def retime(self, unreachable_s: float) -> None:
        """Replace the time until the target counts as unreachable, s, by that of another calibration's response."""
        self._unreachable_s = unreachable_s
        self._band.retime(unreachable_s)
        self._answer.retime(unreachable_s)

    def restart(self) -> None:
        """Restart all timers: no setpoint is pursued."""
        self._band.restart()
        self._answer.restart()
        self._driven_v = self._smooth_n = None
        self._approach.begin_anew()
        self._wait_anew()

    def judge_force(self, demand: Demand, inputs: LoopInputs, goal_n: float, applied_n: float) -> StateEvent:
        """Return the event of a step in force mode. goal_n: where the ramp of the applied force leads."""
        self._answer.restart()
        if self._driven_v is not None:  # what was held was a voltage
            self._band.restart()
            self._wait_anew()
        self._driven_v = None
        if demand.force_n <= 0.0:
            self._band.restart()
            self._wait_anew()
            return _WAIT if applied_n <= 0.0 else _MOVE
        tolerance_n, in_band_time_s = demand.manner.tolerance_n, demand.manner.in_band_time_s
        if abs(goal_n - applied_n) > tolerance_n:
            self._smooth_n = None
            self._wait_anew()
            self._follow_ramp(demand, inputs, applied_n)
            return _MOVE
        may_be = inputs.touching and abs(demand.force_n - applied_n) <= tolerance_n
        off_n = abs(inputs.reading.contact_n - demand.force_n)
        well_n = tolerance_n * (_WELL_INSIDE_SHARE if self._band.unreachable else 1.0)
        inside, well_inside = may_be and off_n <= tolerance_n, may_be and off_n <= well_n
        out = not may_be or abs(self._smooth(inputs.reading) - demand.force_n) > well_n
        self._band.update(inputs.now_s, inside, in_band_time_s, is_out=out, is_well_inside=well_inside)
        self._judge_noise(inputs.now_s, in_band_time_s)
        if self._band.in_band:
            return _SETTLE
        return _MOVE if inputs.touching or applied_n != goal_n else _WAIT

    def _wait_anew(self) -> None:
        self._noisy_s, self._judged_s, self.is_noisy = 0.0, inf, False

    def _judge_noise(self, now_s: float, in_band_time_s: float) -> None:
        """Of a wide swing the smoothed force crosses the edges of the band, too: it is never missed for long, either. A moment
        in the band takes back what it has lasted: it neither ends what has been noisy nor hides it."""
        passed_s, self._judged_s = max(0.0, now_s - self._judged_s), now_s
        longest_s = in_band_time_s + max(_NOISY_S, _NOISY_WAITS * self._unreachable_s)
        self._noisy_s = max(0.0, self._noisy_s + (-passed_s if self._band.is_lasting else passed_s))
        if self._band.unreachable:
            self._noisy_s = 0.0
        if self._noisy_s > longest_s:
            self._noisy_s, self.is_noisy = longest_s, True
        elif self._noisy_s <= 0.0:
            self.is_noisy = False

    def _smooth(self, reading: Reading) -> float:
        if self._smooth_n is None or not isfinite(self._smooth_n):
            self._smooth_n = reading.contact_n
        elif reading.is_new and reading.is_usable:
            share = reading.interval_s / (_SMOOTHING_S + reading.interval_s)
            self._smooth_n += share * (reading.contact_n - self._smooth_n)
        return self._smooth_n

    def _follow_ramp(self, demand: Demand, inputs: LoopInputs, applied_n: float) -> None:
        if not inputs.touching:
            self._band.restart()
            self._approach.begin_anew()
            return
        is_held_back = self._approach.is_held_back(inputs.now_s, demand.force_n, applied_n, demand.manner.tolerance_n)
        most_n = _RAMP_BANDS * demand.manner.tolerance_n + _RAMP_LATE_S * demand.manner.ramp_n_per_s
        is_near = abs(inputs.reading.contact_n - applied_n) <= most_n
        self._band.go_along(inputs.now_s, is_near and not is_held_back)

    def judge_voltage(self, demand: Demand, inputs: LoopInputs, *, is_slewing: bool) -> StateEvent:
        """Return the event of a step in voltage mode. is_slewing: the output is still on its way.

        A lower voltage is out at once: what was held before has not been held at this one."""
        least_n = _LEAST_SHARE * inputs.expected_n - _SLACK_N
        is_felt = inputs.touching and inputs.reading.contact_n >= least_n
        answered = is_slewing or is_felt or inputs.expected_n < _ANSWER_N
        self._answer.update(inputs.now_s, answered, inf)
        self._wait_anew()  # what was unsteady was a force
        if is_slewing or demand.voltage_v != self._driven_v:
            self._driven_v = demand.voltage_v
            self._band.restart()
        if is_slewing or demand.voltage_v <= 0.0:
            self._band.restart()
            return _MOVE if is_slewing else _WAIT
        self._band.update(inputs.now_s, True, demand.manner.in_band_time_s)
        return _SETTLE if self._band.in_band else _MOVE
