"""Checks of who may reach the Modbus server of a rig (addresses, allow-list, unit ids, port), and of what its map carries."""

from ipaddress import ip_address
from typing import Final

from gateway import defaults
from gateway.profiles.http_sections import split_listen
from gateway.profiles.rigs.addresses import is_certificate
from gateway.profiles.rigs.checks.parts import Check, Found, Parts
from gateway.profiles.rigs.faces import TlsFace
from gateway.profiles.rigs.rig_file import Network
from gateway.profiles.strict_yaml.fault_sentences import newton
from gateway.registers.writes.ownership import serial_place


def check_allow_list(parts: Parts) -> Found:
    """Yield a fault for a server beyond loopback without an allow-list, and for an owner that the list leaves out."""
    if (network := parts.network) is None:
        return
    yield from find_open_face("network", network)
    if network.owner is None or serial_place(network.owner) is not None or is_certificate(network.owner):
        return
    if network.allow and not any(ip_address(network.owner) in allowed for allowed in network.allow):
        yield "network.owner", f"{network.owner} is in none of the networks of network.allow: it could not connect"


def find_open_face(path: str, face: Network | TlsFace) -> Found:
    """Yield a fault for a face beyond loopback without an allow-list. path: of the face in the file."""
    if not is_loopback(face.bind) and not face.allow:
        reason = "can be reached from other machines: say which may connect, such as `allow: [192.168.125.0/24]`"
        yield f"{path}.bind", f"{face.bind} {reason}"


def find_everybody(path: str, face: Network | TlsFace) -> Found:
    """Yield a warning for an allow-list that lets everybody connect."""
    if any(allowed.prefixlen == 0 for allowed in face.allow):
        yield f"{path}.allow", "lets every address in the world connect"


def is_loopback(address: str) -> bool:
    """Return whether only this machine can reach the address."""
    return ip_address(address).is_loopback


def check_unit_ids(parts: Parts) -> Found:
    """Yield a fault for a unit id that is given twice."""
    units = parts.network.units if parts.network else ()
    for index, unit in enumerate(units):
        if unit in units[:index]:
            yield f"network.units.{index}", f"{unit} is there twice"


def check_network_exposure(parts: Parts) -> Found:
    """Yield a warning for a port that needs a privilege, and for an allow-list that lets everybody connect."""
    if (network := parts.network) is None:
        return
    if 0 < network.port < 1024:
        yield (
            "network.port",
            f"E120 {network.port} needs a privilege (a service, or CAP_NET_BIND_SERVICE); {defaults.MODBUS_PORT} does not",
        )
    yield from find_everybody("network", network)


def check_map_carries_force(parts: Parts) -> Found:
    """Yield a warning for a largest force that no master could command, or that none would read, by a map of one's own."""
    if parts.register_map is None or parts.limits is None:
        return
    most_n = parts.limits.force_max_n
    for name, what in (("force_setpoint", "no master commands more"), ("force_measured", "more is shown as that")):
        end_n = parts.register_map.find(name).maximum
        if end_n is not None and end_n < most_n:
            cure = "give it a coarser scale"
            yield (
                "limits.force_max_n",
                f"{newton(most_n)}, but {name} of map {parts.register_map.name} ends at {newton(end_n)}: {what}; {cure}",
            )


def check_web(parts: Parts) -> Found:
    """Yield a fault for a page that other machines can reach and that asks for no token."""
    if parts.web and parts.web.token is None and not is_loopback(split_listen(parts.web.listen)[0]):
        yield "web.listen", f"E128 {parts.web.listen} {NEEDS_TOKEN}"


NEEDS_TOKEN: Final = (
    "can be reached from other machines: give the rig file `web: {token: ...}` with at least 16 characters, "
    f"or stay on {defaults.HOST}"
)
FAULTS: Final[tuple[Check, ...]] = (check_allow_list, check_unit_ids, check_web)
WARNINGS: Final[tuple[Check, ...]] = (check_network_exposure, check_map_carries_force)
