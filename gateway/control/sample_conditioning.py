"""Condition the samples of the load cell: corrected for its known defects, zeroed, gravity compensated, with their age and
whether they can be used."""

from math import isfinite, nan
from typing import Final, NamedTuple

from gateway.control.compensation.cell_map import CellMap
from gateway.control.settings import Supervision
from gateway.control.tare import Zero
from gateway.devices.messages import ForceSample, Quality


class Reading(NamedTuple):
    """cell_n: zeroed cell force, nan unless usable; contact_n: with the payload's weight; interval_s: since the sample
    before, 0 unless this one is new; overload: saturated or said so by the device; age_s: nan before the first
    sample; raw_n: as the cell said it, in N."""

    cell_n: float = nan
    contact_n: float = nan
    age_s: float = nan
    interval_s: float = 0.0
    is_new: bool = False
    is_fresh: bool = False
    is_usable: bool = False
    overload: bool = False
    raw_n: float = nan


NO_READING: Final = Reading()
_DOUBTED_S: Final = 0.5  # without a usable reading: in less, no amplifier starts anew, and no other cell is plugged in
_OVERLOAD: Final = Quality.OVERLOAD


def at_time(reading: Reading, later_s: float, supervision: Supervision) -> Reading:
    """Return the same reading later_s after it was made: older, and perhaps no longer fresh; not new any more."""
    age_s = reading.age_s + max(0.0, later_s)
    is_fresh = age_s <= supervision.sample_timeout_s
    return reading._replace(age_s=age_s, interval_s=0.0, is_new=False, is_fresh=is_fresh)


def turned(reading: Reading) -> Reading:
    """Return the same reading counted the other way."""
    return reading._replace(cell_n=-reading.cell_n, contact_n=-reading.contact_n)


class SampleConditioner:
    """Turns samples into readings; a sample given twice is not new the second time. direction: -1 where the tool pulls, so that
    a pull is a positive force in all that follows. is_doubted: the zero in use may be another one than the cell's, until the
    next tare."""

    def __init__(self, supervision: Supervision, cell: CellMap | None = None, *, is_behind_death: bool = False) -> None:
        """cell: its known defects; None: the reading is the force; is_behind_death: as of `Zero`."""
        self._zero = Zero(supervision, is_behind_death=is_behind_death)
        self._cell = cell
        self._saturation_n = supervision.saturation_n
        self._timeout_s = supervision.sample_timeout_s
        self._last_s = self._usable_s = nan
        self._doubt, self.is_doubted, self._forgotten_n = "", False, 0.0
        self.direction = 1.0

    def use(self, cell: CellMap | None) -> None:
        """Take other defects of the cell. The tare stays the force that was zero then; recent samples are no zero any more."""
        zero_n = self._zero.zero_n
        raw_n = self._cell.reading_n(zero_n, nan, 0.0) if self._cell else zero_n
        self._zero.zero_n = cell.force_n(raw_n, nan, 0.0) if cell else raw_n
        self._zero.forget()
        self._cell = cell

    def retime(self, response_lag_s: float) -> None:
        """Replace the time, s, in which a force that was pressed before follows its voltage."""
        self._zero.retime(response_lag_s)

    def note_output(self, *, is_known: bool) -> None:
        """Note whether the output has confirmed a voltage: as long as nobody knows what stands there, it may press."""
        if not is_known:
            self._zero.expect_left()

    def read(
        self, now_s: float, sample: ForceSample | None, gravity_n: float, around: tuple[float, float] = (nan, 0.0)
    ) -> Reading:
        """Return what the sample means for control.
        around: temperature of the cell in degrees C (nan: not known) and voltage on the output."""
        if sample is None:
            return NO_READING
        force_n = sample.force_n
        overload = sample.quality is _OVERLOAD or abs(force_n) >= self._saturation_n
        usable = isfinite(force_n) and not overload
        if self._cell is not None and usable:
            force_n = self._cell.force_n(force_n, *around)
        interval_s = self._interval_s(sample.time_s)
        if interval_s > 0.0 and usable:
            self._zero.observe(force_n, interval_s)
            self._note_usable(sample.time_s)
        age_s = max(0.0, now_s - sample.time_s)
        cell_n = self.direction * (force_n - self._zero.zero_n) if usable else nan
        fresh = age_s <= self._timeout_s
        return Reading(
            cell_n, cell_n + gravity_n, age_s, interval_s, interval_s > 0.0, fresh, usable, overload, sample.force_n
        )

    @property
    def zero_n(self) -> float:
        """Force of the cell that the last tare has taken as zero, N."""
        return self._zero.zero_n

    @property
    def zero_spread_n(self) -> float:
        """Largest spread of recent samples that may be taken as zero, N."""
        return self._zero.largest_spread_n

    def take_zero(self, gravity_n: float) -> float:
        """Take the present force as zero (tare) and return by how much less a reading says from now on, N.
        gravity_n as in `demand`, along the tool's direction as readings are; the zero is the cell's own, whichever way the
        tool acts. Ask `why_no_zero` first."""
        self.is_doubted, self._forgotten_n = False, 0.0
        return self.direction * self._zero.take(self.direction * gravity_n)

    def why_no_zero(self, gravity_n: float) -> str:
        """Return why the recent samples are no zero, in numbers; empty where they are one."""
        return self._zero.unsteady(self.direction * gravity_n)

    def forget_tare(self, zero_n: float) -> None:
        """Note the zero of a tare that died with the process before, N, 0 for none: that of now is doubted until the next."""
        self.is_doubted, self._forgotten_n = bool(zero_n), zero_n

    def zero_to_tell_n(self) -> float:
        """Return the zero that a process behind this one lacks, N: a tare that is forgotten already is missing there too."""
        return self.zero_n or self._forgotten_n

    def take_doubt(self) -> str:
        """Return W253 once where the cell's zero may have become another one while nothing was heard of it, else nothing.
        The tare is kept: without it a cell that has only been unplugged would read its tool."""
        doubt, self._doubt = self._doubt, ""
        return doubt

    def _note_usable(self, time_s: float) -> None:
        silent_s, self._usable_s = time_s - self._usable_s, time_s
        if silent_s >= _DOUBTED_S and self._zero.zero_n:
            self.is_doubted = True
            self._doubt = (
                f"W253 no usable reading of the load cell for {silent_s:.1f} s: was it without power, or is it another one? "
                f"Then the tare of before, {self._zero.zero_n:.2f} N, is not its zero: with nothing pressed, tare again"
            )

    def _interval_s(self, time_s: float) -> float:
        """Time since the sample before, at most the time-out; 0 for the same one, or one from the past."""
        last_s = self._last_s
        if time_s <= last_s:
            return 0.0
        self._last_s = time_s
        if time_s - last_s <= self._timeout_s:
            return time_s - last_s
        self._zero.forget()  # also for the first sample, where last_s is nan
        return self._timeout_s
