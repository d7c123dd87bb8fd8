"""A gateway of its own for a benchmark: started on a free port, with a state directory of its own, ended afterwards."""

import contextlib
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from gateway.cli.control_socket import ask

ENABLE_12_N = "1000000002040001" + "04b0"


@dataclass(frozen=True)
class RunningGateway:
    """A running gateway: what it said when it was ready (addresses, process numbers), and its state directory."""

    ready: Mapping[str, Any]
    state: Path

    @property
    def modbus(self) -> tuple[str, int]:
        """Address for masters."""
        host, port = self.ready["modbus"]
        return host, port

    def hold(self) -> None:
        """Hold 12 N; return when they are held, and all processes have imported what they need."""
        ask(self.state, {"do": "modbus", "via": "web", "pdu": ENABLE_12_N})
        time.sleep(3.0)


@contextlib.contextmanager
def running_gateway(rig: str, *options: str, told: IO[bytes] | int | None = None) -> Iterator[RunningGateway]:
    """Run a gateway on a rig (name or file) until the block ends. options: of `run`; told: where its stderr goes."""
    with tempfile.TemporaryDirectory() as state:
        where = ["--json", "--bind", "127.0.0.1:0", "--state", state]
        process = subprocess.Popen(
            [sys.executable, "-m", "gateway", "run", rig, *where, *options],
            stdout=subprocess.PIPE,
            stderr=told,
            text=True,
        )
        assert process.stdout
        try:
            yield RunningGateway(json.loads(process.stdout.readline()), Path(state))
        finally:
            process.terminate()
            process.wait()
            process.stdout.close()
