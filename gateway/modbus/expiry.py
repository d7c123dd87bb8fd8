"""When our own certificate ends, or that of its CA, and from when on that is told. Moments are UTC as YYYYMMDDHHMMSSZ, which
sort as the times do."""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Final

from gateway.modbus.certificate import PeerCertificate

SOON_DAYS: Final = 30
CURES: Final = {
    "certificate": "make a new one before that day, from then on no client connects",
    "ca": "from then on no certificate that it has signed counts: make a CA in another folder, and all anew",
}
"""Of the files of a TLS face that end: what to do."""
_FORM: Final = "%Y%m%d%H%M%SZ"


def utc_now() -> str:
    """Return this moment."""
    return datetime.now(UTC).strftime(_FORM)


def end_of(name: str, certificates: Sequence[PeerCertificate]) -> str:
    """Return when what stands in this file ends, empty where nothing stands there: the first certificate, of a CA's the last
    one to end."""
    return max((shown.ends for shown in certificates[: None if name == "ca" else 1]), default="")


def told_from(ends: str) -> str:
    """Return the moment from which on it is told that something ends then."""
    end = datetime.strptime(ends, _FORM).replace(tzinfo=UTC)
    return (end - timedelta(days=SOON_DAYS)).strftime(_FORM)


def expiry_sentence(name: str, file: str, ends: str) -> str:
    """Return W246."""
    return f"W246 {file} expires on {day_of(ends)}: {CURES[name]}"


def day_of(moment: str) -> str:
    """Return the day of a moment, for people."""
    return f"{moment[:4]}-{moment[4:6]}-{moment[6:8]}"
