"""Each check of a rig at its bound: what just fits has no word, what just does not is told at its own place."""

from dataclasses import replace
from ipaddress import ip_network
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.control.settings import Defaults, Limits, SelfTestSettings, Supervision, Trim
from gateway.devices import DeviceRole
from gateway.devices.device_checks.watchdog import FEEDS_PER_TIME
from gateway.profiles import load_rig
from gateway.profiles.rigs.checks import faces as face_checks
from gateway.profiles.rigs.checks import lines as line_checks
from gateway.profiles.rigs.checks import network as network_checks
from gateway.profiles.rigs.checks import values as checks
from gateway.profiles.rigs.checks import valve as valve_checks
from gateway.profiles.rigs.checks.parts import Check, Parts
from gateway.profiles.rigs.rig_file import CellFile, Network, ValveFile

LIMITS = Limits(force_max_n=50.0, over_force_n=60.0, smallest_force_n=0.2, voltage_max_v=9.0)
LOOP_HZ = 100.0


def parts(**changes: Any) -> Parts:
    whole: dict[str, Any] = {
        "limits": LIMITS,
        "defaults": Defaults(),
        "supervision": Supervision(),
        "load_cell": CellFile(device="stream-st-gs", range_n=98.0),
    }
    facts = {"name": "own", "simulated": False, "names_plant": True, "accept_no_device_watchdog": True}
    return Parts(**facts, loop_hz=LOOP_HZ, **(whole | changes))


def limits(**changes: float) -> Parts:
    return parts(limits=replace(LIMITS, **changes))


def defaults(least_n: float = 0.2, **changes: float) -> Parts:
    return parts(defaults=replace(Defaults(), **changes), limits=replace(LIMITS, smallest_force_n=least_n))


def supervision(**changes: float) -> Parts:
    return parts(supervision=replace(Supervision(), **changes))


def calibration(**changes: Any) -> Parts:
    """Without limits where the handles are changed: these may be no model, and are not asked for one."""
    others: dict[str, Any] = {"limits": None} if changes else {}
    return parts(calibration=replace(load_rig("demo").calibration, **changes), **others)


def steep(force_max_n: float) -> Parts:
    """A machine that is too steep for its trim, but only beyond 10 N."""
    branch = {"handles_n": (0.0, 10.0, 60.0), "weights": (1.0, 1.0, 1.0)}
    curves = {f"{way}_{name}": numbers for way in ("rising", "falling") for name, numbers in branch.items()}
    own = calibration(order=2, x0_v=0.0, x1_v=8.0, slip_radii_v=(), slip_shares=(), **curves)
    return replace(own, limits=replace(LIMITS, force_max_n=force_max_n), trim=Trim(gain_v_per_n_s=0.5, limit_v=0.6))


SAFE_V = 3.0
RESTS_N = load_rig("demo").calibration.model().force_n(SAFE_V, -1.0)
"""What a tool that has pressed is left with at this safe voltage: the falling branch, some newtons above the rising one."""


def resting(stuck_n: float) -> Parts:
    limited = replace(LIMITS, safe_voltage_v=SAFE_V)
    return replace(calibration(), limits=limited, supervision=replace(Supervision(), stuck_n=stuck_n))


def output(**facts: Any) -> SimpleNamespace:
    return SimpleNamespace(role=DeviceRole.OUTPUT, name="dac", **facts)


def watched(time_s: float, feed: str) -> Parts:
    return parts(output_device=output(own_watchdog=SimpleNamespace(ticks=10, tick_s=time_s / 10.0, feed=feed)))


def network(**facts: Any) -> Parts:
    return parts(network=Network(**facts), fieldbus=(SimpleNamespace(),))


HANDLES = load_rig("demo").calibration.falling_handles_n
TEN = (ip_network("10.0.0.0/8"),)
BOUNDS: tuple[tuple[Check, str, Parts, Parts], ...] = (
    (
        checks.check_voltages,
        "limits.safe_voltage_v",
        limits(safe_voltage_v=1.0, voltage_min_v=1.0),
        limits(voltage_min_v=1.0),
    ),
    (checks.check_voltages, "limits.safe_voltage_v", limits(safe_voltage_v=9.0), limits(safe_voltage_v=9.01)),
    (
        checks.check_voltages,
        "limits.voltage_min_v",
        limits(voltage_min_v=8.9, safe_voltage_v=9.0),
        limits(voltage_min_v=9.0),
    ),
    (checks.check_forces, "limits.over_force_n", limits(over_force_n=50.1), limits(over_force_n=50.0)),
    (checks.check_forces, "limits.over_force_n", limits(over_force_n=98.0), limits(over_force_n=98.1)),
    (checks.check_forces, "limits.smallest_force_n", limits(smallest_force_n=49.9), limits(smallest_force_n=50.0)),
    (
        checks.check_saturation,
        "supervision.saturation_n",
        supervision(saturation_n=98.0),
        supervision(saturation_n=98.1),
    ),
    (
        checks.check_saturation,
        "supervision.saturation_n",
        supervision(saturation_n=50.1),
        supervision(saturation_n=50.0),
    ),
    (
        checks.check_defaults,
        "defaults.precontact_force_n",
        defaults(precontact_force_n=50.0),
        defaults(precontact_force_n=50.1),
    ),
    (
        checks.check_defaults,
        "defaults.in_band_tolerance_n",
        defaults(in_band_tolerance_n=50.0),
        defaults(in_band_tolerance_n=51.0),
    ),
    (
        checks.check_defaults,
        "defaults.precontact_force_n",
        defaults(3.0, precontact_force_n=3.0),
        defaults(3.0, precontact_force_n=2.9),
    ),
    (
        checks.check_defaults,
        "defaults.precontact_force_n",
        defaults(3.0, precontact_force_n=0.0),
        defaults(3.0, precontact_force_n=0.1),
    ),
    (checks.check_payload, "defaults.payload_kg", defaults(payload_kg=9.99), defaults(payload_kg=10.0)),
    (
        checks.check_self_test,
        "self_test.force_n",
        parts(self_test=SelfTestSettings(force_n=50.0)),
        parts(self_test=SelfTestSettings(force_n=50.1)),
    ),
    *(
        (checks.check_times, f"supervision.{key}", supervision(**{key: 0.02}), supervision(**{key: 0.019}))
        for key in ("lease_s", "stall_s", "sample_timeout_s", "output_timeout_s")
    ),
    *(
        (checks.check_seconds, f"supervision.{key}", supervision(**{key: 10.0}), supervision(**{key: 10.1}))
        for key in ("lease_s", "stall_s", "sample_timeout_s", "output_timeout_s")
    ),
    (
        checks.check_rest_voltage,
        "limits.safe_voltage_v",
        limits(safe_voltage_v=2.0, voltage_min_v=2.0),
        limits(safe_voltage_v=2.0, voltage_min_v=1.99),
    ),
    (
        checks.check_over_force_room,
        "limits.over_force_n",
        replace(defaults(in_band_tolerance_n=1.0), limits=replace(LIMITS, over_force_n=52.0)),
        replace(defaults(in_band_tolerance_n=1.0), limits=replace(LIMITS, over_force_n=51.9)),
    ),
    (checks.check_over_force_room, "supervision.stuck_n", supervision(stuck_n=59.9), supervision(stuck_n=60.0)),
    (
        checks.check_contact_threshold,
        "defaults.precontact_force_n",
        defaults(precontact_force_n=0.51),
        defaults(precontact_force_n=0.5),
    ),
    (
        checks.check_calibration_against_cell,
        "calibration",
        calibration(rig="own"),
        calibration(rig="own", falling_handles_n=(*HANDLES[:-1], 98.1)),
    ),
    (
        checks.check_calibration_against_cell,
        "calibration",
        calibration(rig="another", falling_handles_n=(*HANDLES[:-1], 98.1)),
        calibration(rig="own", rising_handles_n=(-98.1, *HANDLES[1:])),
    ),
    (
        checks.check_calibration_against_cell,
        "supervision.stuck_n",
        calibration(),
        replace(calibration(), limits=replace(LIMITS, safe_voltage_v=7.0)),
    ),
    (checks.check_calibration_against_cell, "supervision.stuck_n", resting(RESTS_N + 0.1), resting(RESTS_N - 0.1)),
    (checks.check_pace, "trim.gain_v_per_n_s", steep(force_max_n=10.0), steep(force_max_n=50.0)),
    (
        checks.check_calibration_range,
        "limits.force_max_n",
        replace(calibration(), trim=Trim(gain_v_per_n_s=0.0, limit_v=3.0)),
        replace(calibration(), trim=Trim(gain_v_per_n_s=0.1, limit_v=3.0)),
    ),
    (
        checks.check_calibration_range,
        "limits.force_max_n",
        replace(calibration(force_limits_n=(50.0, 65.0)), limits=LIMITS),
        replace(calibration(force_limits_n=(50.1, 65.0)), limits=LIMITS),
    ),
    (
        line_checks.check_output_range,
        "limits.safe_voltage_v",
        parts(output_device=output(voltage_range_v=(0.0, 9.0))),
        parts(output_device=output(voltage_range_v=(1.0, 9.0)), limits=replace(LIMITS, voltage_min_v=1.0)),
    ),
    (
        line_checks.check_output_range,
        "limits.voltage_max_v",
        parts(output_device=output(voltage_range_v=(0.0, 9.0))),
        parts(output_device=output(voltage_range_v=(0.0, 8.9))),
    ),
    (
        line_checks.check_watchdog_time,
        "output.watchdog_s",
        watched(FEEDS_PER_TIME / LOOP_HZ, "~**"),
        watched(0.9 * FEEDS_PER_TIME / LOOP_HZ, "~**"),
    ),
    (line_checks.check_watchdog_time, "output.watchdog_s", watched(0.31, ""), watched(0.29, "")),
    (
        network_checks.check_allow_list,
        "network.owner",
        network(owner="10.0.0.1", allow=TEN),
        network(owner="192.168.0.1", allow=TEN),
    ),
    (
        network_checks.check_allow_list,
        "network.bind",
        network(bind="10.0.0.2", allow=TEN, owner="certificate robot"),
        network(bind="10.0.0.2"),
    ),
    (network_checks.check_unit_ids, "network.units.1", network(units=(1, 2)), network(units=(1, 1))),
    (network_checks.check_network_exposure, "network.port", network(port=1024), network(port=1023)),
    (network_checks.check_network_exposure, "network.port", network(port=0), network(port=1)),
    (
        face_checks.check_owner_can_come,
        "network.owner",
        network(owner="10.0.0.1"),
        network(owner="10.0.0.1", plain=False),
    ),
    (face_checks.check_any_face, "network.plain", network(plain=False), parts(network=Network(plain=False))),
    *(
        (
            valve_checks.check_valve_pressure,
            f"limits.{key}",
            parts(valve=ValveFile(device="relay", pull_area_share=0.8)),
            parts(valve=ValveFile(device="relay", pull_area_share=0.8), limits=replace(LIMITS, **{key: 0.1})),
        )
        for key in ("safe_voltage_v", "voltage_min_v")
    ),
)


@pytest.mark.parametrize(
    ("check", "path", "fits", "does_not"), BOUNDS, ids=lambda one: one if isinstance(one, str) else ""
)
def test_what_just_fits_has_no_word_and_what_just_does_not_is_told_in_its_place(
    check: Check, path: str, fits: Parts, does_not: Parts
) -> None:
    assert (list(check(fits)), [place for place, _ in check(does_not)]) == ([], [path])
