#!/usr/bin/env python3
"""What viewers of the page cost the control loop: `tools/bench/page_viewers.py [--viewers 20] [--seconds 30]`.

A demo gateway holds 12 N, first with nobody at its page, then with so many open streams of events that are read as a browser
reads them. Printed for both: missed ticks, the processor time of control and of the page (in percent of a core), and what the
streams carry. On a busy machine ticks are missed in both; what counts is the difference.
"""

import argparse
import json
import selectors
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import psutil

from gateway.cli.control_socket import ask


def watch(address: tuple[str, int], viewers: int, seconds: float) -> int:
    """Hold so many streams open and read them; return the bytes that came."""
    selector = selectors.DefaultSelector()
    for number in range(viewers):
        link = socket.create_connection(address)
        link.sendall(f"GET /events?viewer={number} HTTP/1.1\r\nHost: {address[0]}\r\n\r\n".encode())
        selector.register(link, selectors.EVENT_READ)
    end_s, received = time.monotonic() + seconds, 0
    while (left_s := end_s - time.monotonic()) > 0:
        for key, _ in selector.select(left_s):
            link = key.fileobj
            assert isinstance(link, socket.socket)
            received += len(link.recv(1 << 16))
    for key in list(selector.get_map().values()):
        link = key.fileobj
        assert isinstance(link, socket.socket)
        link.close()
    selector.close()
    return received


def measure(ready: dict[str, Any], state: Path, viewers: int, seconds: float) -> dict[str, float]:
    """Return what one stretch of time has cost; share: in percent of one core."""
    processes = {name: psutil.Process(ready["pids"][name]) for name in ("control", "web")}
    before = {name: sum(one.cpu_times()[:2]) for name, one in processes.items()}
    loop = ask(state, {"do": "state"})["loop"]
    received = watch(tuple(ready["web"]), viewers, seconds)
    after = ask(state, {"do": "state"})["loop"]
    ticks, missed = after["ticks"] - loop["ticks"], after["missed"] - loop["missed"]
    used = {name: 100.0 * (sum(one.cpu_times()[:2]) - before[name]) / seconds for name, one in processes.items()}
    return {"missed_percent": 100.0 * missed / ticks, "kB_per_s": received / seconds / 1000.0} | {
        f"{name}_percent": share for name, share in used.items()
    }


def run(viewers: int, seconds: float) -> dict[str, dict[str, float]]:
    """Return the measurement of each number of viewers, by its name."""
    with tempfile.TemporaryDirectory() as folder:
        where = ["--json", "--bind", "127.0.0.1:0", "--web", "127.0.0.1:0", "--state", folder]
        process = subprocess.Popen(
            [sys.executable, "-m", "gateway", "run", "demo", "--sim", *where], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout
        try:
            ready = json.loads(process.stdout.readline())
            state = Path(folder)
            ask(state, {"do": "modbus", "via": "web", "pdu": "1000000002040001" + "04b0"})
            time.sleep(3.0)  # the page's process has imported what it needs, the force is held
            return {f"{count} viewers": measure(ready, state, count, seconds) for count in (0, viewers)}
        finally:
            process.terminate()
            process.wait()
            process.stdout.close()


def main() -> None:
    """Print both stretches."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--viewers", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=30.0)
    asked = parser.parse_args()
    for name, figures in run(asked.viewers, asked.seconds).items():
        print(f"{name:>12}  " + "  ".join(f"{key} {value:.3f}" for key, value in figures.items()))


if __name__ == "__main__":
    main()
