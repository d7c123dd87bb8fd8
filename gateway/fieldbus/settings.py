"""What a rig may say about its Modbus TCP server."""

from dataclasses import dataclass
from ipaddress import IPv4Network, IPv6Network

from gateway import defaults
from gateway.modbus import Role


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """units: ids that are answered, others get 0x0B. allow: networks whose peers may connect, needed beyond loopback.

    role: of each peer that has no certificate.

    requests_per_s is for each address that is not loopback; more than that waits, it is never refused.
    """

    units: tuple[int, ...] = defaults.UNIT_IDS
    connections: int = defaults.CONNECTIONS
    per_address: int = defaults.PER_ADDRESS
    idle_s: float = defaults.IDLE_S
    partial_s: float = 5.0
    write_buffer_bytes: int = 65536
    requests_per_s: float = defaults.REQUESTS_PER_S
    allow: tuple[IPv4Network | IPv6Network, ...] = ()
    role: Role = Role.SETPOINT
