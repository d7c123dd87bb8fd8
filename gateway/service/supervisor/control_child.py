"""The control process as the guardian sees it: its messages, its heartbeat and the output line that it has handed over.

The guardian decides when it is started, killed and started again. Standard library only.
"""

import contextlib
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import isnan
from typing import Any, Final

from gateway.processes import message_link
from gateway.processes.exit_cause import EndCause, Ending
from gateway.service.heartbeat_memory import HeartbeatMemory
from gateway.service.supervisor.child_process import Child
from gateway.service.supervisor.child_starter import ChildStarter
from gateway.service.supervisor.heartbeat import Heartbeat
from gateway.service.supervisor.safe_line import REPLY_S, SafeLine

START_GRACE_S: Final = 30.0  # imports on a slow machine; nothing but the safe voltage is written before READY
STOP_BOUND_S: Final = 5.0  # from the first signal; from the end of the line of a control process that never was ready
_MOST_MESSAGES: Final = 1000  # of one wait: a child that floods its line does not keep us from the rest


@dataclass
class ControlChild:
    """The present control process, and what of the last one still counts. Times are monotonic seconds of `clock`.

    on_ready: called with each READY; on_rig_needed: with each request for the simulated rig's ports.
    """

    starter: ChildStarter
    clock: Callable[[], float]
    on_ready: Callable[[message_link.Message], None]
    on_rig_needed: Callable[[], None]

    process: Child | None = None  # None: between a death and the next start
    heartbeat: Heartbeat = field(default_factory=Heartbeat)
    memory: HeartbeatMemory | None = None  # where its loop beats; without it each beat is a message
    safe_line: SafeLine | None = None  # stays after a death until the safe voltage has gone through it
    is_line_lost: bool = False  # its port is gone: counts where there is no line
    reported_cause: Ending | None = None  # what control gave as its own first cause
    kept: dict[str, Any] = field(default_factory=dict)  # what the last one has told for the next one
    is_link_ended: bool = False
    is_safe: bool = False  # it has sent the safe voltage as its last one, and no loop beats any more
    _beat_s: float = 0.0  # what the memory said last
    asked_s: float = 0.0  # when the process was asked for, or is to be

    @property
    def sources(self) -> list[int]:
        """Descriptors that become readable when control says something or has died."""
        if self.process is None:
            return []
        sources = [] if self.is_link_ended else [self.process.link.fileno()]
        return sources + ([self.process.died] if self.process.died >= 0 else [])

    @property
    def due_s(self) -> float:
        """Time at which control is overdue: its heartbeat, READY, its birth; without a process, when one is to be started."""
        if self.process is None:
            return self.asked_s
        if self.heartbeat.is_up:
            return self.heartbeat.due_s
        return self.asked_s + (START_GRACE_S if self.process.pid else self.starter.start_timeout_s)

    def start(self, arguments: dict[str, Any]) -> None:
        """Start a process. OSError where the machine has none to give."""
        self.reported_cause, self.is_link_ended, self.is_safe, self.asked_s = None, False, False, self.clock()
        self._beat_s = self.memory.beat_s if self.memory else 0.0
        self.process = self.starter.control(arguments)

    def hear_beat(self) -> None:
        """Look whether the loop has beaten. A time that has not come yet counts as now, and once."""
        if self.memory is None or self.process is None or not self.heartbeat.is_up:
            return
        beat_s = self.memory.beat_s
        if beat_s != self._beat_s and not isnan(beat_s):  # with nan no silence would ever be too long
            self._beat_s = beat_s
            self.heartbeat.record_beat(self.process, min(beat_s, self.clock()))

    def tell(self, tag: str, body: dict[str, Any] | None = None) -> None:
        """Send a message, if there is somebody to read it."""
        if self.process:
            with contextlib.suppress(OSError):  # one that is gone shows as the end of its line
                message_link.send(self.process.link, tag, body)

    def has_died(self, readable: set[int]) -> bool:
        """Decide whether the process has died, by what is readable."""
        return self.process is not None and self.process.died >= 0 and self.process.died in readable

    def has_spoken(self, readable: set[int]) -> bool:
        """Decide whether there are messages, or the end of them, by what is readable."""
        return self.process is not None and not self.is_link_ended and self.process.link.fileno() in readable

    def read_messages(self) -> None:
        """Read all that control has said: a burst must not make a live loop look silent."""
        process = self.process
        if process is None or self.is_link_ended:
            return
        try:
            for _ in range(_MOST_MESSAGES):
                message = message_link.receive(process.link)
                if message is None:
                    self._on_end_of_link()
                    return
                self._handle(process, message)
        except BlockingIOError:
            return
        except Exception as error:  # whatever it said: it has gone wrong, and must not take us with it
            self.reported_cause = Ending(
                EndCause.NONSENSE, f"control process said {error!r}: internal error, please report it"
            )
            self.is_link_ended = True
            process.kill()

    def write_safe_voltage(self) -> bool | None:
        """Kill control and write the safe voltage through the newest line that it has handed over.

        Return whether the device acknowledged it, False where its port is gone; None where there was no line.
        """
        if self.process:
            self.process.kill()
            self.read_messages()
        if self.safe_line:
            self.safe_line = replace(self.safe_line, hears_itself=bool(self.kept.get("hears_itself")))
        acknowledged = self.safe_line.write_safe() if self.safe_line else False if self.is_line_lost else None
        self.is_line_lost = False
        self._drop_line()  # our copy of the descriptor carries the port's lock, which the next control process needs
        return acknowledged

    def _on_end_of_link(self) -> None:
        """It is about to end: its death, or its silence, is what counts now. Before READY there is no silence yet."""
        self.is_link_ended = True
        self.asked_s = min(self.asked_s, self.clock() - START_GRACE_S + STOP_BOUND_S)

    def _handle(self, process: Child, message: message_link.Message) -> None:
        try:
            self._follow(process, message)
        finally:
            message.drop_descriptors()  # a port's, kept behind nonsense, would keep its lock from the next control process

    def _follow(self, process: Child, message: message_link.Message) -> None:
        if message.tag == message_link.HEARTBEAT:
            if self.heartbeat.is_up:  # before READY the start has its own, longer patience
                self.heartbeat.record_beat(process, self.clock())
        elif message.tag == message_link.BORN:
            with contextlib.suppress(OSError):  # it has died since: the end of its line is behind this message
                process.adopt(int(message.body["pid"]))
                self.starter.on_born()
        elif message.tag == message_link.LINE:
            self._take_line(message)
        elif message.tag == message_link.LINE_LOST:
            self._drop_line()
            self.is_line_lost = True
        elif message.tag == message_link.NEED_RIG:
            self.on_rig_needed()
        elif message.tag == message_link.KEEP:
            self.kept |= message.body
        elif message.tag == message_link.SAFE:
            self.is_safe = True
        elif message.tag == message_link.FIRST_CAUSE:
            self.reported_cause = Ending(EndCause.DEFECT, str(message.body["text"]))
        elif message.tag == message_link.READY:
            self.on_ready(message)

    def _take_line(self, message: message_link.Message) -> None:
        if not message.descriptors:
            raise message_link.ProtocolError("a line without its port")
        frame, reply, end = (bytes.fromhex(message.body[name]) for name in ("safe_frame", "safe_reply", "reply_end"))
        form = bytes.fromhex(message.body.get("form", ""))
        is_reply = re.compile(form) if form else None  # here: one that is none must not wait for the last write
        timeout_s = float(message.body.get("reply_timeout_s", REPLY_S))
        self._drop_line()
        self.safe_line = SafeLine(message.descriptors.pop(0), frame, reply, end, is_reply, timeout_s)

    def _drop_line(self) -> None:
        if self.safe_line:
            self.safe_line.close()
            self.safe_line = None
