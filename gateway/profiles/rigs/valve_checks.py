"""Whether the valve of a rig fits: a device of that role, a port of its own, nothing that switches it under pressure."""

from typing import Final

from gateway.devices import DeviceRole
from gateway.profiles.rigs.checks import Check, Found, Parts
from gateway.profiles.rigs.line_checks import is_same_port, why_no_path
from gateway.profiles.strict_yaml.fault_sentences import volt


def check_valve_device(parts: Parts) -> Found:
    """Yield a fault for a valve whose device is of another role."""
    device = parts.valve_device
    if device and device.role is not DeviceRole.VALVE:
        yield (
            "valve.device",
            f"{device.name} is of role {device.role}, a valve is needed here (mcu-valve, waveshare-relay)",
        )


def check_valve_simulated_port(parts: Parts) -> Found:
    """Yield a fault for a port in a simulated rig."""
    if parts.simulated and parts.valve and parts.valve.port is not None:
        yield "valve.port", "a simulated rig has no ports: delete this line, or write `simulated: false`"


def check_valve_port(parts: Parts) -> Found:
    """Yield a fault for a valve without a port, or with one that is no path of a device or that another device uses."""
    valve = parts.valve
    if valve is None or parts.simulated:
        return
    if valve.port is None:
        yield "valve.port", "is missing: `force-gateway ports` lists what is plugged in"
    elif reason := why_no_path(valve.port):
        yield "valve.port", reason
    for key, line in (("output", parts.output), ("load_cell", parts.load_cell)):
        if line and is_same_port(line.port, valve.port):
            yield (
                "valve.port",
                f"is the port of {key} too: the valve needs one of its own, also where both could share an RS-485 bus",
            )


def check_valve_pressure(parts: Parts) -> Found:
    """Yield a fault for a rest voltage at which the valve would be switched under pressure."""
    if parts.valve is None or (limits := parts.limits) is None:
        return
    for key in ("safe_voltage_v", "voltage_min_v"):
        if (value := getattr(limits, key)) > 0.0:
            yield f"limits.{key}", f"{volt(value)}: a rig with a valve needs 0 V, it is switched without pressure only"


HARDWARE: Final[tuple[Check, ...]] = (check_valve_port,)
"""Faults that a run with simulated devices does not mind."""

FAULTS: Final[tuple[Check, ...]] = (check_valve_device, check_valve_simulated_port, check_valve_pressure)
