"""Who asks: what the bank needs to decide about ownership, and what people read in the log."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Peer:
    """The far end. host: numeric address, "serial" for RTU; port: 0 where there is none; name: from a certificate."""

    host: str
    port: int = 0
    name: str = ""

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        where = f"{host}:{self.port}" if self.port else host
        return f"{self.name} ({where})" if self.name else where


NOBODY: Final = Peer("nobody")
"""Whoever asks in the gateway's own name."""
