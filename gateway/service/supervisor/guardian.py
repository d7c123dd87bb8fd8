"""The guardian: a tiny parent that outlives the control process and does the final safe-voltage write.

It starts the control process (and, when that asks for it, the simulated rig), watches the heartbeat that the control loop
itself feeds, and when the child dies or stalls it kills it, writes the safe voltage and starts it again in OFF. It alone
handles SIGINT and SIGTERM. Standard library only: start-up in milliseconds, and nothing that can fail in an interesting way.
A child may die between any two of our system calls: each is answered for, and whatever ends the guardian itself, the safe
voltage goes out first. Rejected: a thread inside the control process (dies with it), a watchdog that parses Modbus (two
owners of one truth).
"""

import contextlib
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, Final

from gateway.processes import exit_codes, message_link
from gateway.processes.durable_file import give_all_to_owner, make_path
from gateway.processes.event_file import EventFile
from gateway.processes.event_log import EventLog
from gateway.processes.exit_cause import EndCause, Ending
from gateway.processes.scheduling import priority
from gateway.processes.state_directory import put_back
from gateway.processes.state_lock import hold_state_lock
from gateway.processes.systemd.service_manager import ServiceManager, service_manager
from gateway.service.clean_shutdown_marker import CleanShutdownMarker
from gateway.service.heartbeat_memory import HeartbeatMemory
from gateway.service.supervisor import guardian_sentences as words
from gateway.service.supervisor.child_process import Child, create_shared_memory, describe_exit, reap_orphans
from gateway.service.supervisor.child_starter import ChildStarter
from gateway.service.supervisor.control_child import START_GRACE_S, STOP_BOUND_S, ControlChild
from gateway.service.supervisor.descriptor_limit import raise_descriptor_limit
from gateway.service.supervisor.event_wait import SignalPipe, wait_readable
from gateway.service.supervisor.other_children import OtherChildren
from gateway.service.supervisor.restart_policy import RestartPolicy
from gateway.service.supervisor.run_options import RunOptions

_DEATH_BOUND_S: Final = 2.0  # of a killed process: milliseconds, unless a driver holds it

_REFUSED: Final = frozenset({exit_codes.DATA, exit_codes.PERMISSION, exit_codes.CONFIGURATION})
"""Exit codes of a control process that has told the user why it can't work: another start would end the same way."""


def run(options: RunOptions) -> int:
    """Run one rig until it is told to stop; the process's exit code."""
    state = options.state_directory
    found = ""
    with contextlib.suppress(OSError):  # a disk that syncs no name is no reason not to control
        found = put_back(state)
        make_path(state)
    state.mkdir(parents=True, exist_ok=True, mode=0o700)
    with hold_state_lock(state) as is_ours:
        if not is_ours:
            words.print_error(
                f"E104 another gateway already runs on {state} (or a command is changing it at this moment: then try again); "
                "stop it, or give this one its own --state DIR"
            )
            return exit_codes.DEVICE
        priority.set_nice(priority.LOOP_NICE)
        too_few = raise_descriptor_limit()
        try:
            with EventLog(source="guardian", file=EventFile(state)) as log, SignalPipe() as signals:
                for cause, said in (("limit", too_few), ("start", found)):
                    if said:
                        log(cause, said)
                starter = ChildStarter(
                    options.rig, simulate=options.simulate, state=state, say=partial(log, "children")
                )
                return Guardian(options, state, starter, signals, log, manager=service_manager()).watch()
        finally:
            # behind root, who has tried its rig by hand, a service could store nothing any more
            give_all_to_owner(state)


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
    manager: ServiceManager = field(default_factory=ServiceManager)

    control: ControlChild = field(init=False)
    leaving: Child | None = None  # killed and not gone yet: until then no other is started, for there are never two
    others: OtherChildren = field(init=False)
    beat: int | None = None  # memory where the control loop beats
    ring: int | None = None  # memory for the sample ring, which control writes and others read
    listeners: dict[str, tuple[int, list[Any]]] = field(default_factory=dict)  # by child: descriptor, [host, port]
    bound: tuple[str, int] | None = None
    next_start: Ending | None = None  # why control is started again, once it is
    stop_deadline_s: float | None = None
    stops: int = 0
    announced: bool = False
    restarts: RestartPolicy = field(default_factory=RestartPolicy)

    def __post_init__(self) -> None:
        self.others = OtherChildren(self.starter, self.log, lambda answer: self.control.tell(message_link.RIG, answer))
        self.control = ControlChild(
            self.starter, self.clock, self._announce, lambda: self.others.provide_rig(self.clock())
        )

    def watch(self) -> int:
        """Guard the rig until the end; return the exit code."""
        self.share_memory()
        try:
            self.starter.open()
            code = self._start_control()
            while code is None:
                code = self._step()
            return code
        finally:
            self._close()

    def share_memory(self) -> None:
        """Make what control writes for us and for other processes; without it each beat is a message."""
        self.ring, self.beat = create_shared_memory(), create_shared_memory()
        with contextlib.suppress(OSError):
            self.control.memory = None if self.beat is None else HeartbeatMemory(self.beat)

    def _step(self) -> int | None:
        readable = self.wait(self._sources(), self._patience_s())
        if count := self.signals.take():  # also one that came behind the look: who was told with us may be in it, dead
            self._on_signal(count)
        control = self.control
        if control.has_spoken(readable):
            control.read_messages()
            if control.is_link_ended and not (control.process and control.process.pid):
                self.starter.on_not_born()
                return self._on_death(Ending(EndCause.NOT_STARTED, "control process ended before its first word"))
        if control.has_died(readable):
            return self._on_death(Ending(EndCause.DIED, "control process died"))
        self._poll_others(readable)
        return self._on_deadline()

    def _sources(self) -> list[int]:
        leaving = [self.leaving.died] if self.leaving else []
        return [self.signals.descriptor, *self.others.sources, *self.control.sources, *leaving]

    def _patience_s(self) -> float:
        deadlines = [self._deadline_s(), self.others.due_s]
        if self.stop_deadline_s is not None:
            deadlines.append(self.stop_deadline_s)
        return max(0.0, min(min(deadlines) - self.clock(), self.manager.feed_every_s))

    def _deadline_s(self) -> float:
        """Return when control is overdue, or to be started; never while a killed one is still there. Once we are told to stop
        nothing is started, and the loop beats until the safe voltage has gone out."""
        control = self.control
        if self.stop_deadline_s is not None:
            return control.due_s if control.heartbeat.is_up and not control.is_safe else inf
        return inf if self.leaving and control.process is None else control.due_s

    def _poll_others(self, readable: set[int]) -> None:
        if self.leaving and self.leaving.died in readable:
            self._forget_leaving()
        self.others.poll_children(readable, self.clock())

    # -- what is said to us

    def _on_signal(self, count: int) -> None:
        """The first one asks control to ramp down, where there is a line to ramp on; a second one waits for nothing."""
        self.stops += count
        self.others.is_stopping = True
        is_up = self.control.safe_line is not None or self.control.heartbeat.is_up
        self.stop_deadline_s = self.clock() + (STOP_BOUND_S if self.stops == 1 and is_up else 0.0)
        self.manager.stopping()
        if self.stops == 1:
            self.control.tell(message_link.STOP)

    def _announce(self, message: message_link.Message) -> None:
        info, banner = message.body["info"], message.body["banner"]
        heartbeat = self.control.heartbeat
        stall_s = float(message.body["stall_s"])
        if not 0.0 < stall_s < inf:  # nan too: nothing would ever be overdue
            raise ValueError(f"stall_s {stall_s}")
        heartbeat.stall_s = stall_s
        where = "plain modbus tcp is not served"
        if info["modbus"]:
            host, port = info["modbus"]
            self.bound = (host, port)  # a restart keeps the port that masters already know
            where = f"modbus tcp {host}:{port}"
        if self.control.process:
            heartbeat.record_beat(self.control.process, self.clock())
        self._take_listeners(message)
        self._provide_optional(message.body["optional"])
        if self.options.json:
            words.print_ready(info | {"pids": self._pids()})
        elif not self.announced:
            words.print_ready(banner)
        self.log.note("start", words.ready_sentence(self.options.rig, where, self._pids()))
        self.manager.ready(f"rig {self.options.rig}, {where}")
        self.announced = True
        self.restarts.came_up()

    def _pids(self) -> dict[str, int]:
        control = self.control.process
        pids = {"guardian": os.getpid(), "control": control.pid if control else None, **self.others.pids}
        return {name: pid for name, pid in pids.items() if pid}

    def _take_listeners(self, message: message_link.Message) -> None:
        """Keep the listening sockets that control has bound: they outlive a restart of control, and of who serves on them."""
        for name, address in message.body.get("listening", {}).items():
            if name not in self.listeners and message.descriptors:
                self.listeners[name] = (message.descriptors.pop(0), address)

    def _provide_optional(self, wanted: dict[str, dict[str, Any]]) -> None:
        """wanted: what each child that control can do without is told, by its name."""
        for name, options in wanted.items():
            listen, _ = self.listeners.get(name, (None, None))
            shared = {"rig": self.options.rig, "state": str(self.state), "ring": self.ring, "listen": listen}
            self.others.provide_optional(name, options | shared, self.clock())

    # -- when control is silent or gone

    def _on_deadline(self) -> int | None:
        self.control.hear_beat()
        self.manager.feed(self.control.heartbeat.heard_s)
        now_s = self.clock()
        if self.stop_deadline_s is not None and now_s >= self.stop_deadline_s:
            return self._on_death(Ending(EndCause.DIED, "control was not waited for any longer"))
        if now_s < self._deadline_s():
            return None
        process, heartbeat = self.control.process, self.control.heartbeat
        if process is None:
            return self._start_control()
        if not heartbeat.is_up:
            return self._on_no_start(process, now_s)
        if heartbeat.is_overdue(now_s):
            return self._on_death(heartbeat.why_silent(process, now_s))
        return None

    def _on_no_start(self, control: Child, now_s: float) -> int | None:
        if not control.pid:  # nothing has been risked: the long way, at once, and it counts as no restart
            control.close()
            self.control.process = None
            self.starter.drop_server("does not answer", now_s)
            return self._start_control()
        return self._on_death(Ending(EndCause.NOT_STARTED, f"control process not ready within {START_GRACE_S:g} s"))

    def _on_death(self, cause: Ending | Callable[[], Ending]) -> int | None:
        """Safe voltage first, questions later. cause: or how to find it, once nothing is urgent any more."""
        acknowledged = self.control.write_safe_voltage()
        control, self.control.process = self.control.process, None
        if control is None:
            return exit_codes.OK  # told to stop while there was none
        is_gone = control.died < 0 or bool(self.wait([control.died], _DEATH_BOUND_S))
        ending = self.control.reported_cause or (cause if isinstance(cause, Ending) else cause())
        self.control.heartbeat.reset()
        code = control.wait(0.0)
        if is_gone:
            control.close()
        else:
            self.leaving = control
        reap_orphans(set(self._pids().values()))
        if self.stop_deadline_s is not None:
            say = self.log if acknowledged is False else self.log.note  # else the terminal shows as much already
            say("stop", words.stop_sentence(acknowledged, None if code == exit_codes.OK else ending))
            return exit_codes.OK
        if code in _REFUSED or (code == exit_codes.DEVICE and not self.announced):
            return code  # it told the user why
        return self._restart(ending, describe_exit(code) if is_gone else "it does not go", acknowledged)

    def _restart(self, ending: Ending, how: str, acknowledged: bool | None) -> int | None:
        now_s = self.clock()
        self.log("restart", words.restart_sentence(ending, how, acknowledged))
        pause_s = self.restarts.count(now_s, ending.cause)
        if pause_s is None:
            self.log("restart", words.too_many_sentence(self.restarts.causes, acknowledged))
            return exit_codes.FAILED
        self.next_start, self.control.asked_s = ending, now_s + pause_s
        self.manager.starting(f"control is started again: {ending.text}", pause_s + 2.0 * START_GRACE_S)
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
        try:
            self.control.start(
                {
                    "rig": self.options.rig,
                    "simulate": self.options.simulate,
                    "bind": self.bound or self.options.bind,
                    "rtu": self.options.rtu,
                    "state": str(self.state),
                    "record": self.options.record,
                    "kept": dict(self.control.kept),
                    "realtime": self.options.realtime,
                    "restarted": self.next_start.to_json() if self.next_start else None,
                    "ring": self.ring,
                    "beat": self.beat if self.control.memory else None,
                    "web": self.options.web,
                    "metrics": self.options.metrics,
                    "listening": {name: address for name, (_, address) in self.listeners.items()},
                }
            )
        except OSError as error:
            text = f"control process not started: {words.tell_no_process(error)}"
            return self._restart(Ending(EndCause.NOT_STARTED, text), "no process", None)
        return None

    def _close(self) -> None:
        """Whatever ends us, the safe voltage goes first: control would die of the signal without a word."""
        self.control.write_safe_voltage()
        if self.control.process:
            self.control.process.end()
        self.others.end()
        self._forget_leaving()
        if self.control.memory:
            self.control.memory.close()
        shared = [memory for memory in (self.ring, self.beat) if memory is not None]
        for descriptor in (*shared, *(listening for listening, _ in self.listeners.values())):
            os.close(descriptor)
        CleanShutdownMarker(self.state).leave(self.control.kept)  # last: a disk may hang
