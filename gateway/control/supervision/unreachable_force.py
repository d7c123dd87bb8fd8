"""Tell why a force is not reached, as far as the measurements go: no air, another unit of force, no contact.

The pressure that the output device measures decides, where it measures one: too little for the voltage is no air; enough,
and no force, is no contact. What is enough has been seen while the force was right; before that it is read from the ranges of
the device's profile, which is less certain, so that only very little and plenty count. Without a pressure there is the force
itself: a tenth or ten times of what the model expects is kilograms read as newtons, and a force that was right before in the
same enable rules out what was never right. What cannot be told apart is named together. A force above the target has none of
these causes: friction or weight keeps it, or the model expects less of a volt than the machine makes.
"""

from dataclasses import dataclass
from math import isfinite, nan
from typing import Final

from gateway.units import STANDARD_GRAVITY_M_PER_S2

_UNIT_SLACK: Final = 1.15  # trim and calibration move the ratio by so much
_FRICTION_N: Final = 2.0  # what friction may hold beside it, where the true force is small
_TIMES: Final = 3.0
_LEAST_N: Final = 0.3  # less is noise and zero
_LEAST_TOLD_N: Final = 0.15  # from here on it is told beside the likelier cause
_NEAR_N: Final = 0.3  # off the target by less is what count, noise and a trim's dead zone leave, ...
_PRESSED_N: Final = 1.0  # ... of a force from here on
_SILENT_SHARE: Final = 0.25
_LITTLE, _ENOUGH = 0.5, 0.7  # of the pressure that was seen at this voltage while the force was right
_VERY_LITTLE, _PLENTY = 0.2, 0.5  # of what the ranges of the device say
_LEAST_EXPECTED_PA: Final = 5.0e3
_OFF: Final = "trim at its limit, calibration or the load cell's span off"  # a calibration takes a wrong span for right


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """What is seen. pressure_pa: measured, expected_pa: at this voltage; nan: nobody knows. learned: expected_pa was seen while
    the force was right; was_in_band: the force has been in band since the last enable; target_n: what is gone for, nan where
    nobody knows; is_lowest: no less voltage can be out; two_values: of readings
    that are no force, what was seen."""

    voltage_v: float
    measured_n: float
    expected_n: float
    pressure_pa: float = nan
    expected_pa: float = nan
    learned: bool = False
    was_in_band: bool = False
    target_n: float = nan
    is_lowest: bool = False
    two_values: str = ""

    @property
    def is_too_much(self) -> bool:
        """Decide whether the force is above the target."""
        return self.measured_n > self.target_n

    @property
    def is_near(self) -> bool:
        """Decide whether so little is missing or too much that the band is what keeps it from being in band."""
        return self.measured_n >= _PRESSED_N and abs(self.measured_n - self.target_n) <= _NEAR_N

    @property
    def no_air(self) -> bool:
        """Decide whether the pressure is too low to move the tool."""
        return lacks_air(self.pressure_pa, self.expected_pa, learned=self.learned)

    @property
    def has_air(self) -> bool:
        """Decide whether the pressure is high enough to press."""
        return _share(self.pressure_pa, self.expected_pa) >= (_ENOUGH if self.learned else _PLENTY)

    @property
    def is_silent(self) -> bool:
        """Decide whether the cell shows next to nothing of the expected force."""
        return self.measured_n < _SILENT_SHARE * self.expected_n

    @property
    def factor(self) -> float:
        """Measured over expected force, nan where none is expected."""
        return self.measured_n / self.expected_n if self.expected_n > 0.0 else nan

    @property
    def _is_a_tenth(self) -> bool:
        """Decide whether kilograms-force read as newtons would show this."""
        return 1.0 / _UNIT_SLACK < self.factor * STANDARD_GRAVITY_M_PER_S2 < _UNIT_SLACK

    @property
    def may_be_kgf(self) -> bool:
        """Decide whether it may be that where the force is too small to be sure: before contact is felt."""
        about_a_tenth = 0.5 < self.factor * STANDARD_GRAVITY_M_PER_S2 < 1.6
        return _LEAST_TOLD_N < self.measured_n <= _LEAST_N and about_a_tenth and not self.was_in_band

    @property
    def looks_like_another_unit(self) -> bool:
        """Decide whether the factor is that between newtons and kilograms-force, either way."""
        if self.factor < 1.0:
            return self.measured_n > _LEAST_N and self._is_a_tenth
        off_n = abs(self.measured_n / STANDARD_GRAVITY_M_PER_S2 - self.expected_n)
        return self.factor > _TIMES and off_n < (_UNIT_SLACK - 1.0) * self.expected_n + _FRICTION_N


def lacks_air(pressure_pa: float, expected_pa: float, *, learned: bool) -> bool:
    """Decide whether a pressure is too low to move the tool, as far as it can be told. Arguments: as of Evidence."""
    return _share(pressure_pa, expected_pa) < (_LITTLE if learned else _VERY_LITTLE)


def _share(pressure_pa: float, expected_pa: float) -> float:
    """Of the expected pressure; nan where it cannot be told."""
    return pressure_pa / expected_pa if isfinite(pressure_pa) and expected_pa >= _LEAST_EXPECTED_PA else nan


def unreachable_words(evidence: Evidence) -> str:
    """Return what it probably is, and one thing to do."""
    if evidence.two_values:
        return defective_words(evidence.two_values)
    pressure = _pressure(evidence)
    if evidence.is_near and not evidence.no_air:
        off_n = abs(evidence.measured_n - evidence.target_n)
        return f"only {off_n:.2f} N off: in_band_tolerance is too small, or in other units"
    if evidence.is_too_much and (evidence.is_lowest or not evidence.looks_like_another_unit):
        return _too_much_words(evidence)
    if evidence.no_air:
        return f"{pressure}: no air, or a closed valve; open the air supply and look at its gauge"
    if evidence.looks_like_another_unit:
        return _unit_words(evidence, pressure)
    if evidence.is_silent:
        return _silent_words(evidence, pressure)
    clause = f"{pressure}; " if pressure else ""
    if evidence.factor < 0.5 and not pressure:
        return f"no air or too little of it, valve closed, {_OFF}"
    return f"{clause}target not reached: supply pressure too low, {_OFF}"


def defective_words(two_values: str) -> str:
    """Return what readings are that leap between the same two values, and what to do."""
    return (
        f"{two_values}: its amplifier or its cable is defective, and nobody knows the force; disable, and look at both"
    )


def _too_much_words(evidence: Evidence) -> str:
    above = f"more than the {evidence.target_n:.1f} N that are wanted"
    if evidence.is_lowest:
        may_be_unit = evidence.looks_like_another_unit and not evidence.was_in_band
        unit = "; or N read as kgf (A303): check the unit" if may_be_unit else ""
        return (
            f"{above}, and no lower voltage is possible: friction, the payload's weight or something else keeps so much "
            f"pressed; command more, or lift the tool before{unit}"
        )
    return f"{above}: {_OFF}, or something else presses on the tool"


def _pressure(evidence: Evidence) -> str:
    """The pressure in numbers, where it is one to compare."""
    if not isfinite(evidence.pressure_pa):
        return ""
    expected = f", {evidence.expected_pa / 1e3:.0f} kPa expected" if evidence.expected_pa >= _LEAST_EXPECTED_PA else ""
    return f"{evidence.pressure_pa / 1e3:.0f} kPa measured{expected}"


def _unit_words(evidence: Evidence, pressure: str) -> str:
    unit = "kgf read as N" if evidence.factor < 1.0 else "N read as kgf"
    factor = f"factor {evidence.factor:.3g} is what {unit} looks like (A303)"
    if evidence.has_air:
        return f"{pressure}: air is there, and {factor}: check the unit on the amplifier against the rig file"
    since = ", though the force was right before in this enable" if evidence.was_in_band else ""
    other = "; else no air, valve closed or no contact" if evidence.factor < 1.0 else ""
    return f"{f'{pressure}: ' if pressure else ''}{factor}{since}: check the unit on the amplifier against the rig file{other}"


def _silent_words(evidence: Evidence, pressure: str) -> str:
    unit = ""
    if evidence.may_be_kgf:
        unit = (
            f"; or kgf read as N, which the factor {evidence.factor:.3g} looks like (A303): check the unit on the amplifier "
            "against the rig file, or press with a larger precontact_force"
        )
    if evidence.has_air:
        return f"{pressure}: air is there, so no contact with the workpiece{unit}"
    clause = f"{pressure}; " if pressure else ""
    if evidence.was_in_band:
        return f"{clause}the force was right before in this enable: contact lost or air gone; look at the gauge and at the tool"
    return f"{clause}no air, valve closed or no contact{unit}"
