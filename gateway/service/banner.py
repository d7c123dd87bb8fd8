"""What a person reads when the gateway is ready, and what a program reads with --json."""

from dataclasses import dataclass
from ipaddress import ip_address
from typing import Any, Final

from gateway import VERSION, defaults
from gateway.profiles import Rig

_FORCE_N: Final = 12.0
_SHORTEST_KEPT_LEASE_S: Final = round(0.75 * defaults.LEASE_S, 3)
"""`hold` keeps it without knowing the lease: it beats four times in the usual one, so three times in this."""


@dataclass(frozen=True, slots=True)
class Ready:
    """Facts of a rig that is ready: where Modbus listens, where the devices are and what they last said."""

    rig: Rig
    modbus: tuple[str, int]
    output_port: str
    cell_port: str
    voltage_v: float | None
    force_n: float | None
    notes: tuple[str, ...] = ()


def ready_fields(ready: Ready) -> dict[str, Any]:
    """Return the JSON line's fields, without the pids, which the guardian knows."""
    return {
        "ready": True,
        "rig": ready.rig.name,
        "modbus": list(ready.modbus),
        "web": None,
        "ptys": {"output": ready.output_port, "load_cell": ready.cell_port} if ready.rig.simulated else {},
        "notes": list(ready.notes),
    }


def format_banner(ready: Ready) -> str:
    """Return what a person reads when the gateway is ready."""
    rig, (host, port) = ready.rig, ready.modbus
    calibration = rig.calibration
    what = f"simulated, seed {rig.seed}" if rig.simulated else "real devices"
    units = ", ".join(map(str, rig.network.units))
    output, cell = rig.output, rig.load_cell
    lines = [
        f"force-gateway {VERSION} · rig {rig.name} ({what}) · calibration {calibration.name}: {calibration.kind}",
        f"  modbus tcp   {host}:{port}   units {units}      register table: force-gateway registers",
        f"  output       {ready.output_port:<16} {output.device.name} {output.baud}  {_reading(ready.voltage_v, 'V', 3)}",
        f"  load cell    {ready.cell_port:<16} {cell.device.name} {cell.baud}  {_reading(ready.force_n, 'N', 2)}",
        f"  lease        {_lease(rig)}",
        *(f"  {'' if index else 'try':<12} {line}" for index, line in enumerate(try_lines(rig, host, port))),
        *(f"  note         {note}" for note in ready.notes),
        f"READY  loop {rig.loop_hz:g} Hz · Ctrl-C ramps the force to 0 and stops · not a safety device",
    ]
    return "\n".join(lines)


def try_lines(rig: Rig, host: str, port: int) -> tuple[str, ...]:
    """Return command lines that work on this rig, from this machine, as they stand.

    A rig with a lease needs a heartbeat, which mbpoll has none of. A rig that names its master lets nobody else command.
    """
    host = _reachable_host(host, rig)
    unit = defaults.UNIT_ID if defaults.UNIT_ID in rig.network.units else rig.network.units[0]
    where = "" if (host, port) == (defaults.HOST, defaults.MODBUS_PORT) else f" --gateway {_in_url(host)}:{port}"
    where += "" if unit == defaults.UNIT_ID else f" --unit {unit}"
    if rig.network.owner and not ip_address(rig.network.owner).is_loopback:
        return (f"force-gateway monitor{where}        ({rig.network.owner} alone may command)",)
    force_n, lease_s = _force_to_try_n(rig), rig.control.supervision.lease_s
    if lease_s is not None or rig.network.require_byte_order_echo:
        pace = "" if lease_s is None or lease_s >= _SHORTEST_KEPT_LEASE_S else f" --rig {rig.file}"
        return (f"force-gateway hold {force_n:g}{where}{pace}        (enable, heartbeat; Ctrl-C ramps to 0)",)
    polled = f"{'' if unit == defaults.UNIT_ID else f' -a {unit}'} -p {port} -r 1 {host} 1 {round(100 * force_n)}"
    return (
        f"mbpoll -1{polled}        (enable, {force_n:.2f} N)",
        f"force-gateway write force_setpoint={force_n:g} control_word=1{where}",
        f"force-gateway hold {force_n:g}{where}        (until Ctrl-C, which ramps to 0)",
    )


def _reachable_host(host: str, rig: Rig) -> str:
    """Return an address that takes connections: a server on all of them is reached at its loopback, where that may connect."""
    loopback = {"0.0.0.0": defaults.HOST, "::": "::1"}.get(host)
    if loopback is None:
        return host
    return loopback if any(ip_address(loopback) in network for network in rig.network.allow) else "THIS-MACHINE"


def _in_url(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _force_to_try_n(rig: Rig) -> float:
    """12 N, or a force in the middle of what the rig may press with, to whole newtons where that can be."""
    limits, calibration = rig.control.limits, rig.calibration.model()
    low_n = max(limits.smallest_force_n, calibration.force_range_n[0])
    high_n = min(limits.force_max_n, calibration.force_range_n[1])
    if low_n <= _FORCE_N <= high_n:
        return _FORCE_N
    middle_n = 0.5 * (low_n + high_n)
    return round(middle_n) if low_n <= round(middle_n) <= high_n else round(middle_n, 2)


def _reading(value: float | None, unit: str, digits: int) -> str:
    return "silent" if value is None else f"ok   {value:.{digits}f} {unit}"


def _lease(rig: Rig) -> str:
    lease_s = rig.control.supervision.lease_s
    if lease_s is None:
        return (
            "none (demo): a command lasts until the next one"
            if rig.simulated
            else "none: a command lasts until the next one"
        )
    return f"{lease_s * 1e3:.0f} ms, then {rig.control.supervision.lease_action.value}"
