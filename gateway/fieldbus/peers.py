"""Who may connect, and how often one address may ask. Addresses only; no socket is touched here.

A server bound to loopback lets in whoever reaches it. A server bound elsewhere needs an allow-list, which then decides
for everybody, the own machine included: an exception for it would make the list say something else than it does.
Loopback is exempt from the limits per address, because our own tools and tests live there.
"""

from ipaddress import IPv4Address, IPv6Address, ip_address

from gateway.fieldbus.rate_limits import RequestRate
from gateway.fieldbus.settings import ServerSettings

Address = IPv4Address | IPv6Address


def address_of(host: str) -> Address:
    """Return the address without scope; an IPv4 one that came in through an IPv6 socket is IPv4. Raises ValueError."""
    address = ip_address(host.partition("%")[0])
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else None
    return mapped or address


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach the host, a numeric address or "localhost"."""
    if host == "localhost":
        return True
    try:
        return address_of(host).is_loopback
    except ValueError:
        return False


class Peers:
    """The connections in use, by address. guarded: the server is bound beyond loopback, the allow-list decides."""

    def __init__(self, settings: ServerSettings, *, guarded: bool) -> None:
        self._settings = settings
        self._guarded = guarded
        self._open: dict[str, int] = {}
        self._rates: dict[str, RequestRate] = {}

    def refusal(self, host: str) -> str | None:
        """Return why this address may not connect now; None: it may."""
        settings = self._settings
        address = address_of(host)
        if self._guarded and not any(address in network for network in settings.allow):
            return "its address is in none of the allowed networks"
        if sum(self._open.values()) >= settings.connections:
            return f"{settings.connections} connections are open, the most allowed"
        if not address.is_loopback and self._open.get(host, 0) >= settings.per_address:
            return f"{settings.per_address} connections from its address are open, the most allowed"
        return None

    def join(self, host: str) -> None:
        """Count one more connection of this host."""
        self._open[host] = self._open.get(host, 0) + 1

    def leave(self, host: str) -> None:
        """Count a closed connection."""
        self._open[host] -= 1
        if not self._open[host]:
            del self._open[host]

    def rate(self, host: str, now_s: float) -> RequestRate | None:
        """Return the bucket that all connections of an address share; None: unlimited."""
        if is_loopback(host):
            return None
        return self._rates.setdefault(host, RequestRate(self._settings.requests_per_s, now_s))

    def forget(self, now_s: float) -> None:
        """Drop the buckets of those who left, once full: leaving and coming back is no way to a new one."""
        gone = [host for host, rate in self._rates.items() if host not in self._open and rate.is_full(now_s)]
        for host in gone:
            del self._rates[host]
