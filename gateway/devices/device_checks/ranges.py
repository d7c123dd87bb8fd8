"""What the ranges of an output's profile say of each other, and of their units."""

from typing import Final

from gateway.devices.device_checks.sentences import Found
from gateway.devices.profile import DeviceProfile
from gateway.units import PASCAL_PER_BAR

_SLACK: Final = 0.01  # of a range: a converter's last count is short of its end
_MOST_V: Final = 100.0  # of an analogue input, or of what stands for one
_LEAST_PA: Final = 2.0e3  # from one end to the other: the regulator of any cylinder has more


def unfit_ranges(profile: DeviceProfile) -> Found:
    """Return which of an output's ranges contradicts another one, or is in another unit than its key says."""
    if (top_v := profile.voltage_range_v[1]) > _MOST_V:
        yield (
            ("set_voltage", "range", "voltage_v"),
            f"{top_v:g} V: a voltage is in volts here, and an input of 10 V ends at 10",
        )
    elif profile.read_voltage:
        low_v, high_v = profile.read_voltage.range.voltage_v
        set_low_v, set_high_v = profile.voltage_range_v
        slack_v = _SLACK * (set_high_v - set_low_v)
        if low_v > set_low_v + slack_v or high_v < set_high_v - slack_v:
            reads, sets = f"reads {low_v:g} .. {high_v:g} V", f"set_voltage sets {set_low_v:g} .. {set_high_v:g} V"
            yield (
                ("read_voltage", "range", "voltage_v"),
                f"{reads}, and {sets}: what is beyond is read as another setting",
            )
    if profile.read_pressure:
        low_pa, high_pa = profile.read_pressure.range.pressure_pa
        if high_pa - low_pa < _LEAST_PA:
            told = f"{high_pa:g} Pa are {high_pa / PASCAL_PER_BAR:g} bar: a pressure is in pascals here"
            yield ("read_pressure", "range", "pressure_pa"), f"{told}, and 1 bar is {PASCAL_PER_BAR:.0f}"
