"""What of control and guardian reaches for the kernel, replaced: disk, clock, ports, counters, the last write."""

import asyncio
import errno
import os
import re
from collections import deque
from collections.abc import Callable
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any, ClassVar
from weakref import WeakKeyDictionary, WeakSet

import pytest

from gateway.recording import Recorder
from gateway.service.running_rig.running_rig import RunningRig
from tests.disk.at_once import AtOnce
from tests.disk.failing_disks import FailingDisk
from tests.disk.watched_disk import watching
from tests.simulation.kernel.cables import CABLES, SimulatedPort
from tests.simulation.kernel.network import MemoryListener
from tests.simulation.kernel.virtual_time import VirtualClock

TWIN_STEP_S = 10e-3
"""The period of the fastest loop. At its own step of 1 ms the twin takes a third of the processor's time."""
DISK_S = (0.001, 0.08)
DONE_AT_ONCE_S = 0.04
MOST_CALLS = 16
CHOSEN = re.compile(r"\d")
HOST = re.compile(r"10\.0\.0\.\d+|serial:\d+")
"""The lines of each cause are limited, so it may name a client, and no number of what that has written."""
_RIG = "gateway.service.running_rig.running_rig"
_SUPERVISOR = "gateway.service.supervisor"


class SimulatedDisk:
    """Stands for `DiskWorker`: one thing after the other, which takes as long as the chance of the schedule says. Half of the
    time it is done as it begins, else as it ends: where the process is killed in between it has happened, or not at all.
    fails: how, of FailingDisk.KINDS, "": it does not. is_hung: nothing is done, until somebody lets it `go_on`. is_gone: the
    schedule is over."""

    delay_s: Callable[[], float] = staticmethod(lambda: 0.005)
    fails = ""
    is_gone = is_hung = False
    folder = Path()
    hung: ClassVar[WeakKeyDictionary["SimulatedDisk", None]] = WeakKeyDictionary()
    working: ClassVar[WeakKeyDictionary["SimulatedDisk", None]] = WeakKeyDictionary()
    """In the order in which they began, which is the same in each run; that of a set is not."""
    chance: ClassVar[Random] = Random(0)

    def __init__(self) -> None:
        self._free_s = 0.0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._waiting: deque[tuple[Callable[[], Any], bool]] = deque()  # and whether somebody wants the result
        self._results: deque[Any] = deque()
        self._held: deque[tuple[asyncio.AbstractEventLoop, Callable[[Any], None]]] = deque()

    def __call__(self, work: Callable[[], Any], done: Callable[[Any], None]) -> None:
        loop, delay_s = asyncio.get_running_loop(), type(self).delay_s()
        self._free_s = max(self._free_s, loop.time()) + delay_s
        self._loop = loop
        self.working[self] = None
        self._waiting.append((work, True))
        if delay_s < DONE_AT_ONCE_S:
            self._work_off()
        loop.call_at(self._free_s, self._tell, loop, done)

    def begin(self, work: Callable[[], Any]) -> None:
        self._waiting.append((work, False))
        self._work_off()

    def close(self) -> None:
        self._work_off()

    @classmethod
    def go_on(cls) -> None:
        """End what hung: what waits is done now, as far as whoever asked for it still lives."""
        cls.is_hung = False
        for disk in tuple(cls.hung):
            held = tuple(disk._held)
            disk._held.clear()
            for loop, done in held:
                loop.call_at(loop.time(), disk._tell, loop, done)
        cls.hung.clear()

    def _tell(self, loop: asyncio.AbstractEventLoop, done: Callable[[Any], None]) -> None:
        if not self._results:
            self._work_off()
        if self._results:
            done(self._results.popleft())
        else:
            self._held.append((loop, done))
            self.hung[self] = None

    def _work_off(self) -> None:
        while self._waiting and not type(self).is_hung:
            work, is_wanted = self._waiting.popleft()
            result = self._result(work)
            if is_wanted:
                self._results.append(result)

    @classmethod
    def kill(cls, loop: asyncio.AbstractEventLoop) -> None:
        """The process of this loop is killed: of the calls that its work is made of the first have been made, up to any."""
        for disk in tuple(cls.working):
            if disk._loop is loop and disk._waiting and not cls.is_hung and not cls.fails:
                work, _ = disk._waiting.popleft()
                disk._waiting.clear()
                with suppress(Exception), watching(FailingDisk(cls.folder, "broken", cls.chance.randrange(MOST_CALLS))):
                    work()

    @classmethod
    def do(cls, work: Callable[[], Any]) -> Any:
        """Do this now, as the disk is."""
        with watching(FailingDisk(cls.folder, cls.fails, 0)) if cls.fails else nullcontext():
            return work()

    def _result(self, work: Callable[[], Any]) -> Any:
        if type(self).is_gone:
            return OSError(errno.EIO, os.strerror(errno.EIO))
        try:
            return self.do(work)
        except Exception as error:
            return error


class SimulatedTick:
    """Stands for `ClockTick`: on time by the loop's clock; after a stall it tells how many were missed."""

    is_fallback = False

    def __init__(self, period_s: float, on_tick: Callable[[int, float], None]) -> None:
        self.period_s, self._on_tick = period_s, on_tick
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._due_s = self._loop.time() + self.period_s
        self._timer = self._loop.call_at(self._due_s, self._fire)

    def follow(self, arrival_s: float | None) -> None:
        """Here a wake-up costs nothing."""

    def close(self) -> None:
        if self._timer:
            self._timer.cancel()

    def _fire(self) -> None:
        late_s = self._loop.time() - self._due_s
        expirations = 1 + int(late_s / self.period_s + 1e-9)
        self._due_s += expirations * self.period_s
        self._timer = self._loop.call_at(self._due_s, self._fire)
        self._on_tick(expirations, max(0.0, late_s - (expirations - 1) * self.period_s))


class NoCounters:
    """Stands for `SchedulerCounters`: a machine that is never busy."""

    def __init__(self, pid: int) -> None: ...

    def read(self) -> None:
        return None

    def waited_s(self) -> float:
        return 0.0

    def close(self) -> None: ...


class NothingWithheld:
    """Stands for `WithheldTime`: a machine from which nothing is withheld."""

    def note(self, now_s: float) -> None: ...

    def lately(self) -> tuple[float, str]:
        return 0.0, ""


@dataclass(frozen=True)
class SimulatedSafeLine:
    """Stands for `SafeLine`: the guardian's last write goes out behind what is on the wire; who is plugged in answers."""

    descriptor: int
    frame: bytes
    reply: bytes
    end: bytes
    form: object = None
    reply_timeout_s: float = 0.1
    hears_itself: bool = False

    def close(self) -> None:
        os.close(self.descriptor)

    def write_safe(self) -> bool:
        output = CABLES["output"]
        if output.is_plugged:
            output.send_to_device(self.frame)
        return output.is_plugged


class Log:
    """Stands for `EventLog`: keeps what was said last, every internal error, and each cause whose lines are limited by
    nothing (I12). on_zero(now): control has said that it took a zero."""

    on_zero: Callable[[float], None] = staticmethod(lambda now_s: None)

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self.lines: deque[tuple[float, str]] = deque(maxlen=1000)
        self.internal_errors: list[str] = []
        self._causes: set[str] = set()

    def __call__(self, cause: str, sentence: str) -> None:
        self.lines.append((self._clock.now_s, sentence))
        if cause not in self._causes:
            self._causes.add(cause)
            if CHOSEN.search(HOST.sub("", cause)):
                self.internal_errors.append(
                    f"I12 at {self._clock.now_s:.4f}: {cause!r} is a cause of its own: {sentence}"
                )
        if sentence.startswith("tare: zero at"):
            self.on_zero(self._clock.now_s)
        if "A499" in sentence:
            self.internal_errors.append(f"internal: {sentence}")

    def speaking_for(self, source: str) -> Callable[[str, str], None]:
        return self

    note = __call__


async def _explain(line: Any, path: str, safe_v: float) -> str:
    return f"E111 {path}: silent"


class NotedRunningRig(RunningRig):
    """Control's own, and known here. of: those of this simulation, in their order; closing: tasks that close one already:
    where one is killed meanwhile the kernel closes the rest, here it does so itself."""

    of: ClassVar[list["NotedRunningRig"]] = []
    closing: ClassVar[WeakSet[asyncio.Task[Any]]] = WeakSet()

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.of.append(self)

    async def close(self) -> None:
        if task := asyncio.current_task():
            self.closing.add(task)
        await super().close()


class NotedRecorder(Recorder):
    """Control's own, and known here: the kernel closes the file of a process that is dead, and here whoever ends it."""

    of: ClassVar[list["NotedRecorder"]] = []

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.of.append(self)

    def _release(self) -> None:
        super()._release()
        if self in self.of:  # in a week there are many
            self.of.remove(self)

    @classmethod
    def close_all(cls) -> None:
        for recorder in tuple(cls.of):
            recorder._release()


def _no_fit(*_: Any) -> None:
    raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))


@contextmanager
def simulated_edges(fit: Any = _no_fit) -> Any:
    """Everything that reaches for the kernel, replaced. fit: what stands for `FitLauncher`."""
    with pytest.MonkeyPatch.context() as patch:
        for maker in ("calibration_runs", "recording.recordings"):
            patch.setattr(f"gateway.service.running_rig.{maker}.Recorder", NotedRecorder)
        patch.setattr("gateway.twin.simulation.STEP_S", TWIN_STEP_S)
        patch.setattr("gateway.service.running_rig.lines.rig_ports.SerialPort", SimulatedPort)
        patch.setattr("gateway.fieldbus.rtu_server.SerialPort", SimulatedPort)
        patch.setattr(f"{_RIG}.ClockTick", SimulatedTick)
        patch.setattr("gateway.service.control_process.RunningRig", NotedRunningRig)
        patch.setattr("gateway.fieldbus.tcp_server.Listener", MemoryListener)
        NotedRunningRig.of.clear()
        patch.setattr(f"{_RIG}.SchedulerCounters", NoCounters)
        for user in (_RIG, f"{_SUPERVISOR}.heartbeat"):
            patch.setattr(f"{user}.WithheldTime", NothingWithheld)
        for user in (
            _RIG,
            "gateway.live.standstill",
        ):  # no machine that is suspended, and six clocks fewer at each tick
            patch.setattr(f"{user}.suspended_s", lambda: 0.0)
        patch.setattr("gateway.service.running_rig.starting.explain_silent_device", _explain)
        patch.setattr("gateway.service.running_rig.calibration_runs.FitLauncher", fit)
        for user in (
            "gateway.calibrations.upload",
            "gateway.service.running_rig.rig_plants",
            "gateway.audit.audit_log",
            "gateway.service.running_rig.recording.retention",
            "gateway.service.running_rig.calibration_runs",
            "gateway.service.running_rig.recording.recordings",
        ):
            patch.setattr(f"{user}.DiskWorker", SimulatedDisk)
        patch.setattr("gateway.processes.json_socket.server.DiskWorker", AtOnce)
        collector = SimpleNamespace(collect=lambda: None, freeze=lambda: None)
        patch.setattr("gateway.service.control_process.gc", collector)
        patch.setattr(f"{_SUPERVISOR}.control_child.SafeLine", SimulatedSafeLine)
        patch.setattr(f"{_SUPERVISOR}.heartbeat.load_of_machine", lambda: "a machine without load")
        patch.setattr(f"{_SUPERVISOR}.guardian.reap_orphans", lambda known: None)
        patch.setattr(f"{_SUPERVISOR}.guardian.words.print_ready", lambda what: None)
        yield
