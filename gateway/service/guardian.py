"""The guardian: a tiny parent that outlives the control process and has the last word on the wire.

It starts the control process (and, when that asks for it, the simulated rig), watches the heartbeat that the control loop
itself feeds, and when the child dies or stalls it kills it, writes the safe voltage and starts it again in OFF. It alone
handles SIGINT and SIGTERM. Standard library only: start-up in milliseconds, and nothing that can fail in an interesting way.
Rejected: a thread inside the control process (dies with it), a watchdog that parses Modbus (two owners of one truth).
"""

import contextlib
import fcntl
import json
import os
import select
import signal
import socket
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gateway.service import link
from gateway.service.children import Child, shared_memory, spawn_control, spawn_rig, spawn_watch
from gateway.service.event_file import EventFile
from gateway.service.event_log import EventLog
from gateway.service.safe_line import SafeLine
from gateway.service.watch_keeper import WatchKeeper

_START_GRACE_S = 30.0  # imports on a slow machine; nothing but the safe voltage is written before READY
_STOP_BOUND_S = 5.0
_STARVED_S = 0.02
_RESTARTS = 5
_RESTART_WINDOW_S = 60.0

EXIT_OK, EXIT_FAILED, EXIT_DEVICE = 0, 1, 69


@dataclass(frozen=True)
class RunOptions:
    """What `force-gateway run` was asked for. state None: $XDG_STATE_HOME/force-gateway/RIG."""

    rig: str = "demo"
    simulate: bool = False
    bind: tuple[str, int] | None = None
    state: Path | None = None
    json: bool = False
    record: bool = False
    realtime: bool = False

    @property
    def state_directory(self) -> Path:
        if self.state is not None:
            return self.state
        return default_state_root() / Path(self.rig).stem


def default_state_root() -> Path:
    """Where the state directories of rigs are that were given none."""
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "force-gateway"


def run(options: RunOptions) -> int:
    """Run one rig until it is told to stop; the process's exit code."""
    state = options.state_directory
    state.mkdir(parents=True, exist_ok=True, mode=0o700)
    with (state / "lock").open("a") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print(
                f"E104 another gateway already runs on {state}; stop it, or give this one its own --state DIR",
                file=sys.stderr,
            )
            return EXIT_DEVICE
        with EventLog(source="guardian", file=EventFile(state)) as log:
            return Guardian(options, state, log).watch()


@dataclass
class Guardian:
    options: RunOptions
    state: Path
    log: EventLog
    control: Child | None = None
    rig: Child | None = None
    watch_keeper: WatchKeeper | None = None
    ring: int | None = None  # memory for the sample ring, which control writes and the watch reads
    line: SafeLine | None = None
    stall_s: float = 0.1
    bound: tuple[str, int] | None = None
    first_cause: str = ""
    last_beat_s: float | None = None  # None until READY
    started_s: float = 0.0
    stop_deadline_s: float | None = None
    signals: int = 0
    announced: bool = False
    link_ended: bool = False
    starved: bool = False
    restarts_s: list[float] = field(default_factory=list)
    ptys: dict[str, Any] = field(default_factory=dict)

    def watch(self) -> int:
        wake = _signal_pipe()
        self.ring = shared_memory()
        try:
            self._start_control(restarted="")
            while True:
                code = self._step(wake)
                if code is not None:
                    return code
        finally:
            self._close()
            _forget_signal_pipe(wake)

    def _step(self, wake: socket.socket) -> int | None:
        assert self.control
        sources: list[Any] = [self.control.died, wake, *([] if self.link_ended else [self.control.link])]
        sources += self.watch_keeper.sources if self.watch_keeper else []
        readable, _, _ = select.select(sources, [], [], self._patience_s())
        if wake in readable:
            self._on_signal(wake.recv(64))
        if self.control.link in readable:
            self._on_message()
        if self.control.died in readable:
            return self._on_death("died")
        if self.watch_keeper:
            self.watch_keeper.follow(readable, time.monotonic())
        return self._on_silence()

    def _patience_s(self) -> float:
        now_s = time.monotonic()
        deadlines = [self._beat_deadline_s()]
        if self.stop_deadline_s is not None:
            deadlines.append(self.stop_deadline_s)
        if self.watch_keeper:
            deadlines.append(self.watch_keeper.due_s)
        return max(0.0, min(deadlines) - now_s)

    def _beat_deadline_s(self) -> float:
        if self.last_beat_s is None:
            return self.started_s + _START_GRACE_S
        return self.last_beat_s + self.stall_s

    def _on_signal(self, numbers: bytes) -> None:
        assert self.control
        self.signals += len(numbers)
        self.stop_deadline_s = time.monotonic() + (_STOP_BOUND_S if self.signals == 1 else 0.0)
        if self.signals == 1:
            with contextlib.suppress(OSError):
                link.send(self.control.link, link.STOP)

    def _on_message(self) -> None:
        """Drain what control has said: a burst must not make a live loop look silent."""
        assert self.control
        while select.select([self.control.link], [], [], 0)[0]:
            message = link.receive(self.control.link)
            if message is None:  # it is about to end: its death, or its silence, is what counts now
                self.link_ended = True
                return
            self._handle(message)

    def _handle(self, message: link.Message) -> None:
        if message.tag == link.HEARTBEAT:
            if self.last_beat_s is not None:  # before READY the start has its own, longer patience
                self.last_beat_s, self.starved = time.monotonic(), False
        elif message.tag == link.LINE:
            self._drop_line()
            frame, reply = bytes.fromhex(message.body["safe_frame"]), bytes.fromhex(message.body["safe_reply"])
            self.line = SafeLine(message.descriptors[0], frame, reply)
        elif message.tag == link.NEED_RIG:
            self._provide_rig(str(message.body["rig"]))
        elif message.tag == link.FIRST_CAUSE:
            self.first_cause = str(message.body["cause"])
        elif message.tag == link.READY:
            self._announce(message)

    def _provide_rig(self, rig: str) -> None:
        assert self.control
        if self.rig is None:
            self.rig = spawn_rig(rig, self.state)
            answer = self.rig.first_line()
            self.ptys = json.loads(answer) if answer else {"failed": self.rig.wait()}
        link.send(self.control.link, link.RIG, self.ptys)

    def _announce(self, message: link.Message) -> None:
        assert self.control
        self.last_beat_s = time.monotonic()
        self.stall_s = float(message.body["stall_s"])
        host, port = message.body["info"]["modbus"]
        self.bound = (host, port)  # a restart keeps the port that masters already know
        self._provide_watch(message.body["watch"])
        pids = {"guardian": os.getpid(), "control": self.control.pid} | ({"rig": self.rig.pid} if self.rig else {})
        pids |= {"watch": self.watch_keeper.pid} if self.watch_keeper and self.watch_keeper.pid else {}
        if self.options.json:
            print(json.dumps(message.body["info"] | {"pids": pids}), flush=True)
        elif not self.announced:
            print(message.body["banner"], flush=True)
        self.log.note("start", f"ready: rig {self.options.rig}, modbus tcp {host}:{port}, processes {pids}")
        self.announced = True

    def _provide_watch(self, wanted: dict[str, Any] | None) -> None:
        """wanted: what the residual watch is told, None where the rig has none."""
        if wanted is None or self.ring is None:
            return
        if self.watch_keeper is None:
            arguments = wanted | {"rig": self.options.rig, "state": str(self.state), "ring": self.ring}
            self.watch_keeper = WatchKeeper(
                lambda: spawn_watch(arguments), lambda sentence: self.log("watch", sentence)
            )
        self.watch_keeper.start(time.monotonic())

    def _on_silence(self) -> int | None:
        assert self.control
        now_s = time.monotonic()
        if self.stop_deadline_s is not None and now_s >= self.stop_deadline_s:
            self.control.kill()
            return self._on_death("did not stop in time")
        late_s = now_s - self._beat_deadline_s()
        if late_s >= 0.0 and self.stop_deadline_s is None:
            if late_s > _STARVED_S and self.last_beat_s is not None and not self.starved:
                self.starved = True  # we woke late ourselves: the machine stood still, the child gets one more chance
                self.last_beat_s = now_s - self.stall_s + _STARVED_S
                return None
            self.control.kill()
            return self._on_death("stalled")
        return None

    def _on_death(self, how: str) -> int | None:
        """Safe voltage first, questions later."""
        assert self.control
        acknowledged = self.line.write_safe() if self.line else None
        self._drop_line()  # our copy of the descriptor carries the port's lock, which the next control process needs
        code = self.control.wait()
        if self.stop_deadline_s is not None:
            self.log.note("stop", f"stopped as asked: safe voltage {_wire(acknowledged)}")
            return EXIT_OK
        if not self.announced and code > 0:
            return code  # it told the user why: configuration, device, permission
        return self._restart(how, code, acknowledged)

    def _restart(self, how: str, code: int, acknowledged: bool | None) -> int | None:
        now_s = time.monotonic()
        self.restarts_s = [at_s for at_s in self.restarts_s if now_s - at_s < _RESTART_WINDOW_S] + [now_s]
        cause = self.first_cause or f"control process {how} ({_exit_word(code)})"
        self.log("restart", f"A401 {cause}: safe voltage {_wire(acknowledged)}")
        if len(self.restarts_s) > _RESTARTS:
            self.log("restart", "A402 five restarts in 60 s: the safe voltage is held, the gateway stops")
            return EXIT_FAILED
        self._start_control(restarted=cause)
        return None

    def _start_control(self, restarted: str) -> None:
        if self.control:
            self.control.close()
        self.last_beat_s, self.started_s, self.first_cause, self.link_ended = None, time.monotonic(), "", False
        self.control = spawn_control(
            {
                "rig": self.options.rig,
                "simulate": self.options.simulate,
                "bind": self.bound or self.options.bind,
                "state": str(self.state),
                "record": self.options.record,
                "realtime": self.options.realtime,
                "restarted": restarted,
                "ring": self.ring,
            }
        )

    def _close(self) -> None:
        for child in (self.control, self.rig, self.watch_keeper):
            if child:
                child.end()
        self._drop_line()
        if self.ring is not None:
            os.close(self.ring)

    def _drop_line(self) -> None:
        if self.line:
            self.line.close()
            self.line = None


def _wire(acknowledged: bool | None) -> str:
    return {True: "acknowledged", False: "written, not acknowledged", None: "no line was open"}[acknowledged]


def _exit_word(code: int) -> str:
    if code < 0:
        return signal.Signals(-code).name
    return f"exit {code}"


_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def _signal_pipe() -> socket.socket:
    """Signals as readable bytes: nothing of ours runs inside a signal handler."""
    reader, writer = socket.socketpair()
    for end in (reader, writer):
        end.setblocking(False)
    for number in _SIGNALS:
        signal.signal(number, lambda *_: None)
    signal.set_wakeup_fd(writer.detach(), warn_on_full_buffer=False)
    return reader


def _forget_signal_pipe(reader: socket.socket) -> None:
    os.close(signal.set_wakeup_fd(-1))
    for number in _SIGNALS:
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    reader.close()
