"""A gateway's processes in virtual time: the real guardian, and real control processes under it, on loops of their own.

What is not real is between them and the kernel (edges.py, links.py, cables.py, network.py): here, how a process is started,
stopped, killed and gone, and who starts the guardian again when it has ended, as systemd does.
"""

import asyncio
import errno
import os
import signal
from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import Any

from gateway.ports import PortError
from gateway.processes import exit_codes, message_link
from gateway.profiles import Rig
from gateway.service import control_process
from gateway.service.running_rig.starting import StartError
from gateway.service.supervisor.child_process import LOST, Child
from gateway.service.supervisor.guardian import Guardian
from gateway.service.supervisor.run_options import RunOptions
from tests.simulation.kernel.cables import CABLES
from tests.simulation.kernel.edges import Log, NotedRecorder, NotedRunningRig, SimulatedDisk
from tests.simulation.kernel.links import LinkEnd, create_link, read_in_memory, readable_ends
from tests.simulation.kernel.virtual_time import VirtualClock, VirtualLoop

PORT = 5020
CLOSING_S = 3.0
BIRTH_S = 0.15
"""From the guardian's wish until a control process does its first thing."""
SERVICE_RESTART_S = 2.0
"""Until a guardian that has ended or died is started again: sooner than by the unit, so that more of it happens."""
MOST_TURNS = 100
"""At one moment: a few things may happen at once."""
_RIG_PID, _SIGNALS, _FIRST_PID = ((1 << 22) + number for number in range(3))  # above every process number of Linux


class SimulatedProcess(Child):
    """A control process: its loop, the other end of its line, and its death."""

    link: LinkEnd  # type: ignore[assignment]

    def __init__(self, pid: int, clock: VirtualClock, on_death: Callable[["SimulatedProcess"], None]) -> None:
        ours, self.theirs = create_link()
        super().__init__(ours, pid, died=pid)  # type: ignore[arg-type]
        self.loop = VirtualLoop(clock)
        read_in_memory(self.loop)
        self._on_death = on_death
        self.exit_code: int | None = None
        self.thaws_s = 0.0  # until when it is stopped
        self.task: asyncio.Task[None] | None = None
        self.beat: int | None = None  # its own copy of the descriptor of that memory

    def leave(self, code: int) -> None:
        """End, with the exit code that the kernel tells."""
        if self.exit_code is None:
            self.exit_code = code
            self.loop.halt()
            self._on_death(self)
            self.theirs.close()
            _close(self.beat)

    def kill(self) -> None:
        if self.exit_code is None:
            SimulatedDisk.kill(self.loop)
        self.leave(-signal.SIGKILL)

    def wait(self, bound_s: float = 0.0) -> int:
        return LOST if self.exit_code is None else self.exit_code

    def end(self) -> None:
        self.leave(-signal.SIGTERM)
        self.close()

    def close(self) -> None:
        self.link.close()
        self.died = -1


class SimulatedRigProcess(Child):
    """The process of the simulated rig, which is the world here: it tells its ports, and stays."""

    def __init__(self, pid: int) -> None:
        ours, self.theirs = create_link()
        super().__init__(ours, pid, died=pid)  # type: ignore[arg-type]
        message_link.send(self.theirs, message_link.PTYS, {"ptys": {name: name for name in CABLES}, "pid": pid})  # type: ignore[arg-type]

    def kill(self) -> None:
        self.theirs.close()

    def wait(self, bound_s: float = 0.0) -> int:
        return exit_codes.OK

    def end(self) -> None:
        self.kill()
        self.close()

    def close(self) -> None:
        self.link.close()
        self.died = -1


class SimulatedStarter:
    """Stands for `ChildStarter`, whose children are all new processes: control and the rig."""

    sources: tuple[int, ...] = ()
    due_s = inf
    server_pid = None
    start_timeout_s = inf

    def __init__(self, control: Callable[[dict[str, Any]], SimulatedProcess]) -> None:
        self.control = control

    def rig(self, *, prepared: bool) -> SimulatedRigProcess:
        return SimulatedRigProcess(_RIG_PID)

    def open(self) -> None: ...

    def end(self) -> None: ...

    def poll_child(self, readable: set[int], now_s: float) -> None: ...


class SimulatedSignals:
    """Stands for `SignalPipe`."""

    descriptor = _SIGNALS
    count = 0

    def take(self) -> int:
        count, self.count = self.count, 0
        return count


class SimulatedService:
    """A gateway that is kept alive: its guardian, which keeps control alive, and systemd, which keeps the guardian.

    on_death: control is gone; restarts: how many guardians came after the first; thaws_s: when a guardian that has been stopped
    goes on.
    """

    thaws_s = 0.0
    _refused_until_s = 0.0

    def __init__(
        self, rig: Rig, state: Path, outside: VirtualLoop, log: Log, clock: VirtualClock, *, records: bool = False
    ) -> None:
        self._options = RunOptions(bind=("127.0.0.1", PORT), record=records)
        self._rig, self._state, self._outside, self._log, self._clock = rig, state, outside, log, clock
        self._processes: list[SimulatedProcess] = []
        self._guardian: Guardian | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._is_awake = False
        self.restarts = -1
        self.on_death: Callable[[], None] = lambda: None
        self._start()

    @property
    def inside(self) -> VirtualLoop | None:
        """The loop of the control process that lives, None between two."""
        process = self._processes[-1]
        return process.loop if process.exit_code is None else None

    @property
    def births(self) -> int:
        """How many control processes there have been."""
        return len(self._processes)

    @property
    def is_serving(self) -> bool:
        """Whether control works: it is there, listens, and is not stopped."""
        process = self._processes[-1]
        return process.exit_code is None and bool(process.loop.servers) and not process.loop.is_halted

    @property
    def is_guarded(self) -> bool:
        return self._guardian is not None

    def answer_socket(self, line: bytes) -> bytes:
        """What control.sock of the control process that lives says to a line."""
        return NotedRunningRig.of[-1]._control_socket.answer(line)

    # -- what happens to it

    def kill_control(self) -> None:
        """SIGKILL."""
        if self.inside:
            self._processes[-1].kill()

    def stop_control(self, duration_s: float) -> None:
        """SIGSTOP, or a machine that lets it wait: it does nothing for so long, or until the guardian has enough. One that
        stands still already does so for the longer of both times."""
        process, until_s = self._processes[-1], self._clock.now_s + duration_s
        if self.inside:
            process.loop.halt()
            process.thaws_s = max(process.thaws_s, until_s)
            self._outside.call_at(until_s, self._let_go_on, process, until_s)

    @staticmethod
    def _let_go_on(process: "SimulatedProcess", until_s: float) -> None:
        if process.exit_code is None and until_s >= process.thaws_s:
            process.loop.go_on()

    def stop_guardian(self, duration_s: float) -> None:
        """SIGSTOP: it does nothing for so long."""
        if self._guardian:
            self.thaws_s = max(self.thaws_s, self._clock.now_s + duration_s)
            self._outside.call_at(self.thaws_s, self._wake)

    def kill_guardian(self) -> None:
        """SIGKILL: the kernel closes its lines, which is how control learns of it."""
        guardian, self._guardian = self._guardian, None
        if guardian:
            self._close_descriptors(guardian)
            if guardian.control.process:
                guardian.control.process.close()
            self._outside.call_later(SERVICE_RESTART_S, self._start)

    def cut_power(self) -> None:
        """All of it dies at once, without a word; the guardian is started again. That first: who judges asks at control's death
        whether anybody is left who knows what it knew."""
        self.kill_guardian()
        self.kill_control()

    def terminate(self) -> None:
        """SIGTERM to the guardian: the force is ramped down first. Somebody starts it again."""
        if self._guardian:
            self._signals.count += 1
            self._wake()

    def close(self) -> None:
        """End every control process that there ever was, so that its descriptors are closed; nothing of it is judged."""
        if self._timer:
            self._timer.cancel()
        self._outside.halt()
        SimulatedDisk.is_gone = True
        self.on_death = lambda: None
        for process in self._processes:
            process.loop.halt()
        for process in self._processes:
            if process.task and process.task not in NotedRunningRig.closing:
                process.task.cancel()
            process.loop.go_on()
            self._clock.run_until(self._clock.now_s + CLOSING_S)
            process.end()
            process.loop.close()
        NotedRecorder.close_all()
        for running in NotedRunningRig.of:  # the kernel does so, where a disk hung to the end
            running._audit._log._file.close()
        if self._guardian:
            self._close_descriptors(self._guardian)

    def _close_descriptors(self, guardian: Guardian) -> None:
        """Do what the kernel does for a guardian that is dead."""
        guardian.control._drop_line()
        if guardian.control.memory:
            guardian.control.memory.close()
        _close(guardian.beat)

    # -- the guardian's turns

    def _start(self) -> None:
        self.restarts, self.thaws_s = self.restarts + 1, 0.0
        self._signals = SimulatedSignals()
        self._guardian = guardian = Guardian(
            self._options,
            self._state,
            SimulatedStarter(self._spawn),  # type: ignore[arg-type]
            self._signals,  # type: ignore[arg-type]
            self._log,  # type: ignore[arg-type]
            clock=self._clock.monotonic,
            wait=self._readable,
        )
        guardian.share_memory()
        _close(guardian.ring)  # nobody reads along here
        guardian.ring = None
        if guardian._start_control() is not None:
            self._end_guardian(guardian)
            return
        self._wake()

    def _wake(self) -> None:
        """Let the guardian look, as soon as what happens now has happened."""
        if not self._is_awake and self._clock.now_s >= self.thaws_s:
            self._is_awake = True
            self._outside.call_soon(self._take_turns)

    def _take_turns(self) -> None:
        """Let the guardian do all that is to be done now, and wake it when the next thing is due."""
        self._is_awake = False
        if self._clock.now_s < self.thaws_s:
            return
        if self._timer:
            self._timer.cancel()
        guardian, turns = self._guardian, 0
        while guardian:
            turns += 1
            assert turns <= MOST_TURNS, "the guardian spins: something is due, and it does nothing about it"
            if guardian._step() is not None:
                self._end_guardian(guardian)
                return
            if not self._readable(guardian._sources(), 0.0) and (patience_s := guardian._patience_s()) > 0.0:
                self._timer = self._outside.call_later(min(patience_s, 60.0), self._wake)
                return

    def _end_guardian(self, guardian: Guardian) -> None:
        guardian._close()
        self._guardian = None
        self._outside.call_later(SERVICE_RESTART_S, self._start)  # by systemd after a failure, else by somebody

    def _readable(self, numbers: list[int], timeout_s: float) -> set[int]:
        """Stands for `wait_readable`: nobody waits here."""
        readable = {process.died for process in self._processes[-2:] if process.exit_code is not None}
        if self._signals.count:
            readable.add(self._signals.descriptor)
        return readable_ends(numbers) | readable.intersection(numbers)

    # -- control

    def refuse_processes(self, duration_s: float) -> None:
        """A machine that has none to give for so long."""
        self._refused_until_s = self._clock.now_s + duration_s

    def _spawn(self, arguments: dict[str, Any]) -> SimulatedProcess:
        if self._clock.now_s < self._refused_until_s:
            raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        process = SimulatedProcess(_FIRST_PID + len(self._processes), self._clock, self._on_death)
        process.beat = arguments["beat"] = os.dup(arguments["beat"])
        self._processes.append(process)
        process.link.on_readable = self._wake
        self._outside.call_later(BIRTH_S, self._begin, process, arguments)
        return process

    def _begin(self, process: SimulatedProcess, arguments: dict[str, Any]) -> None:
        if process.exit_code is None:
            process.task = process.loop.create_task(self._run(process, arguments))

    async def _run(self, process: SimulatedProcess, arguments: dict[str, Any]) -> None:
        """Do as `control_process.main` does."""
        try:
            process.leave(await control_process.run(self._rig, arguments, process.theirs, self._log, ()))  # type: ignore[arg-type]
        except (StartError, PortError) as error:
            self._log("start", str(error))
            process.leave(error.exit_code)
        except Exception as error:
            self._log("start", f"A499 control process ended: {error!r}")
            process.leave(exit_codes.FAILED)

    def _on_death(self, process: SimulatedProcess) -> None:
        for cable in CABLES.values():  # one that a hanging disk has kept may end behind its successor's start
            if cable.port and cable.port.is_of(process.loop):
                cable.port = None
        self.on_death()
        self._wake()


def _close(descriptor: int | None) -> None:
    if descriptor is not None:
        os.close(descriptor)
