"""The wires of the page: a section per line to a device, and one per further face where masters ask."""

from collections.abc import Iterator
from dataclasses import fields
from ipaddress import ip_address
from shlex import quote
from typing import Final

from gateway.clients.exchange import ExchangeTable
from gateway.clients.rendering import endpoint_of
from gateway.clients.wiring.device_wires import GENERAL, RS485, wires_of
from gateway.clients.wiring.section import Section
from gateway.devices.fields import HexNumber
from gateway.devices.profile import ADDRESS, DeviceProfile
from gateway.devices.template import compile_template
from gateway.profiles import Rig
from gateway.profiles.rigs.device_settings import CHANNEL
from gateway.profiles.rigs.faces import RtuFace, TlsFace

_ALLOWED: Final = {
    "monitor": "reads only, each write is refused (W211)",
    "setpoint": "commands, uploads no model (W211)",
    "calibration": "commands, and uploads models",
}


def serial_sections(rig: Rig) -> Iterator[Section]:
    """Yield a section per device line of the rig, and one per face of its `fieldbus`."""
    for name, line in _lines(rig):
        yield _device_section(name, line)
    for place, face in enumerate(rig.fieldbus, start=1):
        if isinstance(face, RtuFace):
            yield _face_section(place, face, ExchangeTable(rig.register_map, endpoint_of(rig)))
        else:
            yield _tls_section(place, face, endpoint_of(rig).unit_option + rig.map_option)


def _lines(rig: Rig) -> Iterator[tuple[str, object]]:
    """Yield (name, line) for all that a rig has: output, load cell, and whatever else is a line to a device."""
    for each in fields(rig):
        line = getattr(rig, each.name)
        if hasattr(line, "device") and hasattr(line, "settings"):
            yield each.name.replace("_", " "), line


def _device_section(name: str, line: object) -> Section:
    device: DeviceProfile = getattr(line, "device")  # noqa: B009
    settings, port = getattr(line, "settings"), getattr(line, "port")  # noqa: B009
    wires = wires_of(device.name, is_modbus=device.is_modbus)
    set_to = {**({ADDRESS: device.unit_id} if device.is_modbus else {}), **device.constants}
    set_to |= {ADDRESS: _address_in_module(device, set_to[ADDRESS])} if ADDRESS in set_to else {}
    constants = "".join(f", {name} {set_to[name]}" for name in (ADDRESS, CHANNEL) if name in set_to)
    constants += "" if device.checksum == "none" else f", checksum {device.checksum}"
    rows = [
        ("what", "value"),
        ("device", f"{device.name}: {device.description}"),
        ("port", port or "simulated: no wire"),
        ("line", f"{settings}{constants}"),
        ("interface", wires.interface),
        *(("wires", text) for text in (*GENERAL[wires.interface], *wires.terminals)),
        *(("switches", text) for text in wires.switches or ("none documented here: see the device's manual",)),
        ("source", wires.source or "general rules of the interface; terminal numbers are in the device's manual"),
        ("certainty", f"{device.hardware} (language: {device.certainty})"),
    ]
    return Section(f"Serial line: {name}", rows=tuple(rows))


def _address_in_module(device: DeviceProfile, address: int | str) -> int | str:
    """Return the address as it is set in the device: its utility knows the digits of its sentences, the rig file the number."""
    asks = [each.ask for each in (device.set_voltage, device.read_force, device.stream) if each]
    asks += [device.set_valve.push.ask] if device.set_valve else []
    fields = [compile_template(ask).field(ADDRESS) for ask in asks if ask]
    digits = next((field.encode(address) for field in fields if isinstance(field, HexNumber)), str(address))
    return (
        address
        if digits.lstrip("0") == str(address)
        else f"{digits} (hexadecimal, as the module has it; {address} in the rig file)"
    )


def _face_section(place: int, face: RtuFace, table: ExchangeTable) -> Section:
    first, words = table.status_span
    took_s = face.exchange_s(table.command_span[1] + words)
    parity = face.parity if face.port else "none"  # a pseudo-terminal has none
    port = face.port or "a pseudo-terminal, which `run` names when it is ready"
    rows = (
        ("what", "value"),
        ("port", port),
        ("line", f"{face.settings}, unit {face.unit}"),
        *(("wires", text) for text in GENERAL[RS485]),
        ("master", "Modbus RTU master of the PLC or robot, 8 data bits, the same settings; one owner per serial face"),
        (
            "timing",
            f"command and status in one FC23: {1e3 * took_s:.0f} ms on the wire, {1.0 / took_s:.0f} a second at most",
        ),
        *((("role", f"{face.role}: {_ALLOWED[face.role]}"),) if face.role else ()),
    )
    options = f"-m rtu -b {face.baud} -P {parity} -s {face.stop_bits} -a {face.unit}"
    commands = (
        f"mbpoll -1 {options} -r {first + 1} -c {words} MASTER-PORT    # on the machine at the other end, with its own port",
    )
    return Section(f"Serial face {place}: Modbus RTU, masters ask here", rows=rows, commands=commands)


def _tls_section(place: int, face: TlsFace, options: str) -> Section:
    port = face.port or "a free port, which `run` names when it is ready"
    host = "GATEWAY-ADDRESS" if ip_address(face.bind).is_unspecified else face.bind
    shown = f"[{host}]" if ":" in host else host
    rows = (
        ("what", "value"),
        ("address", f"{shown}:{port}, Modbus/TCP Security (TLS 1.2 or 1.3)"),
        ("may connect", ", ".join(map(str, face.allow)) or "nobody but this machine"),
        ("gateway's files", f"{face.certificate}, {face.key}"),
        ("masters need", f"a certificate signed by {face.ca}, with a role: setpoint to command, calibration to upload"),
        ("not for", "the generated clients, which speak plain Modbus TCP: for masters with TLS of their own"),
    )
    where = f"{shown}:{face.port or 'PORT'}{options}"
    try_it = (
        f"force-gateway read state --gateway {where} --tls {quote(str(face.ca))} --cert CLIENT.crt --key CLIENT.key"
    )
    return Section(
        f"Face {place}: Modbus/TCP Security",
        rows=rows,
        commands=(f"{try_it}    # with the client's own files; `force-gateway certs` makes them",),
    )
