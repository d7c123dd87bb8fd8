"""What the guardian is asked to start beside control, and the listening sockets that it keeps for them.

Sockets are bound by control, before READY: an address that is taken ends the start with a sentence, and the line of READY says
which port it became. The guardian keeps them from then on, so that a restart of control, or of the page, loses no caller.
"""

import os
import socket
from ipaddress import ip_address
from typing import Any, Final

from gateway import defaults
from gateway.processes import exit_codes
from gateway.profiles import Rig
from gateway.profiles.http_sections import split_listen
from gateway.profiles.rigs.checks.network import NEEDS_TOKEN
from gateway.recording.ring import SampleRing
from gateway.service.running_rig.starting import StartError

Address = tuple[str, int]
_BACKLOG: Final = 128


class Listeners:
    """sockets: bound by this process, by name; addresses: these, and those that the guardian keeps from before a restart."""

    def __init__(self, kept: dict[str, list[Any]]) -> None:
        self.sockets: dict[str, socket.socket] = {}
        self.addresses: dict[str, Address] = {name: (host, port) for name, (host, port) in kept.items()}

    def open(self, rig: Rig, asked: dict[str, list[Any] | None]) -> tuple[str, ...]:
        """Open what the rig or the command line asks for; return sentences for people. StartError says what is taken."""
        sections = {"web": rig.web, "metrics": rig.metrics}
        notes: tuple[str, ...] = ()
        for name, section in sections.items():
            wanted = asked.get(name) or (split_listen(section.listen) if section else None)
            if wanted is None or name in self.addresses:
                continue
            host, port = str(wanted[0]), int(wanted[1])
            if name == "web" and host and not (rig.web and rig.web.token) and not ip_address(host).is_loopback:
                raise StartError(f"E128 {host}:{port} {NEEDS_TOKEN}", exit_codes.CONFIGURATION)
            notes += self._bind(name, host, port) if host else self._bind_usual(name)
        return notes

    def close(self) -> None:
        """Close this process's copies; the guardian has its own."""
        for listener in self.sockets.values():
            listener.close()

    def _bind_usual(self, name: str) -> tuple[str, ...]:
        """The usual port, or a free one."""
        try:
            return self._bind(name, defaults.HOST, defaults.WEB_PORT)
        except StartError:
            self._bind(name, defaults.HOST, 0)
        port = self.addresses[name][1]
        return (f"port {defaults.WEB_PORT} is taken by another program: the page is on {port}",)

    def _bind(self, name: str, host: str, port: int) -> tuple[str, ...]:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            listener = socket.create_server((host, port), family=family, backlog=_BACKLOG)
        except OSError as error:
            why = os.strerror(error.errno) if error.errno else str(error)
            sentence = f"E127 --{name} {host}:{port}: {why}; another --{name} HOST:PORT? (port 0: any free one)"
            code = exit_codes.PERMISSION if isinstance(error, PermissionError) else exit_codes.DEVICE
            raise StartError(sentence, code) from error
        self.sockets[name] = listener
        self.addresses[name] = (host, int(listener.getsockname()[1]))
        return ()


def optional_children(rig: Rig, ring: SampleRing | None, addresses: dict[str, Address]) -> dict[str, dict[str, Any]]:
    """Return what each child that control can do without is told, by its name; settings: its section of the rig file, without
    secrets, which do not belong on a command line."""
    children: dict[str, dict[str, Any]] = {}
    read_again = {"simulated": rig.simulated, "fingerprint": rig.fingerprint}
    if rig.is_watched and not rig.why_unwatched and ring is not None:
        watch = rig.residual_watch
        children["watch"] = read_again | {"window_s": watch.window_s, "every_s": watch.every_s}
    if rig.mqtt:
        children["mqtt"] = read_again
    if rig.opcua:
        children["opcua"] = {"settings": {"listen": rig.opcua.listen, "name": rig.name}}
    for name, (host, port) in addresses.items():
        children[name] = read_again | {"settings": {"host": host, "port": port}}
    return children
