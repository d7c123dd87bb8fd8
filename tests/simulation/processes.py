"""The control process and its guardian in virtual time. Control is the real one (`RunningRig` with its bank, loop, lines,
faces, stores); the guardian is a model of the real one's rules: silence kills, it puts the safe voltage on the wire, another
starts.
"""

import asyncio
import os
from collections.abc import Callable
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

from gateway.processes.exit_cause import EndCause, Ending
from gateway.profiles import Rig
from gateway.service.running_rig.running_rig import RunningRig
from tests.simulation.cables import CABLES, Cable, SimulatedPort
from tests.simulation.network import serve_in_memory
from tests.simulation.virtual_time import VirtualClock, VirtualLoop, run_all

PORT = 5020
CLOSING_S = 3.0
RESTART_S = 0.15
"""From the end of one control process until the next one opens its ports."""
_RIG = "gateway.service.running_rig.running_rig"


class SimulatedDisk:
    """Stands for `DiskWorker`: what it is given is done at once, and told a little later, by the chance of the schedule."""

    delay_s: Callable[[], float] = staticmethod(lambda: 0.005)
    is_full = False

    def __call__(self, work: Callable[[], Any], done: Callable[[Any], None]) -> None:
        asyncio.get_running_loop().call_later(type(self).delay_s(), done, self._result(work))

    def begin(self, work: Callable[[], Any]) -> None:
        self._result(work)

    def _result(self, work: Callable[[], Any]) -> Any:
        if type(self).is_full:
            return OSError(28, os.strerror(28))
        try:
            return work()
        except Exception as error:
            return error

    def close(self) -> None: ...


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


class Log:
    """Stands for `EventLog`: keeps what was said."""

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self.lines: list[tuple[float, str]] = []

    def __call__(self, cause: str, sentence: str) -> None:
        self.lines.append((self._clock.now_s, sentence))

    def speaking_for(self, source: str) -> Callable[[str, str], None]:
        return self

    note = __call__


class GuardianEnd:
    """Control's end of the guardian's line, without a line."""

    def __init__(self, guardian: "SimulatedGuardian") -> None:
        self._guardian = guardian
        self.on_ports: Callable[[dict[str, str]], None] = lambda ports: None
        self.rig_pid: int | None = None
        self.is_gone = False

    def heartbeat(self, now_s: float) -> None:
        self._guardian.beat_s = now_s

    def hand_over(self, descriptor: int, safe_frame: bytes, safe_reply: bytes) -> None:
        self._guardian.safe_frame = safe_frame

    def first_cause(self, cause: str) -> None:
        self._guardian.complaints.append(cause)

    def close(self) -> None: ...


@contextmanager
def simulated_edges() -> Any:
    """Everything of control that reaches for the kernel, replaced."""
    with pytest.MonkeyPatch.context() as patch, ExitStack():
        patch.setattr("gateway.service.running_rig.lines.rig_ports.SerialPort", SimulatedPort)
        patch.setattr(f"{_RIG}.ClockTick", SimulatedTick)
        patch.setattr(f"{_RIG}.SchedulerCounters", NoCounters)
        patch.setattr(f"{_RIG}.explain_silent_device", _explain)
        for user in (
            "gateway.calibrations.upload",
            "gateway.service.running_rig.rig_plants",
            "gateway.audit.audit_log",
            "gateway.service.recording_retention",
            "gateway.service.recording_sync",
        ):
            patch.setattr(f"{user}.DiskWorker", SimulatedDisk)
        yield


async def _explain(line: Any, path: str) -> str:
    return f"E111 {path}: silent"


class SimulatedGuardian:
    """Keeps one control process alive. loops: those that are run; a control that has died is not among them any more."""

    def __init__(
        self, rig: Rig, state: Path, outside: VirtualLoop, loops: list[VirtualLoop], log: Log, clock: VirtualClock
    ) -> None:
        self._rig, self._state, self._outside, self._loops = rig, state, outside, loops
        self._log, self._clock = log, clock
        self.inside: VirtualLoop | None = None
        self.safe_frame = b""
        self.beat_s = 0.0
        self.complaints: list[str] = []
        self.starts_s: list[float] = []
        self.deaths_s: list[float] = []
        self.stopped_until_s = 0.0
        self.on_death: Callable[[], None] = lambda: None
        self._kept: list[
            tuple[VirtualLoop, RunningRig]
        ] = []  # the dead, too: they must not be collected, and act, meanwhile
        self._start(None)
        self._outside.call_later(0.01, self._look)

    @property
    def is_serving(self) -> bool:
        return self.inside is not None and bool(self.inside.servers)

    def kill(self, cause: EndCause = EndCause.DIED) -> None:
        """SIGKILL: the process does nothing any more. The guardian puts the safe voltage out, and starts another."""
        inside, self.inside = self.inside, None
        if inside is None:
            return
        self.deaths_s.append(self._clock.now_s)
        if inside in self._loops:  # else it is stopped
            self._loops.remove(inside)
        for cable in CABLES.values():
            cable.port = None
        self.on_death()
        self._outside.call_later(0.002, self._send_safe)
        self._outside.call_later(RESTART_S, self._start, Ending(cause, "killed"))

    def stop(self, duration_s: float) -> None:
        """SIGSTOP, or a machine that lets it wait: it does nothing for so long, or until the guardian has enough."""
        if self.inside in self._loops:
            self._loops.remove(self.inside)
            self._outside.call_later(duration_s, self._go_on, self.inside)

    def close(self) -> None:
        """End every control process that there ever was, so that its descriptors are closed; nothing of it is judged."""
        for loop in dict.fromkeys(loop for loop, _ in self._kept):
            for task in asyncio.all_tasks(loop):
                task.cancel()
            run_all(self._clock, [loop], self._clock.now_s)
            endings = [loop.create_task(running.close()) for of_loop, running in self._kept if of_loop is loop]
            run_all(self._clock, [loop], self._clock.now_s + CLOSING_S)
            for task in endings:
                task.exception()  # of one that was killed before it had begun
            loop.close()

    def _start(self, ending: Ending | None) -> None:
        loop = self.inside = VirtualLoop(self._clock)
        serve_in_memory(loop)
        self._loops.append(loop)
        self.beat_s = self._clock.now_s
        self.starts_s.append(self._clock.now_s)
        loop.create_task(self._run(loop, ending))

    async def _run(self, loop: VirtualLoop, ending: Ending | None) -> None:
        running = RunningRig(self._rig, {name: name for name in CABLES}, self._state, GuardianEnd(self), self._log)  # type: ignore[arg-type]
        self._kept.append((loop, running))
        await running.start(["127.0.0.1", PORT], record=False, restarted=ending)
        await running.failed.wait()
        self.kill(EndCause.DEFECT)

    def _go_on(self, inside: VirtualLoop) -> None:
        if inside is self.inside:
            self._loops.append(inside)

    def _look(self) -> None:
        if self.is_serving and self._clock.now_s - self.beat_s > self._rig.control.supervision.stall_s:
            if self.inside not in self._loops:
                self._loops.append(self.inside)  # type: ignore[arg-type]
            self.kill(EndCause.STALLED)
        self._outside.call_later(0.01, self._look)

    def _send_safe(self) -> None:
        output = CABLES["output"]
        if self.safe_frame and output.is_plugged:
            output.send_to_device(self.safe_frame)


def lay_cables(
    outside: VirtualLoop, rig: Rig, on_output: Callable[[bytes, float], None], on_cell: Callable[[bytes, float], None]
) -> None:
    """Connect the world to control."""
    CABLES.clear()
    CABLES["output"] = Cable(outside, rig.output.settings, on_output)
    CABLES["load_cell"] = Cable(outside, rig.load_cell.settings, on_cell)
