"""A gateway of its own for a benchmark: started on a free port, with a state directory of its own, ended afterwards."""

import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RunningGateway:
    """Where a running gateway is reached, its state directory, and the process of its control loop."""

    host: str
    port: int
    state: Path
    control_pid: int


@contextlib.contextmanager
def running_gateway(rig: str, *, quiet: bool = False) -> Iterator[RunningGateway]:
    """Run a gateway on a rig (name or file) until the block ends. quiet: what it says on stderr is dropped."""
    with tempfile.TemporaryDirectory() as state:
        where = ["--json", "--bind", "127.0.0.1:0", "--state", state]
        process = subprocess.Popen(
            [sys.executable, "-m", "gateway", "run", rig, *where],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL if quiet else None,
            text=True,
        )
        assert process.stdout
        try:
            ready = json.loads(process.stdout.readline())
            yield RunningGateway(*ready["modbus"], Path(state), ready["pids"]["control"])
        finally:
            process.terminate()
            process.wait()
            process.stdout.close()
