"""The guardian's line to its control process: both ends of one SOCK_SEQPACKET pair, so that messages stay whole.

A message is one tag byte and a JSON object; HEARTBEAT is the bare tag. A LINE message carries the serial port's
descriptor beside it (SCM_RIGHTS): an exclusive tty survives SIGKILL as EBUSY for a second open, a shared descriptor does not.
Standard library only: the guardian imports this.
"""

import array
import json
import socket
from dataclasses import dataclass, field
from typing import Any, Final

HEARTBEAT: Final = "h"  # control -> guardian, each tick of the loop
LINE: Final = "l"  # control -> guardian: {"safe_frame": hex, "safe_reply": hex} + descriptor
NEED_RIG: Final = "n"  # control -> guardian: {"rig": name or path}: start the simulated rig
READY: Final = "r"  # control -> guardian: {"banner": text, "info": {...}, "stall_s": s}
FIRST_CAUSE: Final = "f"  # control -> guardian: {"cause": text}, kept for the next start
RIG: Final = "p"  # guardian -> control: {"ptys": {...}} or {"failed": exit code}
STOP: Final = "q"  # guardian -> control: ramp to 0, safe voltage, exit

_LARGEST = 65536


@dataclass
class Message:
    tag: str
    body: dict[str, Any] = field(default_factory=dict)
    descriptors: list[int] = field(default_factory=list)


def pair() -> tuple[socket.socket, socket.socket]:
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


def send(link: socket.socket, tag: str, body: dict[str, Any] | None = None, descriptor: int | None = None) -> None:
    """Send one message; OSError when the other side is gone, BlockingIOError when it does not read."""
    data = tag.encode() + (json.dumps(body).encode() if body is not None else b"")
    if descriptor is None:
        link.send(data)
    else:
        link.sendmsg([data], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [descriptor]))])


def receive(link: socket.socket) -> Message | None:
    """The next message, None at the end of the line. A reset of a killed peer is an end too."""
    try:
        data, ancillary, _, _ = link.recvmsg(_LARGEST, socket.CMSG_SPACE(4 * 4))
    except ConnectionResetError:
        return None
    if not data:
        return None
    descriptors = array.array("i")
    for level, kind, payload in ancillary:
        if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
            descriptors.frombytes(payload[: len(payload) // 4 * 4])
    return Message(chr(data[0]), json.loads(data[1:]) if len(data) > 1 else {}, list(descriptors))
