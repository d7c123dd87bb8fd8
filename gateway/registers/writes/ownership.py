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

from gateway import defaults
from gateway.modbus.peer import NOBODY, Peer
from gateway.registers.command import Channel

NOT_IPV4: Final = 0xFFFFFFFF
"""Shown in owner_ip for an owner without an IPv4 address (IPv6)."""
LARGEST_SERIAL_PLACE: Final = 255
"""Serial faces are shown in owner_ip as 1 to 255: 0.0.0.0/8 holds no address of a host (RFC 1122, 3.2.1.3)."""

MOST_KNOWN: Final = 64
"""Masters that anything is known of: memory stays bounded whoever writes."""

LONGEST_CYCLE_S: Final = 0.8
"""In which a program that writes in cycles comes again; a person needs longer to want the same once more."""

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


class FrameBeats:
    """The last heartbeat of each frame: of a program that stands still none changes, whatever its other frames bring."""

    def __init__(self) -> None:
        self._last: dict[Channel, int] = {}

    def has_brought(self, channel: Channel, heartbeat: int) -> bool:
        """Decide whether this is what the frame has brought last, by this connection or by whichever."""
        return heartbeat in (self._last.get(channel), self._last_alike(channel))

    def has_changed(self, channel: Channel, heartbeat: int) -> bool:
        """Decide whether the frame has brought another one last. Its first proves nothing."""
        return self.knows_alike(channel) and not self.has_brought(channel, heartbeat)

    def knows_alike(self, channel: Channel) -> bool:
        """Decide whether the frame has come before, by whichever connection."""
        return self._last_alike(channel) is not None

    def moves(self, channel: Channel, heartbeat: int) -> bool:
        """Decide whether a program goes on that brings this: of a connection's first frame a heartbeat counts that none of its
        host's frames has brought."""
        return self.has_changed(channel, heartbeat) and (channel in self._last or heartbeat not in self.of(channel[0]))

    def _last_alike(self, channel: Channel) -> int | None:
        """Return what a host's last frame to these words has brought: a program that hung may connect anew for each frame."""
        host, _, _, *words = channel
        alike = (beat for known, beat in reversed(self._last.items()) if known[0] == host and [*known[3:]] == words)
        return next(alike, None)

    def knows(self, channel: Channel) -> bool:
        """Decide whether the frame has come before."""
        return channel in self._last

    def note(self, channel: Channel, heartbeat: int) -> bool:
        """Note what a frame brings; return whether that is another heartbeat than before, or its first."""
        is_new = not self.has_brought(channel, heartbeat)
        keep_latest(self._last, channel, heartbeat)
        return is_new

    def of(self, host: str | None) -> list[int]:
        """Return what the latest frames of a host have brought last."""
        return [beat for channel, beat in self._last.items() if channel[0] == host][-defaults.MOST_FRAMES :]


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
