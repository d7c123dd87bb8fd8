"""Who asks: what the bank needs to decide about ownership and role, and what people read in the log."""

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final


class Role(IntEnum):
    """What a peer may do; each includes those before it. Which block needs which is in gateway.registers.roles.

    A certificate names one in lower case (`setpoint`); the peers of a plain face have the one that their rig gives them.
    """

    MONITOR = 0
    SETPOINT = 1
    CALIBRATION = 2
    ADMIN = 3


@dataclass(frozen=True, slots=True)
class Peer:
    """The far end. host: numeric address, or `serial:N` for the Nth face of a rig's `fieldbus`; port: 0 where there is none;
    name: from a certificate; is_behind: more of it waits than is answered, so that what it asks now was asked a while ago."""

    host: str
    port: int = 0
    name: str = ""
    role: Role = Role.SETPOINT
    is_behind: bool = field(default=False, compare=False)
    identity: str = field(init=False, compare=False, repr=False)
    """Name of the owner when this peer owns the setpoint: the certificate where there is one, else the address. No address
    reads like a certificate's, so that none can be taken for another."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "identity", f"certificate {self.name}" if self.name else self.host)

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host and self.port else self.host
        where = f"{host}:{self.port}" if self.port else host
        return f"{self.name} ({where})" if self.name else where


NOBODY: Final = Peer("nobody")
"""Whoever asks in the gateway's own name."""
