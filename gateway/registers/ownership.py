"""Who may command: the first host that does, or the one that the rig names.

A master owns from the write that enables or sets a setpoint other than 0; a write that leaves enable and setpoints at 0
commands nothing and neither takes nor keeps the ownership. Disable, the lease's end (`release`) and an explicit takeover
change it. Identity is the host, not the connection: a master that reconnects is the same master.
"""

from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import Final

NOT_IPV4: Final = 0xFFFFFFFF
"""Shown in owner_ip for an owner without an IPv4 address (IPv6, serial)."""


class Ownership:
    """owner: the host that owns the setpoint, None for nobody."""

    def __init__(self, configured: str | None) -> None:
        self._configured = configured
        self.owner: str | None = configured

    def admits(self, host: str) -> bool:
        """Whether this host may command without taking over."""
        return self.owner is None or self.owner == host

    def may_take_over(self, host: str) -> bool:
        return self._configured is None or self._configured == host

    def take(self, host: str) -> bool:
        """True when that changed the owner. A configured owner stays."""
        changed = self.owner != host and self._configured is None
        if changed:
            self.owner = host
        return changed

    def release(self) -> bool:
        """True when that changed the owner. A configured owner stays."""
        changed = self.owner is not None and self._configured is None
        if changed:
            self.owner = None
        return changed


def ip_number(host: str | None) -> int:
    """What owner_ip shows: 0 for nobody, the IPv4 address (also one mapped into IPv6), else NOT_IPV4."""
    if host is None:
        return 0
    try:
        address = ip_address(host.partition("%")[0])
    except ValueError:
        return NOT_IPV4
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else address
    return int(mapped) if isinstance(mapped, IPv4Address) else NOT_IPV4
