"""A profile's words as they go over the wire, for people to lay beside the manual."""

from typing import Final

from gateway.devices.binary.weight_registers import WeightRegisters
from gateway.devices.codecs import cell_device, cell_host, output_device, output_host
from gateway.devices.fields import Choice
from gateway.devices.force_reading import UNIT
from gateway.devices.messages import Accepted, ForceSample, Garbage, SetVoltage
from gateway.devices.profile import DeviceProfile, DeviceRole
from gateway.devices.template import quote
from gateway.devices.valve import ValveDevice, ValveHost
from gateway.devices.valve_profile import ValveDirection

_SHOWN_N: Final = -20.0  # a pull, so that the place of the minus is seen; counts, where only a rig says what one is

_MANUALS_FIRST: Final = (30001, 40001)
"""Where manuals that count from 1 begin with input and with holding registers."""
_MANUALS_COUNT: Final = 9999


def example(profile: DeviceProfile) -> str:
    """Return one exchange: half the range of an output, a reading of -20 N, a valve that pulls. The profile is one without
    faults."""
    talk = {DeviceRole.OUTPUT: _output, DeviceRole.LOAD_CELL: _cell, DeviceRole.VALVE: _valve}
    return talk[profile.role](profile)


def read_over(profile: DeviceProfile) -> list[str]:
    """Return the fields of a reading whose words change nothing, as the profile writes them."""
    if profile.role is not DeviceRole.LOAD_CELL or profile.is_modbus:
        return []
    over = profile.reading.read_over(profile.constants)
    return [f"{one.name} ({', '.join(map(repr, one.words))})" if isinstance(one, Choice) else one.name for one in over]


def manual_numbers(profile: DeviceProfile) -> list[str]:
    """Return the registers that a manual counts from 1 in this way, and what each would be then: nobody answers the others, or
    another register does."""
    found = set[int]()
    for name in ("identity", "set_voltage", "read_voltage", "read_pressure", "read_force"):
        access = getattr(getattr(profile, name, None), "modbus", None)
        if access is not None:
            found.add(access.first if isinstance(access, WeightRegisters) else access.register)
    return [
        f"{one} goes out as it stands: if it is a manual's {one}, write {one - first}"
        for one in sorted(found)
        for first in _MANUALS_FIRST
        if first <= one < first + _MANUALS_COUNT
    ]


def _output(profile: DeviceProfile) -> str:
    host, device = output_host(profile), output_device(profile)
    voltage_v = 0.5 * sum(profile.voltage_range_v)
    asked = host.request(SetVoltage(voltage_v))
    heard = [one for one in device.receive(asked, 0.0) if not isinstance(one, Garbage)]
    answers = b"".join(device.reply(Accepted(voltage_v), to=one) for one in heard)
    return f"{voltage_v:g} V: {_shown(profile, asked)} -> {_shown(profile, answers)}"


def _cell(profile: DeviceProfile) -> str:
    reading = profile.reading
    is_known = reading.newton_per_unit or reading.template.field(UNIT)
    unit, name = (None, "N") if is_known else ("N", "counts")  # 1 N for a count, for want of a rig
    host = cell_host(profile, unit=unit)
    asked = host.poll() or host.start
    most_n = reading.largest_shown * host.resolution_n / reading.step
    shown_n = _SHOWN_N if most_n > -_SHOWN_N else -float(f"{0.5 * most_n:.1g}")
    frame = cell_device(profile, unit).frame
    samples = [one for one in host.receive(frame(shown_n), 0.0) if isinstance(one, ForceSample)]
    if not any(abs(one.force_n - shown_n) <= host.resolution_n for one in samples):
        shown_n = -shown_n  # of counts without a sign, whose zero a rig knows
    question = f"{_shown(profile, asked)} -> " if asked else ""
    return f"{shown_n:g} {name}: {question}{_shown(profile, frame(shown_n))}"


def _valve(profile: DeviceProfile) -> str:
    host, device = ValveHost(profile), ValveDevice(profile)
    asked = host.request(ValveDirection.PULL)
    heard = [one for one in device.receive(asked) if not isinstance(one, Garbage)]
    answers = b"".join(device.reply(one, ValveDirection.PULL) for one in heard)
    return f"pull: {_shown(profile, asked)} -> {_shown(profile, answers)}"


def _shown(profile: DeviceProfile, data: bytes) -> str:
    is_text = not (profile.is_modbus or profile.is_raw) and data.isascii()
    return quote(data.decode("ascii")) if is_text else data.hex(" ").upper()
