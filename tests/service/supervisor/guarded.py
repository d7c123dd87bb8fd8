"""A guardian in virtual time whose children are scripts at the far end of real lines: they die, hang or lie where told."""

import contextlib
import os
import signal
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import pytest

from gateway.processes import message_link
from gateway.processes.scheduling.scheduler_counters import ProcessorTime
from gateway.service.supervisor.child_process import Child
from gateway.service.supervisor.event_wait import wait_readable
from gateway.service.supervisor.guardian import Guardian
from gateway.service.supervisor.run_options import RunOptions

SAFE_FRAME = b"SET 0\r\n"
PTYS = {"output": "/dev/pts/1", "load_cell": "/dev/pts/2"}
READY = {
    "banner": "READY",
    "info": {"ready": True, "modbus": ["127.0.0.1", 5020]},
    "optional": {},
    "stall_s": 0.1,
}


class FakeChild(Child):
    """A process that is nothing but its line and its death. theirs: the far end, for the script."""

    def __init__(self, pid: int) -> None:
        ours, self.theirs = message_link.create_link()
        self.theirs.setblocking(False)
        self._died_read, self._died_write = os.pipe()
        super().__init__(ours, 0)
        self._next_pid = pid
        self.exit_code: int | None = None
        self.is_immortal = False

    def attach(self, pid: int) -> None:
        self.pid, self.died = self._next_pid, self._died_read

    def dies(self, code: int) -> None:
        if self.exit_code is None:
            self.exit_code = code
            self.theirs.close()
            os.close(self._died_write)

    def kill(self) -> None:
        if not self.is_immortal:
            self.dies(-signal.SIGKILL)

    def wait(self, bound_s: float = 0.0) -> int:
        return -1000 if self.exit_code is None else self.exit_code

    def end(self) -> None:
        self.kill()
        self.close()

    def close(self) -> None:
        self.link.close()
        self.died = -1
        if self._died_read >= 0:
            os.close(self._died_read)
            self._died_read = -1

    def say(self, tag: str, body: dict[str, Any] | None = None, *descriptors: int) -> None:
        message_link.send(self.theirs, tag, body, *descriptors)

    def hears(self) -> list[message_link.Message]:
        heard = []
        with contextlib.suppress(BlockingIOError):
            while message := message_link.receive(self.theirs):
                heard += [] if message.tag == message_link.ADOPTED else [message]
        return heard


@dataclass
class FakeTurns:
    """What the kernel counts for a child: before a silence, then behind the kill."""

    readings: list[ProcessorTime]
    letter: str = "S"

    def read(self) -> ProcessorTime:
        return self.readings.pop(0) if len(self.readings) > 1 else self.readings[0]

    def state(self) -> str:
        return self.letter

    def close(self) -> None:
        pass


Script = Callable[[FakeChild], None]


@dataclass
class FakeStarter:
    """Each child plays the next script of its list, and the last one from then on."""

    controls: list[Script]
    rigs: list[Script] = field(default_factory=list)
    due_s: float = inf
    sources: list[int] = field(default_factory=list)
    server_pid: int | None = None
    start_timeout_s: float = 1.0
    started: list[FakeChild] = field(default_factory=list)
    rigs_started: list[FakeChild] = field(default_factory=list)
    optionals: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    optionals_started: list[FakeChild] = field(default_factory=list)
    arguments: list[dict[str, Any]] = field(default_factory=list)
    calls: list[str] = field(default_factory=list)

    def control(self, arguments: dict[str, Any]) -> FakeChild:
        self.arguments.append(arguments)
        return self._play(self.controls, self.started, 1000)

    def rig(self, *, prepared: bool) -> FakeChild:
        self.calls.append(f"rig prepared={prepared}")
        return self._play(self.rigs, self.rigs_started, 2000)

    def optional(self, name: str, arguments: dict[str, Any]) -> FakeChild:
        self.optionals.append((name, arguments))
        return self._play([lambda child: child.attach(0)], self.optionals_started, 3000)

    def _play(self, scripts: list[Script], started: list[FakeChild], pid: int) -> FakeChild:
        child = FakeChild(pid + len(started))
        started.append(child)
        script = scripts.pop(0) if len(scripts) > 1 else scripts[0]
        try:
            script(child)
        except OSError:
            child.dies(0)
            child.close()
            raise
        return child

    def open(self) -> None:
        self.calls.append("open")

    def end(self) -> None:
        self.calls.append("end")

    def on_born(self) -> None:
        self.calls.append("attach")

    def on_not_born(self) -> None:
        self.calls.append("not attach")

    def drop_server(self, how: str, now_s: float) -> None:
        self.calls.append(f"drop {how}")

    def poll_child(self, readable: set[int], now_s: float) -> None:
        pass


class FakeSignals:
    def __init__(self) -> None:
        self._reader, self._writer = socket.socketpair()
        self._reader.setblocking(False)
        self.descriptor = self._reader.fileno()

    def send(self) -> None:
        self._writer.send(b"\x02")

    def take(self) -> int:
        with contextlib.suppress(BlockingIOError):
            return len(self._reader.recv(64))
        return 0

    def close(self) -> None:
        self._reader.close()
        self._writer.close()


class FakeLog:
    """Keeps what is said to people, and by itself what is noted in the file."""

    def __init__(self, said: list[str], noted: list[str]) -> None:
        self._said, self._noted = said, noted

    def __call__(self, cause: str, sentence: str) -> None:
        self._said.append(sentence)

    def note(self, cause: str, sentence: str) -> None:
        self._noted.append(sentence)


class Scene:
    """step: until something has happened that `until` accepts, or the guardian ends (`code`)."""

    def __init__(self, tmp_path: Path, starter: FakeStarter) -> None:
        self.now_s = 100.0
        self.said: list[str] = []
        self.noted: list[str] = []
        self.starter = starter
        self.signals = FakeSignals()
        self.code: int | None = None
        self.guardian = Guardian(
            RunOptions(json=True),
            tmp_path,
            starter,  # type: ignore[arg-type]
            self.signals,  # type: ignore[arg-type]
            FakeLog(self.said, self.noted),  # type: ignore[arg-type]
            clock=lambda: self.now_s,
            wait=self.wait,
        )

    def wait(self, descriptors: list[int], timeout_s: float) -> set[int]:
        ready = wait_readable(descriptors, 0.0)
        if not ready:
            assert timeout_s < 1e6, "the guardian waits for ever"
            self.now_s += timeout_s
        return ready

    def run(self, until: Callable[[], bool] = lambda: False, steps: int = 200) -> int | None:
        if not self.starter.arguments:
            self.code = self.guardian._start_control()
        while self.code is None and not until():
            self.code = self.guardian._step()
            steps -= 1
            assert steps > 0, f"not in 200 steps: {self.said}"
        return self.code

    @property
    def child(self) -> FakeChild:
        return self.starter.started[-1]

    def close(self) -> None:
        self.guardian._close()
        self.signals.close()
        for child in (*self.starter.started, *self.starter.rigs_started, *self.starter.optionals_started):
            child.dies(0)
            child.close()


class Port:
    """A pipe in the place of a serial port: what the guardian wrote through the descriptor that it was handed."""

    def __init__(self) -> None:
        self._reader, self.writer = os.pipe()
        os.set_blocking(self._reader, False)

    def wrote(self) -> bytes:
        try:
            return os.read(self._reader, 4096)
        except BlockingIOError:
            return b""

    def close(self) -> None:
        os.close(self._reader)
        os.close(self.writer)


@pytest.fixture
def port() -> Iterator[Port]:
    port = Port()
    yield port
    port.close()
