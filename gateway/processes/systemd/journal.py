"""Events as fields of systemd's journal: `journalctl FORCE_GATEWAY_CODE=A310`. Standard library only.

Where stderr is the journal's own stream (JOURNAL_STREAM names it), events go to the journal's socket instead, one datagram
each, in its native protocol (systemd, "Native Journal Protocol"): a line of text could carry no code, and no severity but a
prefix. Anything else that a process writes on stderr still arrives there, as a line.
"""

import contextlib
import os
import socket
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, TextIO

from gateway.plain_file import exists
from gateway.processes.event import ERROR, INFO, WARNING, EventRecord

SOCKET: Final = Path("/run/systemd/journal/socket")
PRIORITIES: Final = {ERROR: 3, WARNING: 4, INFO: 6}
"""Severity -> syslog priority (RFC 5424, table 2)."""
_IDENTIFIER: Final = "force-gateway"


def is_journal(environment: Mapping[str, str], stream: TextIO) -> bool:
    """Decide whether this is the journal's stream, as JOURNAL_STREAM says (systemd.exec(5))."""
    with contextlib.suppress(OSError, ValueError):  # no descriptor behind it
        found = os.fstat(stream.fileno())
        return environment.get("JOURNAL_STREAM") == f"{found.st_dev}:{found.st_ino}"
    return False


def encode_fields(event: EventRecord) -> bytes:
    """Return an event as the journal's datagram."""
    fields = {
        "MESSAGE": f"{event.code} {event.text}" if event.code else event.text,
        "PRIORITY": str(PRIORITIES[event.severity]),
        "SYSLOG_IDENTIFIER": _IDENTIFIER,
        "FORCE_GATEWAY_CAUSE": event.cause,
        "FORCE_GATEWAY_SOURCE": event.source,
    }
    if event.code:
        fields["FORCE_GATEWAY_CODE"] = event.code
    return b"".join(_field(name, value.encode("utf-8", "replace")) for name, value in fields.items())


def _field(name: str, value: bytes) -> bytes:
    """A value with line ends goes with its length before it, or it would end there."""
    if b"\n" not in value:
        return name.encode() + b"=" + value + b"\n"
    return name.encode() + b"\n" + len(value).to_bytes(8, "little") + value + b"\n"


def journal_writer(path: Path = SOCKET) -> Callable[[EventRecord], None] | None:
    """Return what writes events to the journal, None where stderr goes elsewhere. It raises OSError as a terminal would."""
    if not exists(path) or not is_journal(os.environ, sys.stderr):
        return None

    def write(event: EventRecord) -> None:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as link:
            link.sendto(encode_fields(event), str(path))

    return write
