"""Where a generated client finds its gateway, and what of that no rig can know."""

from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final

from gateway import defaults

_IPV4: Final = 4
_LAST_PORT_OF_S7: Final = 49151
_OWN_PORTS_OF_S7: Final = (20, 21, 25, 80, 102, 123, 5001, 34962, 34963, 34964)
"""TIA Portal help, MODBUS (TCP), CONNECT parameter: the range of RemotePort, and what a connection may not use."""


@dataclass(frozen=True)
class Endpoint:
    """Where the gateway listens: address, port, unit id. cautions: what of the rig makes a client less than it says, in
    sentences that fit a line of RAPID."""

    host: str
    port: int
    unit: int
    cautions: tuple[str, ...] = ()

    @property
    def shown_port(self) -> str:
        """The port as pages name it: 0 is none that anybody can ask, but says that one is chosen at each start."""
        return str(self.port or "PORT")

    @property
    def shown(self) -> str:
        """Address and port as programs take them: an IPv6 address in brackets."""
        return f"{f'[{self.host}]' if ':' in self.host else self.host}:{self.shown_port}"

    @property
    def unit_option(self) -> str:
        """Return what our own verbs need beside the address where the rig answers other units only."""
        return "" if self.unit == defaults.UNIT_ID else f" --unit {self.unit}"

    @property
    def s7_port_fault(self) -> str:
        """Return in a sentence that an S7 does not connect to this port; empty where it does."""
        if self.port <= _LAST_PORT_OF_S7 and self.port not in _OWN_PORTS_OF_S7:
            return ""
        own = ", ".join(map(str, _OWN_PORTS_OF_S7))
        return f"MB_CLIENT takes no port {self.port} ({own}, nor any above {_LAST_PORT_OF_S7})."

    def to_fill_in(self, *, from_elsewhere: bool) -> tuple[str, ...]:
        """Return what the integrator has to put in by hand, for no rig can know it. from_elsewhere: on another machine."""
        sentences = []
        host = ip_address(self.host)
        if not self.port:
            sentences.append("FILL IN the port: the rig's network.port is 0, another at each start.")
        if host.is_unspecified:
            sentences.append("FILL IN the address: the rig listens on every one of its machine.")
        elif from_elsewhere and host.is_loopback:
            sentences.append(f"FILL IN the address: no other machine reaches {host}.")
        elif from_elsewhere and host.version > _IPV4:
            sentences.append("FILL IN an IPv4 address: this client knows no IPv6.")
        return tuple(sentences)
