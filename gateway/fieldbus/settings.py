"""What a rig may say about its Modbus TCP face. Defaults are FIELDBUS's."""

from dataclasses import dataclass
from ipaddress import IPv4Network, IPv6Network


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """units: ids that are answered, others get 0x0B. allow: networks whose peers may connect, needed beyond loopback.

    requests_per_s is for each address that is not loopback; more than that waits, it is never refused.
    """

    units: tuple[int, ...] = (0, 1, 255)
    connections: int = 32
    per_address: int = 4
    idle_s: float = 60.0
    partial_s: float = 5.0
    write_buffer_bytes: int = 65536
    requests_per_s: float = 200.0
    allow: tuple[IPv4Network | IPv6Network, ...] = ()
