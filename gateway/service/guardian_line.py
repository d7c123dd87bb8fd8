"""The control process's end of the guardian's line, on asyncio."""

import asyncio
import contextlib
import copy
import os
import socket
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Final

from gateway.devices import DeviceProfile
from gateway.devices.roles import OutputHost
from gateway.processes import message_link as guardian_link
from gateway.service.heartbeat_memory import HeartbeatMemory
from gateway.service.supervisor.safe_line import REPLY_S

_BEATS_PER_STALL: Final = 8  # at least so many fit into the silence that kills; each wakes the guardian

_LONGEST_REPLY_S: Final = 0.5  # three times so long a start waits for a device that is off

_LONGEST_CAUSE: Final = 2000  # characters: an exception may hold all that it could not read, and the line takes 64 KiB


def told_of_reply(host: OutputHost, profile: DeviceProfile) -> dict[str, Any]:
    """Return what `hand_over` tells of the reply that acknowledges the safe voltage. Told of its bytes alone, an Alicat
    acknowledged at a pressure of 0 only, and a device that takes 0.2 s never."""
    timeout_s = min(_LONGEST_REPLY_S, max(REPLY_S, profile.reply_timeout_s))
    more = {"form": host.safe_reply_form.hex(), "reply_timeout_s": timeout_s}
    return {"safe_reply": host.safe_reply, "reply_end": profile.terminator_bytes, **more}


class GuardianLine:
    """Our end of the guardian's line. memory: where the loop beats; without it each beat is a message. on_ports: the simulated
    rig has been started again, with these ptys; rig_pid: its process, None for a real rig. left_beats: the owner's heartbeats
    at the last beat of the process before, None where nobody knows; kept: what the guardian has been told for the next one.

    A guardian that does not read for a while misses heartbeats, which is what its silence deserves, but nothing else:
    what does not fit waits, in order, for the next heartbeat.
    """

    def __init__(self, link: socket.socket, memory: HeartbeatMemory | None = None) -> None:
        self.on_ports: Callable[[dict[str, str]], None] = lambda ports: None
        self.rig_pid: int | None = None
        self._link = link
        self._memory = memory
        self.left_beats = None if memory is None else memory.master_beats
        self.kept: dict[str, Any] = {}
        self._waiting: deque[tuple[str, dict[str, Any], tuple[int, ...]]] = deque()
        self._rig: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        self.told_to_stop = asyncio.Event()
        self.is_gone = False
        self._beat_every_s = self._next_beat_s = 0.0
        asyncio.get_running_loop().add_reader(link.fileno(), self._on_readable)

    async def simulated_ports(self, rig: str) -> dict[str, str] | None:
        """Ask for the simulated rig: its ptys, or None when it could not start (the guardian has said why)."""
        self._tell(guardian_link.NEED_RIG, {"rig": rig})
        answer = await self._rig
        ptys: dict[str, str] | None = answer.get("ptys")
        return ptys

    def heartbeat(self, now_s: float, owner: str | None = None, master_beats: Sequence[int] = (0,)) -> None:
        """Send what the line could not take before, and beat. now_s: monotonic; owner: master that owns the setpoint now;
        master_beats: what its frames bring as its heartbeat."""
        if owner != self.kept.get("owner"):
            self.keep(owner=owner)
        if self._waiting:
            self._send_waiting()
        if self._memory is not None:
            self._memory.beat(now_s, master_beats)
            return
        if now_s < self._next_beat_s:
            return
        self._next_beat_s = now_s + self._beat_every_s
        with contextlib.suppress(OSError):  # a guardian that is gone shows as the end of the line
            guardian_link.send(self._link, guardian_link.HEARTBEAT)

    def hand_over(self, descriptor: int, safe_frame: bytes, safe_reply: bytes, reply_end: bytes, **more: Any) -> None:
        """Give the guardian the line, before the first non-safe write and after each reopen: it can then do the final
        safe-voltage write itself. reply_end, and more of the reply, as JSON: see SafeLine. OSError where there is no descriptor
        left for it: nobody would guard the line."""
        told = {"safe_frame": safe_frame.hex(), "safe_reply": safe_reply.hex(), "reply_end": reply_end.hex(), **more}
        self._waiting.append((guardian_link.LINE, told, (os.dup(descriptor),)))
        self._send_waiting()

    def take_back(self) -> None:
        """Have the guardian close a line that is lost: while anybody has it open an adapter that is plugged in again gets
        another name, ttyUSB1 for ttyUSB0, and is not found."""
        self._tell(guardian_link.LINE_LOST, {})

    def keep(self, **facts: Any) -> None:
        """Have the guardian tell the next control process; each name's newest fact counts. What it knows already is not told
        again: this may be called at each tick."""
        if not facts.items() <= self.kept.items():
            self.kept |= copy.deepcopy(facts)  # whoever has told it may change it
            self._tell(guardian_link.KEEP, facts)

    def first_cause(self, cause: str) -> None:
        """Tell the guardian of an internal error, in words: this process is about to end. Of a long one the beginning."""
        self._tell(guardian_link.FIRST_CAUSE, {"text": cause[:_LONGEST_CAUSE]})

    def note_safe(self) -> None:
        """Tell the guardian that the safe voltage has gone out as the last one: from now on no heartbeat is to be missed."""
        self._tell(guardian_link.SAFE, {})

    def ready(self, announcement: dict[str, Any], stall_s: float, *listeners: int) -> None:
        """Tell the guardian that the rig runs. stall_s: silence that it has to act on; listeners: sockets for it to keep."""
        self._beat_every_s = stall_s / _BEATS_PER_STALL
        self._tell(guardian_link.READY, announcement | {"stall_s": stall_s}, *listeners)

    def close(self) -> None:
        """Send what is still waiting, as far as the line takes it, and close the line."""
        self._send_waiting()
        while self._waiting:
            self._forget_first()
        asyncio.get_running_loop().remove_reader(self._link.fileno())
        self._link.close()
        if self._memory is not None:
            self._memory.close()
            self._memory = None

    def _tell(self, tag: str, body: dict[str, Any], *descriptors: int) -> None:
        with contextlib.suppress(OSError):  # a listener that is closed already is not kept
            self._waiting.append((tag, body, tuple(os.dup(descriptor) for descriptor in descriptors)))
        self._send_waiting()

    def _send_waiting(self) -> None:
        while self._waiting:
            tag, body, descriptors = self._waiting[0]
            try:
                guardian_link.send(self._link, tag, body, *descriptors)
            except BlockingIOError:
                return
            except OSError:
                pass  # it is gone
            self._forget_first()

    def _forget_first(self) -> None:
        _, _, descriptors = self._waiting.popleft()
        for descriptor in descriptors:
            os.close(descriptor)

    def _on_readable(self) -> None:
        try:
            message = guardian_link.receive(self._link)
        except BlockingIOError:
            return
        if message is None:
            self.is_gone = True
            self.told_to_stop.set()
            self._on_rig({"failed": True})  # nobody is left to answer
            asyncio.get_running_loop().remove_reader(self._link.fileno())
        elif message.tag == guardian_link.STOP:
            self.told_to_stop.set()
        elif message.tag == guardian_link.RIG:
            self._on_rig(message.body)

    def _on_rig(self, answer: dict[str, Any]) -> None:
        self.rig_pid = answer.get("pid")
        if not self._rig.done():
            self._rig.set_result(answer)
        elif "ptys" in answer:
            self.on_ports(answer["ptys"])
