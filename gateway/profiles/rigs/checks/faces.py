"""Checks of the faces that a rig has beside plain Modbus TCP: their ports, and whether there is any face at all."""

import os
from collections.abc import Iterator
from typing import Final

from gateway.profiles.rigs.addresses import is_certificate
from gateway.profiles.rigs.checks.lines import NO_PORT, UNSTABLE, UNSTABLE_PATHS, lines_of, why_no_path
from gateway.profiles.rigs.checks.parts import Check, Found, Parts
from gateway.profiles.rigs.faces import RtuFace, TlsFace
from gateway.profiles.strict_yaml.fault_sentences import second
from gateway.registers.map.register_map import span_of
from gateway.registers.writes.ownership import LARGEST_SERIAL_PLACE, serial_place


def _rtu_faces(parts: Parts) -> Iterator[tuple[str, RtuFace]]:
    """Yield (path in the file, face) of every serial face without a fault of its own."""
    for index, face in enumerate(parts.fieldbus):
        if isinstance(face, RtuFace):
            yield f"fieldbus.{index}", face


def check_any_face(parts: Parts) -> Found:
    """Yield a fault for a rig that nobody could reach."""
    if parts.network and not parts.network.plain and not parts.fieldbus:
        remedy = "take this line away, or give the rig another face under `fieldbus`"
        yield "network.plain", f"false leaves no face that a master could reach: {remedy}"


def check_serial_owner(parts: Parts) -> Found:
    """Yield a fault for an owner on a serial face that is not there."""
    owner = parts.network.owner if parts.network else None
    if owner is None or (place := serial_place(owner)) is None or f"fieldbus.{place - 1}" in dict(_rtu_faces(parts)):
        return
    if place <= len(parts.fieldbus) and parts.fieldbus[place - 1] is None:  # it has a fault of its own
        return
    there = ", ".join(f"serial:{int(path.partition('.')[2]) + 1}" for path, _ in _rtu_faces(parts)) or "none"
    yield "network.owner", f"{owner} is no serial face of this rig; there is {there} (places in `fieldbus`, from 1)"


def check_serial_places(parts: Parts) -> Found:
    """Yield a fault for the first serial face whose place no owner register could show."""
    for path, _ in _rtu_faces(parts):
        if int(path.partition(".")[2]) >= LARGEST_SERIAL_PLACE:
            yield path, f"is a serial face behind the {LARGEST_SERIAL_PLACE}th place, the last that owner_ip can show"
            return


def check_owner_can_come(parts: Parts) -> Found:
    """Yield a fault for an owner that no face lets in as such: then nobody could command."""
    network = parts.network
    if network is None or network.owner is None or serial_place(network.owner) is not None or None in parts.fieldbus:
        return
    has_tls = any(isinstance(face, TlsFace) for face in parts.fieldbus)
    if is_certificate(network.owner) and not has_tls:
        remedy = "add a face {type: tls, ...} (`force-gateway certs DIR` prints its line), or name an address"
        yield (
            "network.owner",
            f"{network.owner}: no face of this rig asks for certificates, so nobody could command: {remedy}",
        )
    elif not is_certificate(network.owner) and not network.plain:
        remedy = "name `certificate NAME` or a serial face, or take `plain: false` away"
        yield (
            "network.owner",
            f"{network.owner} commands by plain Modbus TCP only, which this rig does not serve: {remedy}",
        )


def check_face_ports_given(parts: Parts) -> Found:
    """Yield a fault for a serial face of a real rig without a port, or with one that is no path of a device."""
    for path, face in [] if parts.simulated else _rtu_faces(parts):
        if face.port is None:
            yield f"{path}.port", NO_PORT
        elif reason := why_no_path(face.port):
            yield f"{path}.port", reason


def check_face_ports_differ(parts: Parts) -> Found:
    """Yield a fault for a serial face on a port that a device or another face has; by-id names are followed."""
    named = {key: line.port for key, line, _ in lines_of(parts)} | {"valve": parts.valve.port if parts.valve else None}
    taken = {os.path.realpath(port): f"{key}.port" for key, port in named.items() if port is not None}
    for path, face in _rtu_faces(parts):
        if face.port is None:
            continue
        user = taken.setdefault(os.path.realpath(face.port), f"{path}.port")
        if user.startswith("fieldbus."):
            if user != f"{path}.port":
                first = f"fieldbus[{user.split('.')[1]}]"
                yield f"{path}.port", f"is the port of {first} too: a serial port carries one face, with one unit id"
        else:
            device = user.partition(".")[0].replace("_", " ")
            remedy = "masters need an adapter of their own, `force-gateway ports` lists what is plugged in"
            yield f"{path}.port", f"is the {device}'s port too: {remedy}"


def check_face_ports_stable(parts: Parts) -> Found:
    """Yield a warning for a serial face whose port's name depends on the order of plugging."""
    for path, face in _rtu_faces(parts):
        if face.port is not None and face.port.startswith(UNSTABLE_PATHS):
            yield f"{path}.port", f"{face.port} {UNSTABLE}"


def check_faces_carry_the_lease(parts: Parts) -> Found:
    """Yield a warning for a serial face that is slower than the lease: whoever commands there loses the force at work."""
    lease_s = parts.supervision.lease_s if parts.supervision else None
    if lease_s is None or parts.register_map is None:
        return
    words = sum(span_of(parts.register_map.registers_of(block))[1] for block in ("command", "status"))
    for path, face in _rtu_faces(parts):
        took_s = face.exchange_s(words)
        if face.role != "monitor" and took_s > lease_s:
            slow = f"command and status take {second(round(took_s, 2))} on the wire at {face.baud} baud"
            yield f"{path}.baud", f"{slow}: a master that exchanges them loses its lease of {second(lease_s)} (A310)"


HARDWARE: Final[tuple[Check, ...]] = (check_face_ports_given, check_face_ports_differ)
"""Faults that a run with simulated devices does not mind: its serial faces are pseudo-terminals."""

FAULTS: Final[tuple[Check, ...]] = (check_any_face, check_serial_places, check_serial_owner, check_owner_can_come)
WARNINGS: Final[tuple[Check, ...]] = (check_face_ports_stable, check_faces_carry_the_lease)
