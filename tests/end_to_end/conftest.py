"""A whole running gateway for tests: guardian, control process, simulated rig, on free ports."""

import contextlib
import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from pymodbus.client import ModbusTcpClient

OWNER_IP = 116
POLL_S = 0.02
"""Between two questions of a test that waits: without it both its processor and the gateway's are full."""


@dataclass
class RunningGateway:
    process: subprocess.Popen[str]
    ready: dict[str, Any]
    state: Path
    client: ModbusTcpClient
    log: Path

    @property
    def port(self) -> int:
        return int(self.ready["modbus"][1])

    def words(self, address: int, count: int) -> list[int]:
        answer = self.client.read_holding_registers(address, count=count, device_id=1)
        assert not answer.isError(), answer
        return list(answer.registers)

    def status(self) -> dict[str, int]:
        names = "status_word state force_measured force_requested force_accepted force_applied output_voltage".split()
        signed = (word - 65536 if word >= 32768 else word for word in self.words(100, len(names)))
        return dict(zip(names, signed, strict=True))

    def write(self, address: int, *words: int) -> Any:
        return self.client.write_registers(address, [word & 0xFFFF for word in words], device_id=1)

    def wait_until(self, condition: Callable[[dict[str, int]], bool], within_s: float = 5.0) -> dict[str, int]:
        deadline_s = time.monotonic() + within_s
        while True:
            status = self.status()
            if condition(status):
                return status
            assert time.monotonic() < deadline_s, f"not within {within_s} s: {status}"
            time.sleep(POLL_S)

    def said(self, words: str, within_s: float = 2.0, *, after: int = 0) -> str:
        """The last line on the gateway's stderr that holds these words; after: that many lines are of earlier."""
        deadline_s = time.monotonic() + within_s
        while True:
            lines = [line for line in self.log.read_text().splitlines()[after:] if words in line]
            if lines:
                return lines[-1]
            assert time.monotonic() < deadline_s, f"{words!r} was not said: {self.log.read_text()}"
            time.sleep(0.01)

    def next_ready(self) -> dict[str, Any]:
        """The JSON line of a restarted control process."""
        assert self.process.stdout
        self.ready = json.loads(self.process.stdout.readline())
        return self.ready

    def rest(self) -> None:
        """Disabled, in force mode, without a force or an owner: where each test of a shared gateway begins. One with a latched
        fault does not come to OFF, and a test that leaves one behind fails the next."""
        self.client.close()  # whoever asked nothing for long may have been hung up on
        assert self.client.connect()
        assert not self.write(0, 0, 0, 0, 0).isError()
        self.wait_until(lambda status: status["state"] == 0 and abs(status["force_measured"]) < 200)
        assert self.words(OWNER_IP, 2) == [0, 0]

    def force_n(self) -> float:
        return self.status()["force_measured"] / 100


def start(state: Path, *options: str, rig: str = "demo", environment: dict[str, str] | None = None) -> RunningGateway:
    """A gateway that is READY; what it says on stderr goes to a file beside the state directory."""
    log = state.with_name(state.name + ".stderr")
    command = [
        sys.executable,
        "-m",
        "gateway",
        "run",
        rig,
        "--json",
        "--bind",
        "127.0.0.1:0",
        "--state",
        str(state),
        *options,
    ]
    with log.open("w") as stderr:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, text=True, env=environment)
    assert process.stdout
    line = process.stdout.readline()
    if not line:
        process.stdout.close()
        raise AssertionError(f"the gateway ended with {process.wait()}: {log.read_text()}")
    ready = json.loads(line)
    client = ModbusTcpClient("127.0.0.1", port=ready["modbus"][1], timeout=1.0, retries=0)
    assert client.connect()
    return RunningGateway(process, ready, state, client, log)


def stop(gateway: RunningGateway) -> int:
    gateway.client.close()
    with contextlib.suppress(ProcessLookupError):
        gateway.process.send_signal(signal.SIGINT)
    code = gateway.process.wait(15)
    assert gateway.process.stdout
    gateway.process.stdout.close()
    print(gateway.log.read_text())
    return code


@pytest.fixture
def running(tmp_path: Path) -> Iterator[RunningGateway]:
    gateway = start(tmp_path / "state", "--sim")
    yield gateway
    stop(gateway)


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningGateway]:
    """One gateway for all tests of a module; each begins with `rest`."""
    gateway = start(tmp_path_factory.mktemp("shared") / "state", "--sim")
    yield gateway
    stop(gateway)


@pytest.fixture
def rested(shared: RunningGateway) -> RunningGateway:
    shared.rest()
    return shared
