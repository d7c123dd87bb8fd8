"""What a person reads when the gateway is ready, and what a program reads with --json."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from ipaddress import ip_address
from math import inf, isfinite
from shlex import quote
from typing import Any, Final

from gateway import VERSION, defaults
from gateway.devices import ValveDirection
from gateway.devices.messages import ForceSample, Quality
from gateway.extras import is_installed, missing_note
from gateway.fieldbus.peers import is_loopback
from gateway.profiles import Rig
from gateway.profiles.http_sections import split_listen


@dataclass(frozen=True, slots=True)
class ServedFace:
    """A face that masters can reach. type: tcp, rtu, ...; where: address or port; note: what else the banner says of it;
    facts: the rest of its JSON."""

    type: str
    where: str
    note: str
    facts: dict[str, Any]


def tcp_face(host: str, port: int, units: tuple[int, ...]) -> ServedFace:
    """Return plain Modbus TCP as it is told of."""
    note = f"units {', '.join(map(str, units))}      register table: force-gateway registers"
    return ServedFace("tcp", f"{_in_url(host)}:{port}", note, {"host": host, "port": port})


def tls_face(host: str, port: int, units: tuple[int, ...]) -> ServedFace:
    """Return Modbus/TCP Security as it is told of."""
    note = f"units {', '.join(map(str, units))}      by certificate, which names the role: force-gateway certs"
    return ServedFace("tls", f"{_in_url(host)}:{port}", note, {"host": host, "port": port})


@dataclass(frozen=True, slots=True)
class Ready:
    """Facts of a rig that is ready: where plain Modbus TCP listens (None: nowhere), every face, where the devices are and
    what they last said."""

    rig: Rig
    modbus: tuple[str, int] | None
    output_port: str
    cell_port: str
    voltage_v: float | None
    force_n: float | None
    notes: tuple[str, ...] = ()
    faces: tuple[ServedFace, ...] = ()
    valve_port: str = ""
    valve_stands: ValveDirection | None = None
    http: dict[str, tuple[str, int]] = field(default_factory=dict)  # where page and metrics listen, by name


def ready_fields(ready: Ready) -> dict[str, Any]:
    """Return the JSON line's fields, without the pids, which the guardian knows."""
    return {
        "ready": True,
        "rig": ready.rig.name,
        "modbus": list(ready.modbus) if ready.modbus else None,
        "faces": [{"type": face.type, **face.facts} for face in ready.faces],
        "web": list(ready.http["web"]) if "web" in ready.http else None,
        "metrics": list(ready.http["metrics"]) if "metrics" in ready.http else None,
        "ptys": _ptys(ready) if ready.rig.simulated else {},
        "notes": list(ready.notes),
    }


def _ptys(ready: Ready) -> dict[str, str]:
    ptys = {"output": ready.output_port, "load_cell": ready.cell_port}
    return ptys | ({"valve": ready.valve_port} if ready.valve_port else {})


def format_banner(ready: Ready) -> str:
    """Return what a person reads when the gateway is ready."""
    rig = ready.rig
    calibration = rig.calibration
    what = f"simulated, seed {rig.seed}" if rig.simulated else "real devices"
    output, cell = rig.output, rig.load_cell
    lines = [
        f"force-gateway {VERSION} · rig {rig.name} ({what}) · calibration {calibration.name}: {calibration.kind}",
        *(f"  modbus {face.type:<5} {face.where}   {face.note}" for face in ready.faces),
        f"  output       {ready.output_port:<16} {output.device.name} {output.baud}  {_reading(ready.voltage_v, 'V', 3)}",
        f"  load cell    {ready.cell_port:<16} {cell.device.name} {cell.baud}  {_reading(ready.force_n, 'N', 2)}",
        *_valve_lines(ready),
        f"  lease        {_lease(rig)}",
        *_http_lines(ready),
        *_telemetry_lines(rig),
        *(f"  {'' if index else 'try':<12} {line}" for index, line in enumerate(_all_lines_to_try(ready))),
        *(f"  note         {note}" for note in ready.notes),
        f"READY  loop {rig.loop_hz:g} Hz · Ctrl-C ramps the force to 0 and stops · not a safety device",
    ]
    return "\n".join(lines)


def _http_lines(ready: Ready) -> tuple[str, ...]:
    """Return where a browser and a scraper on this machine find the gateway, and whether others do; a token is the reader's to
    know."""
    paths = {"web": "/", "metrics": "/metrics"}
    return tuple(
        f"  {name:<12} {_url('http', host, port)}{paths[name]}{_beyond(host)}"
        for name, (host, port) in ready.http.items()
    )


def _telemetry_lines(rig: Rig) -> Iterator[str]:
    """Yield where OPC UA is found, and at which broker the topics are; or that it is off for want of a library."""
    told = {}
    if rig.opcua:
        host, port = split_listen(rig.opcua.listen)
        told["opcua", "asyncua"] = (
            f"{_url('opc.tcp', host, port)}/{_beyond(host)}        (starting: the log tells when it serves)"
        )
    if mqtt := rig.mqtt:
        node = f", spBv1.0/{mqtt.sparkplug.group}/+/{mqtt.sparkplug.node or rig.name}" if mqtt.sparkplug else ""
        topics = f"{mqtt.base_topic or f'force-gateway/{rig.name}'}/#{node}"
        told["mqtt", "aiomqtt"] = f"{_in_url(mqtt.host)}:{mqtt.port}   {topics}"
    for (name, library), line in told.items():
        yield f"  {name:<12} {line if is_installed(library) else missing_note(library, name)}"


_NEAR: Final = {"0.0.0.0": defaults.HOST, "::": "::1"}


def _url(scheme: str, host: str, port: int) -> str:
    return f"{scheme}://{_in_url(_NEAR.get(host, host))}:{port}"


def _beyond(host: str) -> str:
    return "        (and on this machine's other addresses)" if host in _NEAR else ""


def _all_lines_to_try(ready: Ready) -> tuple[str, ...]:
    """Return what can be tried: over plain Modbus TCP where there is it, and on the terminals of serial faces."""
    lines = try_lines(ready.rig, *ready.modbus) if ready.modbus else ()
    return lines + tuple(
        line for face in ready.faces if face.facts.get("is_terminal") for line in _try_rtu(ready.rig, face)
    )


def _try_rtu(rig: Rig, face: ServedFace) -> tuple[str, ...]:
    """Return a command line for a serial face's terminal. A terminal has no parity: mbpoll is told so."""
    force_n, unit = rig.force_to_try_n, face.facts["unit"]
    if force_n is None or rig.network.owner not in (None, face.facts["host"]):
        return ()
    if rig.control.supervision.lease_s is not None or rig.network.require_byte_order_echo:
        options = ("" if unit == defaults.UNIT_ID else f" --unit {unit}") + rig.map_option
        line = f"force-gateway hold {force_n:g} --rtu {face.where}{options} --rig {quote(str(rig.file))}"
        return (f"{line}        (over Modbus RTU)",)
    line = f"-b {face.facts['baud']} -P none -a {unit}"
    return (f"mbpoll -m rtu {line} -1 {_polled(rig, face.where, force_n)}        (over Modbus RTU)",)


def _polled(rig: Rig, where: str, force_n: float) -> str:
    """Return mbpoll's words that enable with this force."""
    word, force = (rig.register_map.find(name) for name in ("control_word", "force_setpoint"))
    return f"-r {word.address + 1} {where} 1 {round(force.counts_per_unit * force_n)}"


def try_lines(rig: Rig, host: str, port: int) -> tuple[str, ...]:
    """Return command lines that work on this rig, from this machine, as they stand.

    A rig with a lease needs a heartbeat, which mbpoll has none of. A rig that names its master lets nobody else command.
    """
    host = _reachable_host(host, rig)
    unit = defaults.UNIT_ID if defaults.UNIT_ID in rig.network.units else rig.network.units[0]
    where = "" if (host, port) == (defaults.HOST, defaults.MODBUS_PORT) else f" --gateway {_in_url(host)}:{port}"
    where += "" if unit == defaults.UNIT_ID else f" --unit {unit}"
    where += rig.map_option
    if rig.network.owner and not _is_this_machine(rig.network.owner):
        return (f"force-gateway monitor{where}        ({rig.network.owner} alone may command)",)
    force_n, lease_s = rig.force_to_try_n, rig.control.supervision.lease_s
    if force_n is None:
        return (f"force-gateway monitor{where}        (the rig and its calibration share no force to try)",)
    if lease_s is not None or rig.network.require_byte_order_echo:
        pace = (
            "" if lease_s is None or lease_s >= defaults.SHORTEST_UNTOLD_LEASE_S else f" --rig {quote(str(rig.file))}"
        )
        return (f"force-gateway hold {force_n:g}{where}{pace}        (enable, heartbeat; Ctrl-C ramps to 0)",)
    polled = f"{'' if unit == defaults.UNIT_ID else f' -a {unit}'} -p {port} {_polled(rig, host, force_n)}"
    return (
        f"mbpoll -1{polled}        (enable, {force_n:.2f} N)",
        f"force-gateway write force_setpoint={force_n:g} control_word=1{where}",
        f"force-gateway hold {force_n:g}{where}        (until Ctrl-C, which ramps to 0)",
    )


def _reachable_host(host: str, rig: Rig) -> str:
    """Return an address that takes connections: a server on all of them is reached at its loopback, where that may connect."""
    loopback = _NEAR.get(host)
    if loopback is None:
        return host
    return loopback if any(ip_address(loopback) in network for network in rig.network.allow) else "THIS-MACHINE"


def _is_this_machine(owner: str) -> bool:
    """Decide whether the master that a rig names connects from here over plain TCP: no serial face does, nor a certificate."""
    return is_loopback(owner)


def _in_url(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def shown_force(sample: ForceSample | None) -> float | None:
    """Return the force that a sample is shown with, N: inf where it is beyond the cell's range, None without a sample."""
    if sample is None:
        return None
    return inf if sample.quality is Quality.OVERLOAD else sample.force_n


def _reading(value: float | None, unit: str, digits: int) -> str:
    if value is None:
        return "silent"
    return f"ok   {value:.{digits}f} {unit}" if isfinite(value) else "beyond its range"


def _valve_lines(ready: Ready) -> list[str]:
    if (valve := ready.rig.valve) is None:
        return []
    stands = f"ok   {ready.valve_stands}" if ready.valve_stands else "silent"
    return [f"  valve        {ready.valve_port:<16} {valve.device.name} {valve.baud}  {stands}"]


def _lease(rig: Rig) -> str:
    lease_s = rig.control.supervision.lease_s
    if lease_s is None:
        return "none: a command lasts until the next one"
    return f"{lease_s * 1e3:.0f} ms, then {rig.control.supervision.lease_action.value}"
