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
    one to end. One that another of the file has signed ends with that one, too, and that one counts for nothing else. A root
    beside our own certificate is a copy: its clients have theirs."""
    if name != "ca":
        chain = [each for each in certificates if each.issuer != each.subject]
        return _end_of_chain(certificates[0], chain) if certificates else ""
    signers = {each.issuer for each in certificates if each.issuer != each.subject}
    last = [each for each in certificates if each.subject not in signers] or certificates
    return max((_end_of_chain(each, certificates) for each in last), default="")


def _end_of_chain(shown: PeerCertificate, certificates: Sequence[PeerCertificate]) -> str:
    ends = shown.ends
    for _ in certificates:  # a ring of names ends, too
        above = [each for each in certificates if each.subject == shown.issuer != shown.subject]
        if not above:
            break
        shown = max(above, key=lambda each: each.ends)
        ends = min(ends, shown.ends)
    return ends


def expiry_sentence(name: str, file: str, ends: str) -> str:
    """Return W246."""
    return f"W246 {file} expires on {day_of(ends)}: {CURES[name]}"


def day_of(moment: str) -> str:
    """Return the day of a moment, for people."""
    return f"{moment[:4]}-{moment[4:6]}-{moment[6:8]}"
