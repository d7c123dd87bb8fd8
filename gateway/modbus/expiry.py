"""What is said when our own certificate is about to end, or that of its CA. Moments are UTC as YYYYMMDDHHMMSSZ, which sort as
the times do."""

from collections.abc import Sequence
from typing import Final

from gateway.modbus.certificate import PeerCertificate

SOON_DAYS: Final = 30
CURES: Final = {
    "certificate": "make a new one before that day, from then on no client connects",
    "ca": "from then on no certificate that it has signed counts: make a CA in another folder, and all anew",
}
"""Of the files of a TLS face that end: what to do."""


def end_of(name: str, certificates: Sequence[PeerCertificate]) -> str:
    """Return when what stands in this file ends, empty where nothing stands there: the first certificate, of a CA's the last
    one to end."""
    return max((shown.ends for shown in certificates[: None if name == "ca" else 1]), default="")


def expiry_sentence(name: str, file: str, ends: str) -> str:
    """Return W246."""
    return f"W246 {file} expires on {day_of(ends)}: {CURES[name]}"


def day_of(moment: str) -> str:
    """Return the day of a moment, for people."""
    return f"{moment[:4]}-{moment[4:6]}-{moment[6:8]}"
