"""Checks of the addresses that a rig listens on: no two of its faces can have one port."""

from collections.abc import Iterator
from ipaddress import ip_address
from typing import Final

from gateway.profiles.http_sections import split_listen
from gateway.profiles.rigs.checks.parts import Check, Found, Parts
from gateway.profiles.rigs.faces import TlsFace
from gateway.profiles.strict_yaml.faults import path_text

Listener = tuple[str, str, int]
"""Path in the file, address, port."""


def check_shared_ports(parts: Parts) -> Found:
    """Yield a fault for a face whose port another one takes first: neither of two programs may listen there."""
    return _find_shared(list(_served_first(parts)))


def check_opcua_port(parts: Parts) -> Found:
    """Yield a warning for an OPC UA server on the port of a face: the rig starts, and that server does not."""
    others = list(_served_first(parts))
    if parts.opcua:
        listener = ("opcua.listen", *split_listen(parts.opcua.listen))
        yield from (found for found in _find_shared([*others, listener]) if found[0] == listener[0])


def _served_first(parts: Parts) -> Iterator[Listener]:
    """Yield what keeps a rig from starting where it cannot listen; port 0, which is any free one, is nobody else's."""
    if parts.network and parts.network.plain:
        yield "network.port", parts.network.bind, parts.network.port
    for index, face in enumerate(parts.fieldbus):
        if isinstance(face, TlsFace):
            yield f"fieldbus.{index}.port", face.bind, face.port
    for name, section in (("web", parts.web), ("metrics", parts.metrics)):
        if section:
            yield f"{name}.listen", *split_listen(section.listen)


def _find_shared(listeners: list[Listener]) -> Found:
    for index, (path, address, port) in enumerate(listeners):
        for other, taken, taken_port in listeners[:index]:
            if port == taken_port != 0 and _meet(address, taken):
                yield path, f"port {port} is that of {_shown(other)}, too: give it another one"
                break


def _shown(path: str) -> str:
    return path_text(tuple(int(step) if step.isdecimal() else step for step in path.split(".")))


def _meet(one: str, other: str) -> bool:
    """Decide whether two addresses take one port from each other: 0.0.0.0 is every address of this machine."""
    first, second = ip_address(one), ip_address(other)
    return first == second or (first.version == second.version and (first.is_unspecified or second.is_unspecified))


FAULTS: Final[tuple[Check, ...]] = (check_shared_ports,)
WARNINGS: Final[tuple[Check, ...]] = (check_opcua_port,)
