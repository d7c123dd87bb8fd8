"""Who may command: the first host that does, or the one that the rig names.

A master owns from the write that enables or sets a setpoint other than 0; when its command is at rest again (enable and
setpoints 0), so is that ownership (`rest`). Who has taken over explicitly keeps it, whatever else is written or happens, until
disable, the lease's end (both `release`), another takeover or a restart. Identity is the host, under TLS the name in
the certificate (`Peer.identity`), not the connection: a master that reconnects is the same master. All masters on one serial
face are one host, for a bus has no addresses of masters.
"""

from collections.abc import Sequence
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import Final, TypeVar

from gateway.modbus.peer import NOBODY, Peer

NOT_IPV4: Final = 0xFFFFFFFF
"""Shown in owner_ip for an owner without an IPv4 address (IPv6)."""
LARGEST_SERIAL_PLACE: Final = 255
"""Serial faces are shown in owner_ip as 1 to 255: 0.0.0.0/8 holds no address of a host (RFC 1122, 3.2.1.3)."""

MOST_KNOWN: Final = 64
"""Masters that anything is known of: memory stays bounded whoever writes."""

_SERIAL: Final = "serial:"
_Key = TypeVar("_Key")
_Kept = TypeVar("_Kept")


def keep_latest(known: dict[_Key, _Kept], key: _Key, kept: _Kept) -> None:
    """Put a master behind all others, and forget whoever has not been heard for longest where there are too many."""
    known.pop(key, None)
    known[key] = kept
    if len(known) > MOST_KNOWN:
        del known[next(iter(known))]


def serial_host(place: int) -> str:
    """Return who all masters on a serial face are. place: of the face in the rig's `fieldbus`, counted from 1."""
    return f"{_SERIAL}{place}"


def serial_place(host: str) -> int | None:
    """Return the place of the serial face that this host is, None where it is no serial face."""
    number = host.removeprefix(_SERIAL)
    is_serial = number != host and number.isdecimal() and number[0] != "0"
    return int(number) if is_serial and int(number) <= LARGEST_SERIAL_PLACE else None


class Ownership:
    """owner: the host that owns the setpoint, None for nobody; is_explicit: it has said so (bit 3); former: who owned
    before, where nobody does."""

    def __init__(self, configured: str | None) -> None:
        self._configured = configured
        self.owner: str | None = configured
        self.former: str | None = None
        self.is_explicit = False

    def admits(self, host: str) -> bool:
        """Return whether this host may command without taking over."""
        return self.owner is None or self.owner == host

    def may_take_over(self, host: str) -> bool:
        """Return whether a takeover by this host is allowed: not where the rig configures another."""
        return self._configured is None or self._configured == host

    def take(self, host: str, *, explicitly: bool = False) -> None:
        """Make this host the owner, unless the rig configures one."""
        if self._configured is None:
            self.is_explicit = explicitly or (self.is_explicit and self.owner == host)
            self.owner = host

    def settle(self, host: str, *, takes_over: bool, stops: bool, asks: bool) -> None:
        """Follow a write that was accepted. asks: it leaves something commanded; else it commands nothing any more."""
        if takes_over:
            self.take(host, explicitly=True)
        elif stops:
            self.release()
        elif not asks:
            self.rest()
        elif self.admits(host):  # not who has only ended a run
            self.take(host)

    def rest(self) -> None:
        """Release the ownership of a host that commands nothing any more, unless it took over explicitly."""
        if not self.is_explicit:
            self.release()

    def release(self) -> None:
        """Make nobody the owner, after a disable or the lease's end, unless the rig configures one."""
        self.is_explicit = False
        self.former = self.owner or self.former
        self.owner = self._configured


class LastWriters:
    """Who has written a register last, kept write by write, the latest last: most writes come in cycles, and nobody asks
    after each."""

    def __init__(self) -> None:
        self._writes: dict[Sequence[str], tuple[Peer, float]] = {}
        self._latest: tuple[Sequence[str], Peer, float] = (), NOBODY, 0.0  # a cycle's take its place, unhashed

    def note(self, names: Sequence[str], peer: Peer, now_s: float) -> None:
        """Note that these registers have been written."""
        if names is not self._latest[0]:
            self._keep_latest()
        self._latest = names, peer, now_s

    def by_name(self) -> dict[str, tuple[Peer, float]]:
        """Return register name -> (peer, time in s)."""
        self._keep_latest()
        return {name: written for names, written in self._writes.items() for name in names}

    def _keep_latest(self) -> None:
        names, peer, now_s = self._latest
        self._writes.pop(names, None)
        self._writes[names] = peer, now_s


def ip_number(host: str | None) -> int:
    """Return what owner_ip shows: 0 for nobody, the IPv4 address (also one mapped into IPv6), the place of a serial face,
    else NOT_IPV4."""
    if host is None:
        return 0
    if (place := serial_place(host)) is not None:
        return place
    try:
        address = ip_address(host.partition("%")[0])
    except ValueError:
        return NOT_IPV4
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else address
    return int(mapped) if isinstance(mapped, IPv4Address) else NOT_IPV4
