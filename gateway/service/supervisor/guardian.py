"""The guardian: a tiny parent that outlives the control process and does the final safe-voltage write.

It starts the control process (and, when that asks for it, the simulated rig), watches the heartbeat that the control loop
itself feeds, and when the child dies or stalls it kills it, writes the safe voltage and starts it again in OFF. It alone
handles SIGINT and SIGTERM. Standard library only: start-up in milliseconds, and nothing that can fail in an interesting way.
A child may die between any two of our system calls: each is answered for, and whatever ends the guardian itself, the safe
voltage goes out first. Rejected: a thread inside the control process (dies with it), a watchdog that parses Modbus (two
owners of one truth).
"""

import contextlib
import fcntl
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, Final

from gateway.processes import exit_codes, message_link, priority
from gateway.processes.event_file import EventFile
from gateway.processes.event_log import EventLog
from gateway.processes.exit_cause import EndCause, Ending
from gateway.service.supervisor import messages as words
from gateway.service.supervisor.child_process import Child, create_shared_memory, describe_exit, reap_orphans
from gateway.service.supervisor.child_starter import ChildStarter
from gateway.service.supervisor.event_wait import SignalPipe, wait_readable
from gateway.service.supervisor.heartbeat import Heartbeat
from gateway.service.supervisor.other_children import OtherChildren
from gateway.service.supervisor.restart_policy import RestartPolicy
from gateway.service.supervisor.run_options import RunOptions
from gateway.service.supervisor.safe_line import SafeLine

_START_GRACE_S: Final = 30.0  # imports on a slow machine; nothing but the safe voltage is written before READY
_STOP_BOUND_S: Final = 5.0  # from the first signal; from the end of the line of a control process that never was ready
_DEATH_BOUND_S: Final = 2.0  # of a killed process: milliseconds, unless a driver holds it
_MOST_MESSAGES: Final = 1000  # of one wait: a child that floods its line does not keep us from the rest

_REFUSED: Final = frozenset({exit_codes.DATA, exit_codes.PERMISSION, exit_codes.CONFIGURATION})
"""Exit codes of a control process that has told the user why it can't work: another start would end the same way."""


def run(options: RunOptions) -> int:
    """Run one rig until it is told to stop; the process's exit code."""
    state = options.state_directory
    state.mkdir(parents=True, exist_ok=True, mode=0o700)
    with (state / "lock").open("a") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            words.print_error(
                f"E104 another gateway already runs on {state}; stop it, or give this one its own --state DIR"
            )
            return exit_codes.DEVICE
        priority.set_nice(priority.LOOP_NICE)
        with EventLog(source="guardian", file=EventFile(state)) as log, SignalPipe() as signals:
            starter = ChildStarter(options.rig, simulate=options.simulate, state=state, say=partial(log, "children"))
            return Guardian(options, state, starter, signals, log).watch()


@dataclass
class Guardian:
    """clock: monotonic seconds. wait: until one of these descriptors is readable, at most so long. Both are arguments for
    tests, which inject what a machine seldom does."""

    options: RunOptions
    state: Path
    starter: ChildStarter
    signals: SignalPipe
    log: EventLog
    clock: Callable[[], float] = time.monotonic
    wait: Callable[[list[int], float], set[int]] = wait_readable

    control: Child | None = None  # None: between a death and the next start
    leaving: Child | None = None  # killed and not gone yet: until then no other is started, for there are never two
    others: OtherChildren = field(init=False)
    ring: int | None = None  # memory for the sample ring, which control writes and the watch reads
    line: SafeLine | None = None
    heartbeat: Heartbeat = field(default_factory=Heartbeat)
    bound: tuple[str, int] | None = None
    said_cause: Ending | None = None  # what control gave as its own first cause
    next_start: Ending | None = None  # why control is started again, once it is
    asked_s: float = 0.0  # when control was asked for, or is to be
    stop_deadline_s: float | None = None
    stops: int = 0
    announced: bool = False
    link_ended: bool = False
    restarts: RestartPolicy = field(default_factory=RestartPolicy)

    def __post_init__(self) -> None:
        self.others = OtherChildren(self.starter, self.log, lambda answer: self._tell_control(message_link.RIG, answer))

    def watch(self) -> int:
        """Guard the rig until the end; return the exit code."""
        self.ring = create_shared_memory()
        try:
            self.starter.open()
            code = self._start_control()
            while code is None:
                code = self._step()
            return code
        finally:
            self._close()

    def _step(self) -> int | None:
        readable = self.wait(self._sources(), self._patience_s())
        if self.signals.descriptor in readable and (count := self.signals.take()):
            self._on_signal(count)
        control = self.control
        if control and not self.link_ended and control.link.fileno() in readable:
            self._on_messages(control)
            if self.link_ended and not control.pid:
                self.starter.on_not_born()
                return self._on_death(Ending(EndCause.NOT_STARTED, "control process ended before its first word"))
        if control and control.died >= 0 and control.died in readable:
            return self._on_death(Ending(EndCause.DIED, "control process died"))
        self._poll_others(readable)
        return self._on_deadline()

    def _sources(self) -> list[int]:
        sources = [self.signals.descriptor, *self.others.sources]
        if self.control:
            sources += [] if self.link_ended else [self.control.link.fileno()]
            sources += [self.control.died] if self.control.died >= 0 else []
        sources += [self.leaving.died] if self.leaving else []
        return sources

    def _patience_s(self) -> float:
        deadlines = [self._deadline_s(), self.others.due_s]
        if self.stop_deadline_s is not None:
            deadlines.append(self.stop_deadline_s)
        return max(0.0, min(deadlines) - self.clock())

    def _deadline_s(self) -> float:
        """Return when control is overdue: its heartbeat, READY, its birth; or when it is to be started."""
        if self.control is None:
            return inf if self.leaving else self.asked_s
        if self.heartbeat.is_up:
            return self.heartbeat.due_s
        return self.asked_s + (_START_GRACE_S if self.control.pid else self.starter.start_timeout_s)

    def _poll_others(self, readable: set[int]) -> None:
        if self.leaving and self.leaving.died in readable:
            self._forget_leaving()
        self.others.poll_children(readable, self.clock())

    # -- what is said to us

    def _on_signal(self, count: int) -> None:
        """The first one asks control to ramp down, where there is a line to ramp on; a second one waits for nothing."""
        self.stops += count
        is_up = self.line is not None or self.heartbeat.is_up
        self.stop_deadline_s = self.clock() + (_STOP_BOUND_S if self.stops == 1 and is_up else 0.0)
        if self.stops == 1:
            self._tell_control(message_link.STOP)

    def _on_messages(self, control: Child) -> None:
        """Drain what control has said: a burst must not make a live loop look silent."""
        try:
            for _ in range(_MOST_MESSAGES):
                message = message_link.receive(control.link)
                if message is None:
                    self._on_end_of_link()
                    return
                self._handle(control, message)
        except BlockingIOError:
            return
        except (ValueError, KeyError, TypeError, OSError) as error:
            self.said_cause = Ending(
                EndCause.NONSENSE, f"control process said {error!r}: internal error, please report it"
            )
            self.link_ended = True
            control.kill()

    def _on_end_of_link(self) -> None:
        """It is about to end: its death, or its silence, is what counts now. Before READY there is no silence yet."""
        self.link_ended = True
        self.asked_s = min(self.asked_s, self.clock() - _START_GRACE_S + _STOP_BOUND_S)

    def _handle(self, control: Child, message: message_link.Message) -> None:
        if message.tag == message_link.HEARTBEAT:
            if self.heartbeat.is_up:  # before READY the start has its own, longer patience
                self.heartbeat.record_beat(control, self.clock())
        elif message.tag == message_link.BORN:
            with contextlib.suppress(OSError):  # it has died since: the end of its line is behind this message
                control.adopt(int(message.body["pid"]))
                self.starter.on_born()
        elif message.tag == message_link.LINE:
            self._take_line(message)
        elif message.tag == message_link.NEED_RIG:
            self.others.provide_rig(self.clock())
        elif message.tag == message_link.FIRST_CAUSE:
            self.said_cause = Ending(EndCause.DEFECT, str(message.body["text"]))
        elif message.tag == message_link.READY:
            self._announce(control, message)
        message.drop_descriptors()

    def _take_line(self, message: message_link.Message) -> None:
        if not message.descriptors:
            raise message_link.ProtocolError("a line without its port")
        frame, reply = bytes.fromhex(message.body["safe_frame"]), bytes.fromhex(message.body["safe_reply"])
        self._drop_line()
        self.line = SafeLine(message.descriptors.pop(0), frame, reply)

    def _tell_control(self, tag: str, body: dict[str, Any] | None = None) -> None:
        if self.control:
            with contextlib.suppress(OSError):  # one that is gone shows as the end of its line
                message_link.send(self.control.link, tag, body)

    # -- what others need

    def _announce(self, control: Child, message: message_link.Message) -> None:
        info, banner = message.body["info"], message.body["banner"]
        self.heartbeat.stall_s = float(message.body["stall_s"])
        host, port = info["modbus"]
        self.bound = (host, port)  # a restart keeps the port that masters already know
        self.heartbeat.record_beat(control, self.clock())
        self._provide_watch(message.body["watch"])
        if self.options.json:
            words.print_ready(info | {"pids": self._pids()})
        elif not self.announced:
            words.print_ready(banner)
        self.log.note("start", f"ready: rig {self.options.rig}, modbus tcp {host}:{port}, processes {self._pids()}")
        self.announced = True
        self.restarts.came_up()

    def _pids(self) -> dict[str, int]:
        found = {"guardian": os.getpid(), "control": self.control.pid if self.control else None, **self.others.pids}
        return {name: pid for name, pid in found.items() if pid}

    def _provide_watch(self, wanted: dict[str, Any] | None) -> None:
        """wanted: what the residual watch is told, None where the rig has none."""
        if wanted is None or self.ring is None:
            return
        arguments = wanted | {"rig": self.options.rig, "state": str(self.state), "ring": self.ring}
        self.others.provide_watch(arguments, self.clock())

    # -- when control is silent or gone

    def _on_deadline(self) -> int | None:
        now_s = self.clock()
        if self.stop_deadline_s is not None:
            return self._on_death(Ending(EndCause.DIED, "stopped")) if now_s >= self.stop_deadline_s else None
        if now_s < self._deadline_s():
            return None
        if self.control is None:
            return self._start_control()
        if not self.heartbeat.is_up:
            return self._on_no_start(self.control, now_s)
        if self.heartbeat.is_overdue(now_s):
            return self._on_death(self.heartbeat.why_silent(self.control, now_s))
        return None

    def _on_no_start(self, control: Child, now_s: float) -> int | None:
        if not control.pid:  # nothing has been risked: the long way, at once, and it counts as no restart
            control.close()
            self.control = None
            self.starter.drop_server("does not answer", now_s)
            return self._start_control()
        return self._on_death(Ending(EndCause.NOT_STARTED, f"control process not ready within {_START_GRACE_S:g} s"))

    def _on_death(self, cause: Ending | Callable[[], Ending]) -> int | None:
        """Safe voltage first, questions later. cause: or how to find it, once nothing is urgent any more."""
        acknowledged = self._write_final_voltage()
        control, self.control = self.control, None
        if control is None:
            return exit_codes.OK  # told to stop while there was none
        is_gone = control.died < 0 or bool(self.wait([control.died], _DEATH_BOUND_S))
        ending = self.said_cause or (cause if isinstance(cause, Ending) else cause())
        self.heartbeat.reset()
        code = control.wait(0.0)
        if is_gone:
            control.close()
        else:
            self.leaving = control
        reap_orphans(set(self._pids().values()))
        if self.stop_deadline_s is not None:
            self.log.note("stop", f"stopped as asked: safe voltage {words.describe_acknowledgement(acknowledged)}")
            return exit_codes.OK
        if code in _REFUSED or (code == exit_codes.DEVICE and not self.announced):
            return code  # it told the user why
        return self._restart(ending, describe_exit(code) if is_gone else "it does not go", acknowledged)

    def _write_final_voltage(self) -> bool | None:
        """Kill control and write the safe voltage through the newest line that it has handed over.

        Return whether the device acknowledged it; None where there was no line.
        """
        if self.control:
            self.control.kill()
            if not self.link_ended:
                self._on_messages(self.control)
        acknowledged = self.line.write_safe() if self.line else None
        self._drop_line()  # our copy of the descriptor carries the port's lock, which the next control process needs
        return acknowledged

    def _restart(self, ending: Ending, how: str, acknowledged: bool | None) -> int | None:
        now_s = self.clock()
        self.log("restart", words.restart_sentence(ending, how, acknowledged))
        pause_s = self.restarts.count(now_s, ending.cause)
        if pause_s is None:
            self.log("restart", words.too_many_sentence(self.restarts.causes))
            return exit_codes.FAILED
        self.next_start, self.asked_s = ending, now_s + pause_s
        if self.leaving:
            self.log("restart", words.leaving_sentence(self.leaving.pid))
            return None
        return self._start_control() if pause_s == 0.0 else None

    def _forget_leaving(self) -> None:
        if self.leaving:
            self.leaving.wait(0.0)
            self.leaving.close()
            self.leaving = None

    def _start_control(self) -> int | None:
        self.said_cause, self.link_ended, self.asked_s = None, False, self.clock()
        try:
            self.control = self.starter.control(
                {
                    "rig": self.options.rig,
                    "simulate": self.options.simulate,
                    "bind": self.bound or self.options.bind,
                    "state": str(self.state),
                    "record": self.options.record,
                    "realtime": self.options.realtime,
                    "restarted": self.next_start.to_json() if self.next_start else None,
                    "ring": self.ring,
                }
            )
        except OSError as error:
            text = f"control process not started: {error.strerror or error}"
            return self._restart(Ending(EndCause.NOT_STARTED, text), "no process", None)
        return None

    def _close(self) -> None:
        """Whatever ends us, the safe voltage goes first: control would die of the signal without a word."""
        self._write_final_voltage()
        if self.control:
            self.control.end()
        self.others.end()
        self._forget_leaving()
        if self.ring is not None:
            os.close(self.ring)

    def _drop_line(self) -> None:
        if self.line:
            self.line.close()
            self.line = None
