"""A port that is opened again: another device may be behind it, so of what was asked, answered and counted nothing is left."""

from random import Random
from typing import Any

import pytest

from gateway.devices import DeviceProfile, DeviceRole, ValveDirection, ValveHost, cell_host, output_device, output_host
from gateway.devices.force_reading import UNIT
from gateway.devices.messages import Accepted, SetVoltage
from gateway.profiles import list_shipped, load_device
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from gateway.service.running_rig.lines.output_line import OutputExchange
from gateway.service.running_rig.lines.valve_line import ValveExchange

KEPT = frozenset("counts round_trip_s _write _host checks identity lost _order _grammar _spelling".split())
"""Counts since the start, and what is no state of the line. What a valve is to do is told anew at each step."""
PROFILES = {name: load_device(name) for name in list_shipped("device")}


def exchange_of(profile: DeviceProfile, written: list[bytes]) -> Any:
    if profile.role is DeviceRole.OUTPUT:
        host = output_host(profile)
        return OutputExchange(host, written.append, 0.1, DeviceChecks(host, is_waived=False))
    if profile.role is DeviceRole.VALVE:
        return ValveExchange(ValveHost(profile), written.append, 0.1)
    unit = None if profile.reading.newton_per_unit or profile.reading.template.field(UNIT) else "N"
    return CellExchange(cell_host(profile, unit=unit), written.append, profile)


def live(exchange: Any, profile: DeviceProfile, written: list[bytes], rng: Random) -> None:
    """Some seconds of settings, silences, garbage, refusals, and what a device of this kind says to other questions."""
    now_s, far = 5.0, output_device(profile) if profile.role is DeviceRole.OUTPUT else None
    for _ in range(120):
        now_s += rng.choice((0.001, 0.02, 0.12))
        if profile.role is DeviceRole.OUTPUT and rng.random() < 0.5:
            exchange.set_voltage(rng.choice(profile.voltage_range_v), now_s)
        elif profile.role is DeviceRole.VALVE:
            exchange.set_direction(rng.choice((None, *ValveDirection)), now_s)
        exchange.tick(now_s)
        receive = exchange.receive if profile.role is DeviceRole.LOAD_CELL else exchange.on_bytes
        said = rng.choice((b"\x00\xff\r\n", b"ERR\r\n", b"3\r\n", b"", written[-1] if written else b""))
        receive(said, now_s)
        if far and written and rng.random() < 0.5:
            for request in far.receive(written[-1], now_s):
                if isinstance(request, SetVoltage):
                    receive(far.reply(Accepted(rng.choice(profile.voltage_range_v)), to=request), now_s)


def state_of(part: Any) -> dict[str, Any]:
    own = {name: value for name, value in vars(part).items() if name not in KEPT}
    return {name: vars(value) if name == "unread" or "_lines" in name else repr(value) for name, value in own.items()}


@pytest.mark.parametrize("name", PROFILES)
def test_a_line_that_is_opened_again_is_as_one_that_was_never_open(name: str) -> None:
    profile, changed = PROFILES[name], set()
    for seed in range(2):
        written: list[bytes] = []
        lived, fresh = exchange_of(profile, written), exchange_of(profile, [])
        live(lived, profile, written, Random(seed))
        for of in (state_of, lambda one: state_of(getattr(one, "checks", None) or getattr(one, "identity", one))):
            changed |= {key for key, value in of(lived).items() if of(fresh)[key] != value}
        lived.reset()
        fresh.reset()
        assert state_of(lived) == state_of(fresh)
        for part in ("checks", "identity"):
            if hasattr(lived, part):
                assert state_of(getattr(lived, part)) == state_of(getattr(fresh, part))
    assert changed or profile.stream
