"""The guardian's line to a child: both ends of one SOCK_SEQPACKET pair, so that messages stay whole.

A message is one tag byte and a JSON object; HEARTBEAT is the bare tag. Descriptors go beside it (SCM_RIGHTS): an exclusive
tty survives SIGKILL as EBUSY for a second open, a shared descriptor does not. No call here waits, and the death of the
other side, at whatever point, is an end or an OSError, never a half message. Standard library only: the guardian imports this.
"""

import array
import contextlib
import json
import os
import socket
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final

HEARTBEAT: Final = "h"  # control -> guardian, each tick of the loop
LINE: Final = "l"  # control -> guardian: safe_frame, safe_reply, reply_end, form in hex, reply_timeout_s + descriptor
LINE_LOST: Final = (
    "g"  # control -> guardian: the line's port is gone; who kept it open would keep its name from the next one
)
NEED_RIG: Final = "n"  # control -> guardian: {"rig": name or path}: start the simulated rig
READY: Final = (
    "r"  # control -> guardian: {"banner": text, "info": {...}, "stall_s": s, "optional": ..., "listening": ...}
)
KEEP: Final = (
    "c"  # control -> guardian: {"recording": ..., "calibration": ...}: what the next control process is to know
)
SAFE: Final = "s"  # control -> guardian: the safe voltage has gone out as the last one; no loop beats any more
FIRST_CAUSE: Final = "f"  # control -> guardian: {"text": ...}, kept for the next start
BORN: Final = "b"  # a forked child -> guardian: {"pid": number}, before anything else
ADOPTED: Final = "a"  # guardian -> a forked child: it is followed from now on, and may begin
PTYS: Final = "y"  # simulated rig -> guardian: {"ptys": {...}, "pid": 1234}
RIG: Final = "p"  # guardian -> control: {"ptys": {...}} or {"failed": True}; again whenever the ports have moved
STOP: Final = "q"  # guardian -> control: ramp to 0, safe voltage, exit
FORK: Final = (
    "k"  # guardian -> fork server: {"module": name, "arguments": {...}} + the child's end, then what it shares
)

_LARGEST: Final = 65536
_MOST_DESCRIPTORS: Final = 4
_CUT_OFF: Final = int(socket.MSG_TRUNC | socket.MSG_CTRUNC)
_FLAGS: Final = socket.MSG_DONTWAIT | getattr(socket, "MSG_CMSG_CLOEXEC", 0)  # a port's lock is no child's inheritance


class ProtocolError(ValueError):
    """Error of a sender that sent no message of this protocol, and cannot be relied on any more."""


@dataclass
class Message:
    """One message between processes: tag, JSON body, descriptors handed over."""

    tag: str
    body: dict[str, Any] = field(default_factory=dict)
    descriptors: list[int] = field(default_factory=list)

    def drop_descriptors(self) -> None:
        """Close what nobody takes over."""
        while self.descriptors:
            with contextlib.suppress(OSError):
                os.close(self.descriptors.pop())


def create_link() -> tuple[socket.socket, socket.socket]:
    """Return both ends of a new line."""
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


def send(link: socket.socket, tag: str, body: dict[str, Any] | None = None, *descriptors: int) -> None:
    """Send one message; OSError when the other side is gone, BlockingIOError when it does not read."""
    data = tag.encode() + (json.dumps(body).encode() if body is not None else b"")
    beside = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))] if descriptors else []
    link.sendmsg([data], beside, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)


def receive(link: socket.socket) -> Message | None:
    """Return the next message, None at the end of the line; a reset of a killed peer is an end too, behind its last words.

    BlockingIOError when there is none yet, ProtocolError for what is not of this protocol.
    """
    try:
        data, ancillary, flags, _ = _receive_raw(link)
    except BlockingIOError:
        raise
    except OSError:
        return None
    message = Message("", {}, _descriptors(ancillary))
    if not data:
        message.drop_descriptors()
        return None
    try:
        message.tag, message.body = chr(data[0]), _body(data, flags)
    except ProtocolError:
        message.drop_descriptors()
        raise
    return message


def _receive_raw(link: socket.socket) -> tuple[bytes, list[tuple[int, int, bytes]], int, Any]:
    """Receive, once more after a reset: a peer that died with something of ours unread gives one, and then its last words."""
    space = socket.CMSG_SPACE(4 * _MOST_DESCRIPTORS)
    try:
        return link.recvmsg(_LARGEST, space, _FLAGS)
    except ConnectionResetError:
        return link.recvmsg(_LARGEST, space, _FLAGS)


def _body(data: bytes, flags: int) -> dict[str, Any]:
    if flags & _CUT_OFF:
        raise ProtocolError(f"a message of {chr(data[0])!r} lost its end")
    if len(data) == 1:
        return {}
    try:
        body = json.loads(data[1:])
    except (ValueError, RecursionError):
        body = None
    if not isinstance(body, dict):
        raise ProtocolError(f"a message of {chr(data[0])!r} without its fields")
    return body


def _descriptors(ancillary: Iterable[tuple[int, int, bytes]]) -> list[int]:
    descriptors = array.array("i")
    for level, kind, payload in ancillary:
        if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
            descriptors.frombytes(payload[: len(payload) // 4 * 4])
    return list(descriptors)
