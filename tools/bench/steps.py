"""How a setpoint settles: the whole gateway on the simulated rig, with the trim and by feedforward alone, side by side.

    .venv/bin/python tools/bench/steps.py            # the table in README
    .venv/bin/python tools/bench/steps.py --json

Commands 5, 10, ..., 40 N and back down, then partial reversals, by Modbus; reads the measured force by Modbus. "settled" is
the time from the write until the measured force has come within 1 N for good; "error" is the mean of the last half second.
Twin and clock are real time; seeds are the rig's. Never run on hardware.
"""

import argparse
import contextlib
import json
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from pymodbus.client import ModbusTcpClient

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gateway.cli.diagnosis.progress_line import show_progress
from gateway.progress import reported
from tools.bench.harness.running_gateway import running_gateway

STEPS_N = (5, 10, 15, 20, 25, 30, 35, 40, 35, 30, 25, 20, 15, 10, 5, 20, 12, 26, 16, 30, 8)
DWELL_S = 2.0
BAND_N = 1.0


@dataclass
class Settling:
    """How one setpoint settled."""

    setpoint_n: float
    settled_s: float | None
    error_n: float


@contextlib.contextmanager
def connect(rig: Path) -> Iterator[ModbusTcpClient]:
    """Run a gateway on a rig and connect to it."""
    with running_gateway(str(rig), told=subprocess.DEVNULL) as gateway:
        host, port = gateway.modbus
        client = ModbusTcpClient(host, port=port, timeout=1, retries=0)
        client.connect()
        yield client
        client.close()


def measured_n(client: ModbusTcpClient) -> float:
    """Read the measured force, N."""
    (word,) = client.read_holding_registers(102, count=1, device_id=1).registers
    return (word - 65536 if word >= 32768 else word) / 100


def settle(client: ModbusTcpClient, setpoint_n: float) -> Settling:
    """Write a setpoint and watch it settle."""
    client.write_registers(0, [1, round(setpoint_n * 100)], device_id=1)
    began_s = time.perf_counter()
    trace = []
    while (now_s := time.perf_counter() - began_s) < DWELL_S:
        trace.append((now_s, measured_n(client)))
        time.sleep(0.005)
    outside = [at_s for at_s, force_n in trace if abs(force_n - setpoint_n) > BAND_N]
    settled_s = None if outside and outside[-1] > DWELL_S - 0.1 else (outside[-1] if outside else 0.0)
    last = [force_n for at_s, force_n in trace if at_s > DWELL_S - 0.5]
    return Settling(setpoint_n, settled_s, statistics.fmean(last) - setpoint_n)


def demo_rig(directory: Path, gain: float) -> Path:
    """Write the shipped demo rig with another trim gain; 0 is feedforward alone."""
    text = (Path(__file__).parents[2] / "profiles" / "rigs" / "demo.yaml").read_text()
    text, count = re.subn(r"gain_v_per_n_s: [0-9.]+", f"gain_v_per_n_s: {gain:g}", text)
    assert count == 1
    path = directory / f"steps-{'trim' if gain else 'feedforward'}.yaml"
    path.write_text(text)
    return path


def run(gain: float) -> list[Settling]:
    """Return how every setpoint settles with this gain."""
    with tempfile.TemporaryDirectory() as directory, connect(demo_rig(Path(directory), gain)) as client:
        stage = "with trim (1/2)" if gain else "feedforward alone (2/2)"
        return [settle(client, setpoint_n) for setpoint_n in reported(stage, STEPS_N)]


def format_settling(result: Settling) -> str:
    """Return a settling as two columns."""
    settled = "never" if result.settled_s is None else f"{result.settled_s:.2f} s"
    return f"{settled:>8}  {result.error_n:+6.2f} N"


def main() -> None:
    """Print the table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with show_progress("steps"):
        with_trim, alone = run(0.3), run(0.0)
    if options.json:
        print(json.dumps({"trim": [asdict(one) for one in with_trim], "feedforward": [asdict(one) for one in alone]}))
        return
    print("setpoint    with trim            feedforward alone")
    print("            within 1 N  error    within 1 N  error")
    for trimmed, plain in zip(with_trim, alone, strict=True):
        print(f"{trimmed.setpoint_n:6.1f} N  {format_settling(trimmed)}   {format_settling(plain)}")
    worst = max(abs(result.error_n) for result in with_trim)
    print(f"largest steady error: {worst:.2f} N with trim, {max(abs(result.error_n) for result in alone):.2f} N alone")


if __name__ == "__main__":
    main()
