"""The self-test, step by step: rest, a slow rise to a first level, a step to a second, and that voltage held.

Nothing passes the stated force, whatever the calibration in use expects: the first level is below half of it, reached slowly;
the second is set by what the first one has shown; and at every reading a force near the stated one ends the test. A run of
its own, asked as a ladder is: the controller's supervision goes on, and a fault of it is the verdict on what it is about
(items.report_of). A reading that leaps counts whole only when the next one says so, too: a digit that was disturbed on the wire
is no wrong sign or span.
"""

from enum import Enum
from math import sqrt
from typing import Final

from gateway.bsfm.ladder.plan import RISING
from gateway.codes.faults import FaultCode
from gateway.control.inputs import LineStatus
from gateway.control.runs.ladder_run import RunStep
from gateway.control.sample_conditioning import Reading
from gateway.control.self_test import judgement
from gateway.control.self_test.items import (
    FAILED,
    FORCE_ITEMS,
    NOT_TESTED,
    PASSED,
    Finding,
    Item,
    RunEnding,
    SelfTestPlan,
    SelfTestReport,
    report_of,
)
from gateway.control.self_test.judgement import Known, mean_error_n
from gateway.control.self_test.levels import FORCE_SHARE, NEAR_SHARE, Levels
from gateway.control.self_test.line_watch import LineWatch
from gateway.control.self_test.measurements import (
    MEAN_S,
    count_n,
    is_constant,
    last,
    mean_n,
    noise_n,
    rate_n_per_s,
    readings_to_know,
    still_rises,
    without_lone_reading,
)
from gateway.control.self_test.rest import judge_rest, why_no_force
from gateway.control.self_test.stage_times import HOLD_S, READ_REST_S, RISE_S, StageTimes
from gateway.control.supervision.fault_detection import StopCause
from gateway.control.supervision.leaping_readings import LeapLimit
from gateway.registers.words import CalibrationPhase

_FEWEST: Final = 3  # readings whose mean is compared with the stated force
_RECENT: Final = 30  # readings, of which one that is alone tells no fall
_SURE_SIGMAS: Final = 4.0
_LEAST_FALL_N: Final = 0.4  # of a force that goes the wrong way, below the supervision's 0.5 N that would be a fault
_LEAST_EXPECTED_N: Final = 0.5


_Stage = Enum("_Stage", ("REST", "FIRST", "SECOND", "HOLD", "DONE"))


class SelfTestRun:
    """One self-test, asked as a LadderRun is. ValueError for a rig that offers none. outside_n: known force of now that neither
    slide nor payload gives, N."""

    end_phase: Final = CalibrationPhase.TESTED
    stop_cause: StopCause | None = None

    def __init__(self, plan: SelfTestPlan, known: Known) -> None:
        if known.settings.self_test is None:
            raise ValueError("this rig offers no self-test: give it `self_test: {force_n: 5}`")
        self.plan, self.model = plan, known.model
        self.findings: dict[Item, Finding] = {}
        self._known = known
        self._force_n = known.settings.self_test.force_n
        self._times = StageTimes(known.response_s, moves=self._force_n > 0.0)
        self._stage, self._stage_s = _Stage.REST, 0.0
        self._began_s: float | None = None
        self._now_s = 0.0
        self._trace: list[tuple[float, float]] = []
        self._all: list[tuple[float, float]] = []
        self._volts = known.rest_v
        self._rest_n = self._first_n = self._second_n = self._weight_n = 0.0
        self._first_count = 0
        self.outside_n = 0.0
        self.noise_n = 0.0
        self._lines, self._leaps = LineWatch(), LeapLimit()
        self._levels: Levels | None = None
        self._pressures: list[tuple[float, float]] = []

    # -- as every run

    @property
    def is_done(self) -> bool:
        """Decide whether it is over."""
        return self._stage is _Stage.DONE

    @property
    def branch_share(self) -> float:
        """The branch that the plant is on: it only rises."""
        return float(RISING)

    @property
    def end_sentence(self) -> str:
        """Sentence of a message at its end."""
        return f"self-test done after {self._elapsed_s:.1f} s"

    @property
    def eta_s(self) -> float:
        """Seconds that are left, at most."""
        return max(0.0, self._times.planned_s - self._elapsed_s) if not self.is_done else 0.0

    @property
    def _elapsed_s(self) -> float:
        return 0.0 if self._began_s is None else self._now_s - self._began_s

    def observe_line(self, line: LineStatus) -> None:
        """Take in what the lines have counted; before each step."""
        self._lines.observe(line)

    def step(self, now_s: float, reading: Reading) -> RunStep:
        """Advance to now_s and return the voltage to apply. reading: of this moment; only new usable ones count."""
        self._now_s = now_s
        if self._began_s is None:
            self._began_s = self._stage_s = now_s
        if reading.is_new and reading.is_usable:
            at_s = now_s - reading.age_s
            believed_n = self._leaps.take(reading.cell_n)
            self._weight_n = reading.contact_n - reading.cell_n
            self._trace.append((at_s - self._stage_s, believed_n))
            self._all.append((at_s, believed_n))
            self._lines.note_reading(at_s)
            if self._stage is _Stage.HOLD and self._lines.pressure_pa > 0.0:
                self._pressures.append((at_s, self._lines.pressure_pa))
            if self._stage is not _Stage.REST:
                self._guard()
        self._advance()
        progress = min(1.0, self._elapsed_s / self._times.planned_s)
        return RunStep(self._volts, CalibrationPhase.SELF_TEST, 1.0 if self.is_done else progress, self.eta_s)

    def report(self, number: int, fault: FaultCode) -> SelfTestReport:
        """Return what has been found. fault: of the supervision, that ended it."""
        if self._elapsed_s > 0.0:
            for finding in self._lines.findings(self._known, self._elapsed_s):
                self._set(finding)
        return report_of(number, self.findings, RunEnding(fault, self.is_done, self._force_n > 0.0))

    # -- the stages

    def _advance(self) -> None:
        stage_s, levels = self._now_s - self._stage_s, self._levels
        if self._stage is _Stage.REST and stage_s >= self._times.standing_s:
            self._end_rest()
        elif self._stage is _Stage.FIRST and levels:
            share = min(1.0, stage_s / RISE_S)
            self._volts = self._known.rest_v + share * (levels.first_v - self._known.rest_v)
            if self._is_settled(RISE_S):
                self._end_first(levels)
        elif self._stage is _Stage.SECOND and levels and self._is_settled(0.0):
            self._end_second(levels)
        elif self._stage is _Stage.HOLD and stage_s >= HOLD_S and len(self._trace) >= _FEWEST:
            self._end_hold()

    def _begin(self, stage: _Stage, volts: float) -> None:
        self._stage, self._stage_s, self._volts = stage, self._now_s, volts
        self._trace = []

    def _end(self) -> None:
        """Go down, whatever is left."""
        self._begin(_Stage.DONE, self._known.rest_v)

    def _is_settled(self, after_s: float) -> bool:
        """No rise any more, or no time; a fall is no reason to wait."""
        waited_s = self._now_s - self._stage_s - after_s
        if waited_s < self._times.settling_s or len(self._trace) < _FEWEST:
            return False
        return waited_s >= self._times.longest_settling_s or not still_rises(self._trace, self.noise_n)

    def _end_rest(self) -> None:
        known = self._known
        rest = without_lone_reading(last(self._trace, READ_REST_S))
        if not rest:
            self._set(Finding(Item.CELL_LINE, FAILED, "no reading came"))
            self._end()
            return
        self.noise_n, self._rest_n = noise_n(rest), mean_n(rest)
        for finding in judge_rest(rest, known, self._weight_n, self.outside_n):
            self._set(finding)
        if why := why_no_force(self.findings, rest, known):
            self._leave_force(why)
            return
        self._begin_rise()

    def _begin_rise(self) -> None:
        """Levels above what friction keeps, below the stated force."""
        levels = Levels(self._known, self._force_n, self._rest_n)
        if levels.why_no_room:
            self._leave_force(levels.why_no_room)
            return
        self._levels = levels
        self._begin(_Stage.FIRST, self._known.rest_v)

    def _end_first(self, levels: Levels) -> None:
        window = last(self._trace, MEAN_S)
        self._first_n, self._first_count = mean_n(window), len(window)
        if levels.set_second(self._first_n):
            self._begin(_Stage.SECOND, levels.second_v)
        else:
            self._stop_below(self._first_n)

    def _end_second(self, levels: Levels) -> None:
        window = last(self._trace, MEAN_S)
        self._second_n = mean_n(window)
        expected_n = levels.expected_n(levels.second_v) - levels.base_n
        rise_n, error_n = self._second_n - self._rest_n, mean_error_n(self.noise_n, len(window), self._first_count)
        silent_n = max(judgement.SILENT_SHARE * expected_n, _SURE_SIGMAS * error_n)
        if abs(rise_n) < silent_n:
            self._stop_silent(f"{rise_n:+.2f} N at {levels.second_v:.2f} V, {expected_n:.1f} N expected")
            return
        seen = f"{rise_n:+.1f} N at {levels.second_v:.2f} V, {expected_n:+.1f} N expected"
        self._set(Finding(Item.SIGN, PASSED, seen))
        if still_rises(self._trace, self.noise_n):
            self._set(judgement.still_rising(self._times.longest_settling_s))
            self._leave_force("the force does not settle")
            return
        change_n, friction_n = self._second_n - self._first_n, levels.friction_n(levels.first_v)
        self._set(judgement.judge_scale(change_n, levels.span_n, error_n, friction_n))
        self._set(judgement.judge_step(self._trace, self._first_n, self._second_n, self.noise_n, self._known))
        self._begin(_Stage.HOLD, levels.second_v)

    def _end_hold(self) -> None:
        self._set(judgement.judge_hold(self._trace, self._pressures))
        if self.findings[Item.RESOLUTION].verdict is NOT_TESTED:
            self._set(judgement.judge_resolution(count_n(self._all), len(self._all), self._known))
        self._end()

    # -- at every reading

    def _guard(self) -> None:
        """End before the stated force, and where the force goes the wrong way."""
        count = readings_to_know(self.noise_n, 0.5 * (1.0 - FORCE_SHARE) * self._force_n)
        if len(self._trace) < count or self.is_done or not self._levels:
            return
        recent = self._trace[-max(count, _RECENT) :]
        force_n, fallen_n = mean_n(recent[-count:]), mean_n(without_lone_reading(recent)[-count:])
        expected_n = self._levels.expected_n(self._volts) - self._levels.base_n
        least_fall_n = max(_LEAST_FALL_N, _SURE_SIGMAS * self.noise_n / sqrt(count))
        if self._stage is _Stage.FIRST:  # whose scale nobody knows yet
            # what dead time and lags still hold back; of a payload that is set down there is no more to come
            coming_n = rate_n_per_s(self._trace, self._levels.base_n) * self._known.response_s
            force_n, fallen_n = force_n + coming_n, fallen_n + coming_n
        if force_n >= (1.0 - NEAR_SHARE) * self._force_n:
            self._stop_below(force_n)
        elif expected_n >= _LEAST_EXPECTED_N and self._rest_n - fallen_n >= least_fall_n:
            text = f"{fallen_n - self._rest_n:+.1f} N where {expected_n:+.1f} N are expected"
            text += ": turn load_cell.sign in the rig file, or the cell's wires"
            if self._known.settings.valve:
                text += "; or the valve stands at pull, whatever its relay reads back"
            if fallen_n > -least_fall_n:  # what was there at rest is gone, and no more
                text += "; or what it pressed on at rest was taken away"
            self._set(Finding(Item.SIGN, FAILED, text))
            self._set(Finding(Item.ZERO, NOT_TESTED, "a force at rest has the wrong sign, too"))
            self._leave_force("the sign is wrong")

    # -- findings

    def _set(self, finding: Finding) -> None:
        self.findings[finding.item] = finding

    def _stop_below(self, force_n: float) -> None:
        """End, for the next step might pass the stated force: the scale's failure, unless friction explains it."""
        rising_n, falling_n = self.model.branch_forces_n(self._volts)
        text = f"{force_n:.1f} N measured or on the way at {self._volts:.2f} V, {rising_n:.1f} N expected"
        limit = f"self_test.force_n = {self._force_n:g} N"
        if force_n - rising_n <= judgement.friction_slack_n(rising_n, falling_n):
            self._leave_force(f"{text}: friction leaves no room below {limit}: raise it")
            return
        cause = "span or unit of the amplifier, or pushed from outside?"
        self._set(Finding(Item.SCALE, FAILED, f"{text}: more would pass {limit}; {cause}"))
        self._leave_force("the force came too near to the stated one")

    def _stop_silent(self, text: str) -> None:
        """End without a force: a cell that has never changed is blamed before the air is."""
        if is_constant(self._all):
            count = len(self._all)
            why = f"all of {count} readings are the same, {text}: cell or amplifier dead, else no air or no contact"
            self._set(Finding(Item.RESOLUTION, FAILED, why))
        else:
            self._set(Finding(Item.SCALE, FAILED, f"{text}: no air, valve closed or no contact"))
        self._leave_force("there is no force")

    def _leave_force(self, why: str) -> None:
        """End with the items that need a force untested, but for those that are known already."""
        for item in FORCE_ITEMS:
            if item not in self.findings:
                self._set(Finding(item, NOT_TESTED, why))
        self._end()
