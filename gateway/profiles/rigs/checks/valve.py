"""Whether the valve of a rig fits: a device of that role, a port of its own, nothing that switches it under pressure."""

from typing import Final

from gateway.devices import DeviceRole, ValveDirection, ValveHost
from gateway.devices.messages import Garbage
from gateway.devices.valve import ValveDevice
from gateway.profiles.rigs.checks.lines import NO_PORT, SIMULATED_PORT, is_same_port, of_role, why_no_path
from gateway.profiles.rigs.checks.parts import Check, Found, Parts
from gateway.profiles.rigs.checks.wires import check_reply_time
from gateway.profiles.rigs.device_settings import find_unfit_settings
from gateway.profiles.strict_yaml.fault_sentences import second, volt


def check_valve_device(parts: Parts) -> Found:
    """Yield a fault for a valve whose device is of another role."""
    device = parts.valve_device
    if device and device.role is not DeviceRole.VALVE:
        yield (
            "valve.device",
            f"{device.name} is of role {device.role}, a valve is needed here (mcu-valve, waveshare-relay)",
        )


def check_valve_settings(parts: Parts) -> Found:
    """Yield a fault for an address that the valve's device does not have, or cannot be set to."""
    if parts.valve and (device := of_role(parts.valve_device, DeviceRole.VALVE)):
        for name, sentence in find_unfit_settings(device, parts.valve):
            yield f"valve.{name}", sentence


def check_valve_times(parts: Parts) -> Found:
    """Yield a fault for an answer that cannot be through the valve's wire before it is given up, or blamed."""
    valve, device = parts.valve, of_role(parts.valve_device, DeviceRole.VALVE)
    if valve is None or device is None:
        return
    settings = device.serial.at(valve.baud)
    host, far = ValveHost(device), ValveDevice(device)
    took_s = {}
    for name, question in (("set_valve", ValveDirection.PULL), ("read_valve", None)):
        ask = host.request(question)
        answers = (far.reply(one, ValveDirection.PULL) for one in far.receive(ask) if not isinstance(one, Garbage))
        took_s[name] = settings.character_s * (len(ask) + sum(map(len, answers)))
        yield from check_reply_time("valve.baud", device, settings.baud, (name, took_s[name]))
    if valve.timeout_s <= sum(took_s.values()):
        least = f"a setting and its readback take {sum(took_s.values()):.3f} s on the wire"
        yield "valve.timeout_s", f"{second(valve.timeout_s)} is over before the valve can have answered: {least}"


def check_valve_simulated_port(parts: Parts) -> Found:
    """Yield a fault for a port in a simulated rig."""
    if parts.simulated and parts.valve and parts.valve.port is not None:
        yield "valve.port", SIMULATED_PORT


def check_valve_port(parts: Parts) -> Found:
    """Yield a fault for a valve without a port, or with one that is no path of a device or that another device uses."""
    valve = parts.valve
    if valve is None or parts.simulated:
        return
    if valve.port is None:
        yield "valve.port", NO_PORT
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

FAULTS: Final[tuple[Check, ...]] = (
    check_valve_device,
    check_valve_settings,
    check_valve_times,
    check_valve_simulated_port,
    check_valve_pressure,
)
