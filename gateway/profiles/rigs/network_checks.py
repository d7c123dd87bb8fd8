"""Whether the Modbus face of a rig is closed to those who have no business with it."""

from ipaddress import ip_address
from typing import Final

from gateway import defaults
from gateway.profiles.rigs.checks import Check, Found, Parts


def others_are_named(parts: Parts) -> Found:
    """Another address than loopback needs an allow-list of networks."""
    if (network := parts.network) is None:
        return
    if not is_loopback(network.bind) and not network.allow:
        reason = "can be reached from other machines: say which may connect, such as `allow: [192.168.125.0/24]`"
        yield "network.bind", f"{network.bind} {reason}"
    if network.owner and network.allow and not any(ip_address(network.owner) in allowed for allowed in network.allow):
        yield "network.owner", f"{network.owner} is in none of the networks of network.allow: it could not connect"


def is_loopback(address: str) -> bool:
    return ip_address(address).is_loopback


def unit_ids_differ(parts: Parts) -> Found:
    units = parts.network.units if parts.network else ()
    for index, unit in enumerate(units):
        if unit in units[:index]:
            yield f"network.units.{index}", f"{unit} is there twice"


def the_face_is_wise(parts: Parts) -> Found:
    if (network := parts.network) is None:
        return
    if 0 < network.port < 1024:
        yield (
            "network.port",
            f"E120 {network.port} needs a privilege (a service, or CAP_NET_BIND_SERVICE); {defaults.MODBUS_PORT} does not",
        )
    if any(allowed.prefixlen == 0 for allowed in network.allow):
        yield "network.allow", "lets every address in the world connect"


FAULTS: Final[tuple[Check, ...]] = (others_are_named, unit_ids_differ)
WARNINGS: Final[tuple[Check, ...]] = (the_face_is_wise,)
