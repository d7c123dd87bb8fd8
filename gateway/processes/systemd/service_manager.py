"""What the guardian tells systemd: ready, alive, stopping (sd_notify(3)). Standard library only.

Alive is what the control loop says, never a timer of ours: each message follows from a heartbeat of the loop, so that a
service whose loop stands is restarted although its guardian still runs. Between the death of a control process and the next
one's READY no loop beats; for that time the longer bound of a start is asked for, and taken back at READY. The words are
sent by hand: they are one datagram, and a library for it would be one more thing that the guardian imports.
"""

import contextlib
import os
import socket
from collections.abc import Mapping, MutableMapping
from math import inf
from typing import Final

_SHARE: Final = 3.0  # so many messages in the time after which systemd acts
_US_PER_S: Final = 1e6
_WAKES: Final = ("NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID")


class ServiceManager:
    """address: of systemd's socket, empty where nobody has started us as a service: then nothing is said. watchdog_s: silence
    after which systemd restarts the service, None without a watchdog."""

    def __init__(self, address: str = "", watchdog_s: float | None = None) -> None:
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._watchdog_s = watchdog_s
        self._next_s = 0.0

    @property
    def feed_every_s(self) -> float:
        """Time within which the next heartbeat is to be passed on, s; endless without a watchdog."""
        return inf if self._watchdog_s is None else self._watchdog_s / _SHARE

    def ready(self, status: str) -> None:
        """Tell that the rig runs; from now on the loop's heartbeats are waited for."""
        self._say({"READY": "1", "STATUS": status} | self._bound(self._watchdog_s))

    def starting(self, status: str, within_s: float) -> None:
        """Tell that control is being started, and that no loop beats for so long at most."""
        longest_s = None if self._watchdog_s is None else max(within_s, self._watchdog_s)
        self._say({"STATUS": status, "WATCHDOG": "1"} | self._bound(longest_s))

    def feed(self, heard_s: float) -> None:
        """Pass on a heartbeat of the loop, as often as the watchdog needs. heard_s: when it came, monotonic."""
        if self._watchdog_s is None or heard_s < self._next_s:
            return
        self._next_s = heard_s + self.feed_every_s
        self._say({"WATCHDOG": "1"})

    def stopping(self) -> None:
        """Tell that the force is being ramped down."""
        self._say({"STOPPING": "1", "STATUS": "ramping the force to 0"})

    def _bound(self, seconds: float | None) -> dict[str, str]:
        return {} if seconds is None else {"WATCHDOG_USEC": str(round(seconds * _US_PER_S))}

    def _say(self, words: Mapping[str, str]) -> None:
        """A manager that does not listen is no reason to end: the force is."""
        if not self._address:
            return
        text = "\n".join(f"{name}={value}" for name, value in words.items())
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as link,
        ):
            link.setblocking(False)
            link.sendto(text.encode(), self._address)


def take_service_manager(environment: MutableMapping[str, str], pid: int) -> ServiceManager:
    """Return the manager that this environment names, and take it out of there: children are no service of their own."""
    address, bound_us, meant = (environment.pop(name, "") for name in _WAKES)
    is_meant = not meant or meant == str(pid)
    watchdog_s = int(bound_us) / _US_PER_S if bound_us.isdecimal() and int(bound_us) and is_meant else None
    return ServiceManager(address, watchdog_s)


def service_manager() -> ServiceManager:
    """Return the manager that has started this process, a silent one where none has."""
    return take_service_manager(os.environ, os.getpid())
