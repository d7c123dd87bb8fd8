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
        if not self._is_allowed(host):
            return "its address is in none of the allowed networks"
        if self._is_full:
            return f"{self._settings.connections} connections are open, the most allowed"
        if self._has_its_share(host):
            return f"{self._settings.per_address} connections from its address are open, the most allowed"
        return None

    def rivals(self, host: str) -> frozenset[str]:
        """Return the addresses of which one connection, if ended, makes room for this one: its own where it has its share
        already, else all that have more than one. Who has a single one keeps it."""
        if not self._is_allowed(host):
            return frozenset()
        if self._has_its_share(host):
            return frozenset((host,))
        return frozenset(other for other, count in self._open.items() if count > 1) if self._is_full else frozenset()

    def _is_allowed(self, host: str) -> bool:
        return not self._guarded or any(address_of(host) in network for network in self._settings.allow)

    @property
    def _is_full(self) -> bool:
        return sum(self._open.values()) >= self._settings.connections

    def _has_its_share(self, host: str) -> bool:
        return not is_loopback(host) and self._open.get(host, 0) >= self._settings.per_address

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
