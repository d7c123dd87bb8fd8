"""One calibration run, stair by stair: what to put out now, how far it is, and when a stair has settled.

A stair is left when the data say that it has settled: the means of the two halves of a window differ by no more than the
noise, measured before the first stair, explains. The window begins when, by the pace of the check's stairs (blind_time),
the transient of a step of this size is over: no transport delay can look like rest, nor the slow end of a lag. A stair that
never settles is left after MOST_DWELL_S and counted. Where the check's stairs ring, the others are approached along a ramp
(stair_approach), but for the steps that tell the response. The voltage changes with a reading only: the recording's rows say
when.
Supervision is not here: the controller watches as always. Only what a ladder alone can see is judged: each settled stair
of the check against the model, for sign and scale, and each later one, whether any force answers it at all.
"""

from collections import deque
from dataclasses import replace
from itertools import pairwise
from math import sqrt
from typing import Final, NamedTuple

from gateway.bsfm import Bsfm
from gateway.bsfm.ladder.lone_reading import without_lone_reading
from gateway.bsfm.ladder.plan import RESPONSE_GROUP
from gateway.codes.faults import FaultCode
from gateway.control.messages import gain_sentence, ladder_silent_sentence, restless_sentence, sign_sentence
from gateway.control.runs.blind_time import BlindTime, Trace
from gateway.control.runs.ladder_stairs import CalibrationPlan, PlannedStair, stairs_of
from gateway.control.runs.stair_approach import StairApproach
from gateway.control.sample_conditioning import Reading
from gateway.control.settings import ControlSettings
from gateway.control.supervision.fault_detection import StopCause
from gateway.registers.words import CalibrationPhase

ZERO_S: Final = 0.6  # for rest force and noise: 60 readings of a 100 Hz cell know sigma to 9 % (1 / sqrt(2 (n - 1)))
WINDOW_S: Final = 0.2  # whose two halves are compared
FEWEST_READINGS: Final = 6  # in a window: three in each half
MOST_DWELL_S: Final = 3.5  # then a stair is left, settled or not
REST_LAGS: Final = 8.0  # response lags, until 3000 times less is left of what was pressed before
LONGEST_REST_S: Final = 20.0
GUESSED_DWELL_S: Final = 0.65  # for the time left, until a stair has been timed
SETTLED_SIGMA: Final = 2.0  # of the difference between the means of the halves: noise alone exceeds it once in twenty
SMALLEST_DRIFT_N: Final = 0.03  # less is no drift, however quiet the cell: a third of a usual count (0.1 N)
LEAST_EXPECTED_N: Final = 3.0  # smaller stairs of the check are not judged: friction may hold as much
UNKNOWN_FRICTION_N: Final = 5.0  # of a rise that a machine's friction may keep, which is not the calibration's
LEAST_LATER_N: Final = 15.0  # behind the check: a machine that passed it by little gives twice what is silent there
LOWEST_SHARE, HIGHEST_SHARE, SILENT_SHARE = (
    0.3,
    3.0,
    0.1,
)  # of the expected rise, the first of what is beyond friction; the first two as in supervision.plausibility


class LadderRow(NamedTuple):
    """One settled stair. force_n: mean of the window, zeroed cell force; settled: False if it was left unsettled; rest_n:
    force before the first stair, N."""

    stair: PlannedStair
    force_n: float
    dwell_s: float
    settled: bool
    rest_n: float = 0.0


class RunStep(NamedTuple):
    """What one step answers. progress: 0 .. 1; row: of a stair that has just ended; stair_v: where a ramp leads, V;
    said: a sentence for the log."""

    voltage_v: float
    phase: CalibrationPhase
    progress: float
    eta_s: float
    row: LadderRow | None = None
    stair_v: float | None = None
    said: str = ""

    @property
    def highest_v(self) -> float:
        """Voltage of the stair that this step belongs to, V."""
        return self.voltage_v if self.stair_v is None else max(self.voltage_v, self.stair_v)


class LadderRun:
    """stairs: others than the plan's own. ValueError for a plan that the rig does not allow."""

    end_phase: Final = CalibrationPhase.FITTING

    def __init__(
        self,
        plan: CalibrationPlan,
        settings: ControlSettings,
        model: Bsfm,
        stairs: tuple[PlannedStair, ...] | None = None,
    ) -> None:
        self.plan = plan
        self.stairs = stairs_of(plan, settings.limits, model) if stairs is None else stairs
        self.stop_cause: StopCause | None = None
        self.noise_n = self.rest_n = 0.0
        self.unsettled = 0
        self.done = 0
        self.model = model
        self._rest_v = settings.limits.safe_voltage_v
        left_s = REST_LAGS * settings.supervision.response_lag_s
        self._most_rest_s = min(LONGEST_REST_S, max(MOST_DWELL_S, left_s))
        self._said = ""
        self._began_s: float | None = None
        self._stair_s: float | None = None
        self._window: deque[tuple[float, float]] = deque()
        self._dwelt_s = 0.0
        self._pace, self._trace, self._approach = BlindTime(), Trace(), StairApproach()
        self._last_n = 0.0
        self._from_v = self._out_v = self._rest_v

    @property
    def is_done(self) -> bool:
        """Decide whether every stair has been done."""
        return self.done >= len(self.stairs)

    @property
    def is_waiting(self) -> bool:
        """Decide whether rest force and noise are not known yet."""
        return self._stair_s is None

    @property
    def end_sentence(self) -> str:
        """Sentence of a message at its end."""
        return f"calibration ladder done: {self.done} stairs, {self.unsettled} of them never settled"

    @property
    def eta_s(self) -> float:
        """Seconds that are left, by the stairs so far."""
        dwell_s = self._dwelt_s / self.done if self.done else GUESSED_DWELL_S
        rest_s = 0.0 if self._stair_s is not None else ZERO_S
        return rest_s + dwell_s * (len(self.stairs) - self.done)

    @property
    def branch_share(self) -> float:
        """The branch that the plant is on: 1 rising, -1 falling."""
        return float(self._stair.direction) if self._stair_s is not None and self.stairs else 1.0

    def leave_out(self, now_s: float, voltage_v: float, stands_v: float, *, was_there: bool) -> bool:
        """Leave out every stair as high as this voltage; return whether any stair is left.

        stands_v: what stays out until the next reading. was_there: the output has been at this voltage. If not, the smaller
        stairs of the ladder may still try after a check, and the same stair is no other one on the way down. So is none
        that a stair was to lead down to which is left out.
        """
        phase = self._stair.phase
        tries_again = phase is CalibrationPhase.CHECK and not was_there
        left = [
            stair
            for stair in self.stairs[self.done :]
            if stair.voltage_v < voltage_v or (tries_again and stair.phase is not phase)
        ]
        self.stairs = (*self.stairs[: self.done], *self._without_climbs(left, was_there=was_there))
        self._stair_s, self._from_v, self._out_v = now_s, stands_v, stands_v
        self._window.clear()
        self._trace.clear()
        return self.done < len(self.stairs)

    def _without_climbs(self, stairs: list[PlannedStair], *, was_there: bool) -> list[PlannedStair]:
        """Leave out what is meant as a way down, and would be climbed to: the stair that it came down from is left out."""
        kept: list[PlannedStair] = []
        last_v = self.stairs[self.done - 1].voltage_v if self.done else self._rest_v
        for stair in stairs:
            is_climb = stair.direction < 0 and stair.voltage_v >= last_v
            if not is_climb or (was_there and not kept):
                kept.append(stair)
                last_v = stair.voltage_v
        return kept

    @property
    def next_v(self) -> float:
        """Voltage of the stair that is under way, V."""
        return self._stair.voltage_v

    @property
    def _stair(self) -> PlannedStair:
        return self.stairs[min(self.done, len(self.stairs) - 1)]

    def step(self, now_s: float, reading: Reading) -> RunStep:
        """Advance to now_s and return the voltage and labels to apply.
        reading: of this moment; only new usable ones count."""
        if self._began_s is None:
            self._began_s = now_s
        if not (reading.is_new and reading.is_usable):
            return self._answer(None)
        row = self._advance(now_s, reading)
        self._out_v = self._voltage_v(now_s)
        return self._answer(row)

    def _advance(self, now_s: float, reading: Reading) -> LadderRow | None:
        self._window.append((now_s, reading.cell_n))
        if self._stair_s is None:
            self._measure_zero(now_s)
            return None
        self._trace.append((now_s - self._stair_s, reading.cell_n))
        row = self._row_if_settled(now_s, self._stair_s)
        if row:
            self._check_against_model(row)
            self._begin_next(now_s, row.force_n)
        return row

    def _voltage_v(self, now_s: float) -> float:
        """On the way to the stair, or at it."""
        if self._stair_s is None or self.is_done:
            return self._rest_v
        stair_v = self._stair.voltage_v
        share = self._approach.share(now_s - self._stair_s) if self._ramp_s else 1.0
        return self._from_v + (stair_v - self._from_v) * share

    @property
    def _ramp_s(self) -> float:
        return 0.0 if self._stair.is_step else self._approach.ramp_s

    def _begin_next(self, now_s: float, settled_n: float) -> None:
        if not self._pace.is_known:
            self._pace.observe(self._trace, self._last_n, settled_n, self.noise_n)
            self._approach.observe(self._trace, self._last_n, settled_n, self.noise_n)
            if self._pace.is_known and self._approach.ramp_s:
                self.stairs = tuple(
                    replace(stair, group=RESPONSE_GROUP) if stair.is_step else stair for stair in self.stairs
                )
        self._stair_s, self._last_n, self._from_v = now_s, settled_n, self._out_v
        self._window.clear()
        self._trace.clear()

    def _measure_zero(self, now_s: float) -> None:
        """Rest force and noise, once the force of before has left: else its way down would count as both."""
        assert self._began_s is not None
        window, waited_s = self._window, now_s - self._began_s
        while len(window) > FEWEST_READINGS and window[0][0] < now_s - ZERO_S:
            window.popleft()
        if waited_s < ZERO_S or len(window) < FEWEST_READINGS:
            return
        if (is_still := self._is_still()) or waited_s >= self._most_rest_s:
            forces = self._forces_n()
            self.rest_n = sum(forces) / len(forces)
            self.noise_n = sqrt(sum((force - self.rest_n) ** 2 for force in forces) / (len(forces) - 1))
            if not is_still:
                self._said = restless_sentence(waited_s, self.rest_n, self._drift_n())
            self._begin_next(now_s, self.rest_n)

    def _is_still(self) -> bool:
        """No drift beyond the noise, which neighbouring readings tell: a drift counts little between them."""
        forces = self._forces_n()
        noise_n = sqrt(sum((b - a) ** 2 for a, b in pairwise(forces)) / (2.0 * (len(forces) - 1)))
        return self._drift_n() <= max(SMALLEST_DRIFT_N, SETTLED_SIGMA * noise_n * sqrt(4.0 / len(forces)))

    def _row_if_settled(self, now_s: float, since_s: float) -> LadderRow | None:
        """The row of this stair once it has settled, or has had its time."""
        dwell_s, blind_s = now_s - since_s, self._blind_s()
        window = self._window
        while window and (window[0][0] < since_s + blind_s or self._is_spare(now_s)):
            window.popleft()
        if dwell_s < blind_s + WINDOW_S or len(window) < FEWEST_READINGS:
            return None if dwell_s < MOST_DWELL_S or not window else self._row(dwell_s, settled=False)
        if self._drift_n() <= self._drift_limit_n():
            return self._row(dwell_s, settled=True)
        return self._row(dwell_s, settled=False) if dwell_s >= MOST_DWELL_S else None

    def _blind_s(self) -> float:
        """After a step, until its window may begin: half of that lies behind the transient's end. Where the plant rings, the
        ramp comes before; behind a step the ringing takes as long."""
        blind_s = self._pace.blind_s(self._step_n(), self.noise_n) - (0.5 * WINDOW_S if self._pace.is_known else 0.0)
        return blind_s + (self._approach.ramp_s if self._pace.is_known else 0.0)

    def _step_n(self) -> float:
        """Size of this stair's step by the model."""
        stair, way = self._stair, float(self._stair.direction)
        before_v = self.stairs[self.done - 1].voltage_v if self.done else self._rest_v
        return self.model.force_n(stair.voltage_v, way) - self.model.force_n(before_v, way)

    def _is_spare(self, now_s: float) -> bool:
        return self._window[0][0] < now_s - WINDOW_S and len(self._window) > FEWEST_READINGS

    def _forces_n(self) -> list[float]:
        return without_lone_reading([force_n for _, force_n in self._window])

    def _drift_n(self) -> float:
        forces = self._forces_n()
        half = len(forces) // 2
        return abs(sum(forces[-half:]) - sum(forces[:half])) / half

    def _drift_limit_n(self) -> float:
        """What the noise alone makes of the difference of two half windows."""
        return max(SMALLEST_DRIFT_N, SETTLED_SIGMA * self.noise_n * sqrt(4.0 / len(self._window)))

    def _row(self, dwell_s: float, *, settled: bool) -> LadderRow:
        forces = self._forces_n()
        row = LadderRow(self._stair, sum(forces) / len(forces), dwell_s, settled, self.rest_n)
        self.done += 1
        self.unsettled += not settled
        self._dwelt_s += dwell_s
        return row

    def _check_against_model(self, row: LadderRow) -> None:
        """Sign and scale of a rising stair of the check (A302, A303), or no answer at all (A301), as of any later one."""
        volts = row.stair.voltage_v
        expected_n = self.model.force_n(volts, 1.0) - self.model.force_n(self._rest_v, 1.0)
        rise_n = row.force_n - self.rest_n
        if row.stair.phase is not CalibrationPhase.CHECK or row.stair.direction < 0:
            if expected_n > LEAST_LATER_N and rise_n < SILENT_SHARE * expected_n:
                self._stop_silent(volts, rise_n, expected_n)
            return
        least_n = LOWEST_SHARE * max(0.0, expected_n - UNKNOWN_FRICTION_N)
        if expected_n < LEAST_EXPECTED_N or least_n < rise_n <= HIGHEST_SHARE * expected_n:
            return
        if least_n == 0.0 and abs(rise_n) < LOWEST_SHARE * expected_n:
            return
        if rise_n <= -LOWEST_SHARE * expected_n:
            self.stop_cause = StopCause(FaultCode.SIGN_INVERTED, sign_sentence(rise_n, expected_n))
        elif rise_n < SILENT_SHARE * expected_n:
            self._stop_silent(volts, rise_n, expected_n)
        else:
            self.stop_cause = StopCause(FaultCode.GAIN_WRONG, gain_sentence(rise_n, expected_n))

    def _stop_silent(self, volts: float, rise_n: float, expected_n: float) -> None:
        is_constant = self.noise_n == 0.0 and rise_n == 0.0
        sentence = ladder_silent_sentence(volts, rise_n, expected_n, is_constant=is_constant)
        self.stop_cause = StopCause(FaultCode.NONE, sentence)

    def _answer(self, row: LadderRow | None) -> RunStep:
        said, self._said = self._said, ""
        if self._stair_s is None or not self.stairs:
            return RunStep(self._rest_v, CalibrationPhase.ZERO, 0.0, self.eta_s)
        progress = self.done / len(self.stairs)
        stair_v = self._rest_v if self.is_done else self._stair.voltage_v
        return RunStep(self._out_v, self._stair.phase, progress, self.eta_s, row, stair_v, said)
