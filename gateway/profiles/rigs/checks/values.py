"""Checks of values that are no matter of one line, face or valve: limits, supervision, calibration, plant, compensation."""

from typing import Final

from gateway import defaults
from gateway.bsfm.model import Calibration
from gateway.control.settings import (
    over_force_room_n,
)
from gateway.profiles.rigs.checks.parts import Check, Found, Parts
from gateway.profiles.rigs.rig import is_own
from gateway.profiles.strict_yaml.fault_sentences import newton, number, second, volt
from gateway.units import STANDARD_GRAVITY_M_PER_S2

_TIMES: Final = ("lease_s", "stall_s", "sample_timeout_s", "output_timeout_s")
_LONGEST_UNWATCHED_S: Final = 10.0  # of a lease or a timeout: the slowest scale and master are faster
_SATURATION_SHARE: Final = 0.98  # of the cell's range: what is suggested; an amplifier may clip a little below its end
_SLOPES: Final = 50  # places of a curve at which its slope is looked at
_LEAST_TICKS: Final = 2.0  # within a timeout, so that one late tick is no fault


def check_voltages(parts: Parts) -> Found:
    """Yield a fault for voltage limits that are not in order, and for a safe voltage outside them."""
    if (limits := parts.limits) is None:
        return
    low, high, safe = limits.voltage_min_v, limits.voltage_max_v, limits.safe_voltage_v
    if low >= high:
        yield "limits.voltage_min_v", f"{volt(low)} is not below voltage_max_v = {volt(high)}"
    elif not low <= safe <= high:
        allowed = f"voltage_min_v .. voltage_max_v = {number(low)} .. {volt(high)}"
        yield "limits.safe_voltage_v", f"{volt(safe)} is outside {allowed}"


def check_forces(parts: Parts) -> Found:
    """Yield a fault for force limits that are not in order, or beyond the load cell."""
    if (limits := parts.limits) is None:
        return
    most, trip, least = limits.force_max_n, limits.over_force_n, limits.smallest_force_n
    if trip <= most:
        yield (
            "limits.over_force_n",
            f"{newton(trip)} is not above force_max_n = {newton(most)}: it would trip in normal work",
        )
    if least >= most:
        yield "limits.smallest_force_n", f"{newton(least)} is not below force_max_n = {newton(most)}"
    if parts.load_cell and trip > parts.load_cell.range_n:
        cell = f"load_cell.range_n = {newton(parts.load_cell.range_n)}"
        yield "limits.over_force_n", f"{newton(trip)} is beyond the load cell: {cell}"


def check_saturation(parts: Parts) -> Found:
    """Yield a fault for a saturation_n beyond the load cell, or within the forces of normal work."""
    if (supervision := parts.supervision) is None:
        return
    path, saturation_n = "supervision.saturation_n", supervision.saturation_n
    if parts.load_cell and saturation_n > parts.load_cell.range_n:
        cell = parts.load_cell.range_n
        suggested = f"{100.0 * _SATURATION_SHARE:.0f} % of it is {newton(round(_SATURATION_SHARE * cell, 1))}"
        yield path, f"{newton(saturation_n)} is beyond load_cell.range_n = {newton(cell)}; {suggested}"
    elif parts.limits and saturation_n <= parts.limits.force_max_n:
        most = newton(parts.limits.force_max_n)
        yield path, f"{newton(saturation_n)} is not above force_max_n = {most}: it would trip in normal work"


def check_defaults(parts: Parts) -> Found:
    """Yield a fault for a default force outside the limits."""
    if (defaults := parts.defaults) is None or (limits := parts.limits) is None:
        return
    most, least, precontact = limits.force_max_n, limits.smallest_force_n, defaults.precontact_force_n
    for key in ("precontact_force_n", "in_band_tolerance_n"):
        value = getattr(defaults, key)
        if value > most:
            yield f"defaults.{key}", f"{newton(value)} is above limits.force_max_n = {newton(most)}"
    if 0 < precontact < least:
        floor = f"limits.smallest_force_n = {newton(least)}"
        yield (
            "defaults.precontact_force_n",
            f"{newton(precontact)} is below {floor}: the output stays 0 V, the tool would not move",
        )


def check_payload(parts: Parts) -> Found:
    """Yield a fault for a payload whose weight is beyond the load cell: grams, say, where kilograms are meant."""
    if (defaults := parts.defaults) is None or (load_cell := parts.load_cell) is None:
        return
    weight_n = defaults.payload_kg * STANDARD_GRAVITY_M_PER_S2
    if weight_n > load_cell.range_n:
        observation = f"{number(defaults.payload_kg)} kg weigh {weight_n:.0f} N"
        cell = f"load_cell.range_n = {newton(load_cell.range_n)}"
        yield "defaults.payload_kg", f"{observation}, which is beyond the load cell: {cell}; are these grams?"


def check_self_test(parts: Parts) -> Found:
    """Yield a fault for a self-test that states more force than the rig allows."""
    if (self_test := parts.self_test) is None or (limits := parts.limits) is None:
        return
    if self_test.force_n > limits.force_max_n:
        most = f"limits.force_max_n = {newton(limits.force_max_n)}"
        why = f"{newton(self_test.force_n)} is above {most}: a self-test never presses harder than work"
        yield "self_test.force_n", why


def check_calibration_range(parts: Parts) -> Found:
    """Yield a fault where the maximum force exceeds the calibration, is below all that it is for, or leaves the trim no room
    above it."""
    if (limits := parts.limits) is None or (calibration := parts.calibration) is None:
        return
    model, most = calibration.model(), limits.force_max_n
    reach = model.force_range_n[1]
    if most > reach:
        end = f"{reach:.1f} N, where calibration {calibration.name} ends ({volt(calibration.x1_v)})"
        yield "limits.force_max_n", f"{newton(most)} is above {end}"
        return
    if calibration.force_limits_n and most < calibration.force_limits_n[0]:
        own = f"calibration {calibration.name} is for {newton(calibration.force_limits_n[0])} and more"
        yield "limits.force_max_n", f"{newton(most)}: {own}, so no setpoint but 0 would be taken"
        return
    trim_v = parts.trim.limit_v if parts.trim and parts.trim.gain_v_per_n_s > 0 else 0.0
    needed_v = model.branches.rising.inverse(most)[0] + trim_v
    if needed_v > limits.voltage_max_v:
        needs = f"needs {needed_v:.2f} V" + (f" with the trim's {volt(trim_v)}" if trim_v else "")
        room_v = limits.voltage_max_v - trim_v
        possible = f"; {model.branches.rising.value(room_v):.1f} N would fit" if room_v > calibration.x0_v else ""
        yield (
            "limits.force_max_n",
            f"{newton(most)} {needs}, above voltage_max_v = {volt(limits.voltage_max_v)}{possible}",
        )


def check_calibration_against_cell(parts: Parts) -> Found:
    """Yield a fault for a calibration of this rig that its load cell cannot have measured, or one whose force at the safe
    voltage counts as stuck. Another rig's may go beyond this cell: force_max_n bounds what is used of it."""
    if (calibration := parts.calibration) is None:
        return
    largest = max(map(abs, (*calibration.rising_handles_n, *calibration.falling_handles_n)))
    measured_here = is_own(calibration, parts.name, parts.plant if parts.simulated else None)
    if parts.load_cell and measured_here and largest > parts.load_cell.range_n:
        cell = f"load_cell.range_n = {newton(parts.load_cell.range_n)}"
        yield "calibration", f"{calibration.name} has a handle of {largest:.1f} N, beyond {cell}"
    if parts.limits and parts.supervision:
        resting = calibration.model().force_n(_within(calibration, parts.limits.safe_voltage_v), -1.0)
        if resting >= parts.supervision.stuck_n:
            expectation = f"{resting:.1f} N that calibration {calibration.name} expects at the safe voltage"
            yield (
                "supervision.stuck_n",
                f"{newton(parts.supervision.stuck_n)} is not above the {expectation}: it could never be enabled",
            )


def _within(calibration: Calibration, voltage_v: float) -> float:
    return min(max(voltage_v, calibration.x0_v), calibration.x1_v)


def check_times(parts: Parts) -> Found:
    """Yield a fault for a timeout shorter than two ticks of the loop."""
    if (supervision := parts.supervision) is None or not parts.loop_hz:
        return
    ticks_s = _LEAST_TICKS / parts.loop_hz
    for key in _TIMES:
        value = getattr(supervision, key)
        if value is not None and value < ticks_s:
            two_ticks = f"two ticks of the loop: {second(ticks_s)} at {number(parts.loop_hz)} Hz"
            yield f"supervision.{key}", f"{second(value)} is shorter than {two_ticks}"


def check_simulated_plant(parts: Parts) -> Found:
    """Yield a fault for a simulated rig without a plant."""
    if parts.simulated and not parts.names_plant:
        yield "plant", f"is missing: a simulated rig needs something to simulate, such as `plant: {defaults.PLANT}`"


def check_real_rig(parts: Parts) -> Found:
    """Yield a warning for a real rig without a lease, or with a calibration of another rig."""
    if parts.simulated:
        return
    if parts.supervision and parts.supervision.lease_s is None:
        observation = "there is no lease: when the master is lost, the last command lasts"
        yield "supervision.lease_s", f"{observation}; {defaults.LEASE_S:g} is usual"
    if parts.calibration and parts.calibration.rig != parts.name:
        origin = f'was made on "{parts.calibration.rig}", not on {parts.name}'
        yield "calibration", f"{origin}: its forces are a guess until you run `force-gateway calibrate`"


def check_seconds(parts: Parts) -> Found:
    """Yield a warning for a time that was probably meant in milliseconds."""
    for key in _TIMES:
        time_s = getattr(parts.supervision, key, None)
        if time_s is not None and time_s > _LONGEST_UNWATCHED_S:
            unwatched = f"{second(time_s)}, so long a force stays with nobody watching it"
            yield f"supervision.{key}", f"{unwatched}: {number(time_s)} ms are written {number(time_s / 1000.0)}"


def check_rest_voltage(parts: Parts) -> Found:
    """Yield a warning for a safe voltage above what a force of 0 is given: who enables goes below it."""
    if (limits := parts.limits) and limits.safe_voltage_v > limits.voltage_min_v:
        below = f"0 N while enabled is voltage_min_v = {volt(limits.voltage_min_v)}, less than the safe voltage"
        cure = f"if that may drop the tool, write voltage_min_v: {number(limits.safe_voltage_v)}"
        yield "limits.safe_voltage_v", f"{volt(limits.safe_voltage_v)}: {below}; {cure}"


def check_over_force_room(parts: Parts) -> Found:
    """Yield a warning for an over-force that a rise to the largest setpoint may trip, or a stuck force beyond it."""
    if parts.limits is None:
        return
    trip_n = parts.limits.over_force_n
    room_n = over_force_room_n(parts.limits, parts.defaults) if parts.defaults else None
    if room_n is not None and room_n > 0.0:  # else a fault
        reason = f"{newton(trip_n)} is {room_n:.2g} N above force_max_n = {newton(parts.limits.force_max_n)}"
        yield (
            "limits.over_force_n",
            f"{reason}: a rise to it may go so far beyond for a moment, and trip in normal work",
        )
    if parts.supervision and parts.supervision.stuck_n >= trip_n:
        bound = f"{newton(parts.supervision.stuck_n)} is not below limits.over_force_n = {newton(trip_n)}"
        yield "supervision.stuck_n", f"{bound}: a tool that is stuck in contact with less would not keep an enable back"


def check_contact_threshold(parts: Parts) -> Found:
    """Yield a warning for a precontact force that is too small to feel contact with."""
    if (defaults := parts.defaults) is None:
        return
    threshold = defaults.contact_threshold_n
    if 0 < defaults.precontact_force_n <= threshold:
        observation = f"contact_threshold_n = {newton(threshold)}: contact would never be felt"
        yield "defaults.precontact_force_n", f"{newton(defaults.precontact_force_n)} is not above {observation}"


def check_plant_supply(parts: Parts) -> Found:
    """Yield a warning for a maximum voltage that asks for more pressure than the plant's supply has."""
    if parts.plant is None or parts.limits is None:
        return
    regulator, most_v = parts.plant.plant.regulator, parts.limits.voltage_max_v
    pascal_per_volt = regulator.full_scale_pa / regulator.full_scale_v
    if most_v * pascal_per_volt > regulator.supply_pa:
        needed, available = f"{most_v * pascal_per_volt / 1e6:.3g} MPa", f"{regulator.supply_pa / 1e6:.3g} MPa"
        end = f"above {regulator.supply_pa / pascal_per_volt:.2f} V nothing changes"
        yield "limits.voltage_max_v", f"{volt(most_v)} asks for {needed}, the plant's supply has {available}: {end}"


def check_pace(parts: Parts) -> Found:
    """Yield a warning for a trim that is faster than the rig follows, or a lead longer than all of its lags, where this
    file's numbers count: the force may swing, or go beyond the wish."""
    calibration, supervision = parts.calibration, parts.supervision
    if calibration is None or supervision is None or parts.limits is None:
        return
    measured_here = is_own(calibration, parts.name, parts.plant if parts.simulated else None)
    if parts.measures_response and calibration.response and measured_here:
        return
    lag = f"supervision.response_lag_s = {second(supervision.response_lag_s)}"
    if parts.trim and parts.trim.limit_v > 0:
        slope_n_per_v, gain = _steepest(calibration, parts.limits.force_max_n), parts.trim.gain_v_per_n_s
        if slope_n_per_v * gain * supervision.response_lag_s > 1.0:
            pace = f"corrects an error in {1.0 / (gain * slope_n_per_v):.2g} s where 1 V are {slope_n_per_v:.2g} N"
            most = f"at most {1.0 / (slope_n_per_v * supervision.response_lag_s):.2g}"
            yield "trim.gain_v_per_n_s", f"{gain:g} {pace}, faster than {lag}: the force may swing; {most}"
    if parts.lead and (lead_s := parts.lead.lag_s + parts.lead.second_lag_s) > supervision.response_lag_s:
        yield "lead.lag_s", f"{second(lead_s)} with the second is longer than {lag}: each step would go beyond its end"


def _steepest(calibration: Calibration, most_n: float) -> float:
    """Return the largest slope of both branches up to this force, N/V; 0 where none of them gives so little."""
    model = calibration.model()
    steps = [calibration.x0_v + (calibration.x1_v - calibration.x0_v) * share / _SLOPES for share in range(_SLOPES + 1)]
    branches = (model.branches.rising, model.branches.falling)
    slopes = (
        branch.slope(voltage_v) for branch in branches for voltage_v in steps if branch.value(voltage_v) <= most_n
    )
    return max(slopes, default=0.0)


def check_compensation(parts: Parts) -> Found:
    """Yield a fault for a compensation that has nothing to compensate."""
    if parts.extended is None or parts.compensation is None or not parts.compensation.is_null:
        return
    limited = parts.compensation.limited
    why = "; ".join(f"{name}: {reason}" for name, reason in limited) or "it has no effect that control could take back"
    yield "compensation", f"{parts.extended.name} leaves nothing to compensate ({why}): leave this line out"


FAULTS: Final[tuple[Check, ...]] = (
    check_voltages,
    check_forces,
    check_saturation,
    check_defaults,
    check_payload,
    check_self_test,
    check_calibration_range,
    check_calibration_against_cell,
    check_times,
    check_simulated_plant,
    check_compensation,
)
WARNINGS: Final[tuple[Check, ...]] = (
    check_real_rig,
    check_seconds,
    check_rest_voltage,
    check_over_force_room,
    check_contact_threshold,
    check_plant_supply,
    check_pace,
)
