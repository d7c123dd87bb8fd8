"""The control process's end of the guardian's line, on asyncio."""

import asyncio
import contextlib
import socket
from typing import Any

from gateway.service import link as guardian_link


class GuardianLine:
    """Our end of the guardian's line."""

    def __init__(self, link: socket.socket) -> None:
        self._link = link
        self._rig: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        self.told_to_stop = asyncio.Event()
        self.is_gone = False
        asyncio.get_running_loop().add_reader(link.fileno(), self._on_readable)

    async def simulated_ports(self, rig: str) -> dict[str, str] | None:
        """Ask for the simulated rig: its ptys, or None when it could not start (it has said why)."""
        self._send(guardian_link.NEED_RIG, {"rig": rig})
        answer = await self._rig
        ptys: dict[str, str] | None = answer.get("ptys")
        return ptys

    def heartbeat(self) -> None:
        self._send(guardian_link.HEARTBEAT)

    def hand_over(self, descriptor: int, safe_frame: bytes, safe_reply: bytes) -> None:
        """Before the first non-safe write, and after each reopen: the guardian can then speak the last word itself."""
        self._send(guardian_link.LINE, {"safe_frame": safe_frame.hex(), "safe_reply": safe_reply.hex()}, descriptor)

    def first_cause(self, cause: str) -> None:
        self._send(guardian_link.FIRST_CAUSE, {"cause": cause})

    def ready(self, announcement: dict[str, Any], stall_s: float) -> None:
        self._send(guardian_link.READY, announcement | {"stall_s": stall_s})

    def close(self) -> None:
        asyncio.get_running_loop().remove_reader(self._link.fileno())
        self._link.close()

    def _send(self, tag: str, body: dict[str, Any] | None = None, descriptor: int | None = None) -> None:
        with contextlib.suppress(OSError):  # a guardian that is gone shows as the end of the line
            guardian_link.send(self._link, tag, body, descriptor)

    def _on_readable(self) -> None:
        try:
            message = guardian_link.receive(self._link)
        except BlockingIOError:
            return
        if message is None:
            self.is_gone = True
            self.told_to_stop.set()
            asyncio.get_running_loop().remove_reader(self._link.fileno())
        elif message.tag == guardian_link.RIG and not self._rig.done():
            self._rig.set_result(message.body)
        elif message.tag == guardian_link.STOP:
            self.told_to_stop.set()
