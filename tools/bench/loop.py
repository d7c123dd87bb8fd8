"""How fast a setpoint reaches the wire, and how steady the loop stays under load.

    .venv/bin/python tools/bench/loop.py

Runs the whole gateway (guardian, control process) on two ptys whose far ends this program serves itself, so that the wire
costs nothing ("unpaced") or exactly what 9600 baud cost ("paced", the simulated rig). Prints

- setpoint-to-first-byte: from before the FC16 is sent on loopback TCP until the first byte of `SET n` is readable on the pty;
- loop lateness and missed ticks at 250 Hz while masters ask 2000 times a second.

Goals: p99 at most 434 us (half of the wire time of a 10-byte command at 115200 baud); missed ticks at most 0.5 %.
"""

import argparse
import contextlib
import json
import os
import pty
import select
import socket
import struct
import tempfile
import threading
import time
import tty
from collections.abc import Iterator
from pathlib import Path

from running_gateway import RunningGateway, running_gateway

GOAL_P99_S = 434e-6
GOAL_MISSED = 0.005

RIG = """\
name: bench
description: both devices served by tools/bench/loop.py on ptys, no wire time
simulated: false
loop_hz: {loop_hz}
registers: force-v1
calibration: demo
output: {{device: smc-itv-rc, port: {output}, baud: 9600}}
load_cell: {{device: stream-st-gs, port: {cell}, baud: 115200}}
limits: {{force_max_n: 60, over_force_n: 75, voltage_max_v: 8}}
accept_no_device_watchdog: true
"""


class Devices(threading.Thread):
    """Both devices, answering at once; notes when the first byte of a setting arrives."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.output, output_end = pty.openpty()
        self.cell, cell_end = pty.openpty()
        for end in (output_end, cell_end, self.output, self.cell):
            tty.setraw(end)
        self.paths = os.ttyname(output_end), os.ttyname(cell_end)
        self.ends = output_end, cell_end  # kept open: a pty without a client reads as an error
        self.set_seen_s: float | None = None
        self.set_arrived = threading.Event()
        self.quiet = threading.Event()
        self.stop = threading.Event()

    def run(self) -> None:
        """Answer both lines until `stop` is set."""
        due_s = time.perf_counter()
        line = b""
        while not self.stop.is_set():
            readable, _, _ = select.select([self.output], [], [], max(0.0, due_s - time.perf_counter()))
            if readable:
                now_s = time.perf_counter()
                if not line:
                    first_s = now_s
                line += os.read(self.output, 4096)
                while b"\r\n" in line:
                    request, line = line.split(b"\r\n", 1)
                    self._answer(request, first_s)
            if time.perf_counter() >= due_s:
                due_s += 0.01
                os.write(self.cell, b"ST,GS,+0000.00kg\r\n")

    def _answer(self, request: bytes, first_s: float) -> None:
        word, _, number = request.partition(b" ")
        if word == b"SET":
            os.write(self.output, number + b"\r\n")
            self.set_seen_s = first_s
            self.set_arrived.set()
        else:
            os.write(self.output, b"0\r\n")


@contextlib.contextmanager
def gateway_on_devices(loop_hz: int) -> Iterator[tuple[Devices, RunningGateway]]:
    """Run a gateway whose devices this program serves, at this rate."""
    devices = Devices()
    devices.start()
    with tempfile.TemporaryDirectory() as folder:
        rig = Path(folder) / "bench.yaml"
        rig.write_text(RIG.format(loop_hz=loop_hz, output=devices.paths[0], cell=devices.paths[1]))
        with running_gateway(str(rig)) as gateway:
            yield devices, gateway
    devices.stop.set()
    devices.join()


def write_request(address: int, *words: int) -> bytes:
    """Return one FC16 as it goes over TCP."""
    pdu = struct.pack(f">BHHB{len(words)}H", 16, address, len(words), 2 * len(words), *words)
    return struct.pack(">HHHB", 1, 0, len(pdu) + 1, 1) + pdu


def ask(master: socket.socket, request: bytes) -> bytes:
    """Send a request and return the bytes of its answer."""
    master.sendall(request)
    return master.recv(512)


def latencies(devices: Devices, address: tuple[str, int], count: int) -> list[float]:
    """Return the seconds to the wire of voltage mode steps up and down, one every 50 ms: each moves the output by many
    counts at once.
    """
    seconds = []
    with socket.create_connection(address) as master:
        master.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        ask(master, write_request(0, 1, 0, 0, 1, 0, 2000))
        for number in range(count):
            time.sleep(0.05)  # idle line: the last setting has been answered long ago
            devices.set_arrived.clear()
            request = write_request(0, 1, 0, 0, 1, 0, 3000 if number % 2 else 2000)
            sent_s = time.perf_counter()
            ask(master, request)
            if devices.set_arrived.wait(1.0) and devices.set_seen_s:
                seconds.append(devices.set_seen_s - sent_s)
        ask(master, write_request(0, 0, 0))
    return seconds


def load(address: tuple[str, int], seconds: float, per_second: int, connections: int = 4) -> int:
    """Send per_second reads of the status block, evenly spread over the connections; return the number answered."""
    request = struct.pack(">HHHBBHH", 1, 0, 6, 1, 3, 100, 26)
    with contextlib.ExitStack() as stack:
        masters = [stack.enter_context(socket.create_connection(address)) for _ in range(connections)]
        began_s = time.perf_counter()
        done = 0
        while (now_s := time.perf_counter()) < began_s + seconds:
            while done < (now_s - began_s) * per_second:
                ask(masters[done % connections], request)
                done += 1
            time.sleep(0.001)
    return done


def health(state: Path) -> dict[str, float]:
    """Return the running gateway's own figures."""
    with socket.socket(socket.AF_UNIX) as control:
        control.connect(str(state / "control.sock"))
        control.sendall(b'{"do": "health"}\n')
        answer: dict[str, float] = json.loads(control.recv(65536))
        return answer


def quantile(values: list[float], share: float) -> float:
    """Return the value below which about this share of all lies."""
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def bare_hops(count: int) -> list[float]:
    """Return the seconds from a write on a pty until another thread sees it, nothing else: what the machine itself takes at
    this moment.
    """
    master, client = pty.openpty()
    tty.setraw(client)
    arrivals_s: list[float] = []
    arrived = threading.Event()

    def listen() -> None:
        for _ in range(count):
            select.select([master], [], [])
            arrivals_s.append(time.perf_counter())
            os.read(master, 64)
            arrived.set()

    thread = threading.Thread(target=listen)
    thread.start()
    hops = []
    for _ in range(count):
        time.sleep(0.02)
        arrived.clear()
        sent_s = time.perf_counter()
        os.write(client, b"SET 512\r\n")
        arrived.wait()
        hops.append(arrivals_s[-1] - sent_s)
    thread.join()
    os.close(master)
    os.close(client)
    return hops


def bench_latency(loop_hz: int, count: int) -> None:
    """Print how long a setpoint takes to the wire."""
    with gateway_on_devices(loop_hz) as (devices, gateway):
        seconds = latencies(devices, (gateway.host, gateway.port), count)
    p50, p99 = quantile(seconds, 0.5), quantile(seconds, 0.99)
    verdict = "reached" if p99 <= GOAL_P99_S else "MISSED"
    print(f"setpoint to first byte, idle unpaced pty, {len(seconds)} of {count} setpoints:")
    print(f"  p50 {p50 * 1e6:.0f} us, p99 {p99 * 1e6:.0f} us, max {max(seconds) * 1e6:.0f} us")
    hops = bare_hops(100)
    print(
        f"  a bare pty hop, beside it: p50 {quantile(hops, 0.5) * 1e6:.0f} us, p99 {quantile(hops, 0.99) * 1e6:.0f} us"
    )
    print(f"  goal p99 <= {GOAL_P99_S * 1e6:.0f} us: {verdict}; ratio to the goal {p99 / GOAL_P99_S:.2f}")


def bench_load(loop_hz: int, seconds: float) -> None:
    """Print how late the loop is while masters read."""
    with gateway_on_devices(loop_hz) as (_, gateway):
        before = health(gateway.state)
        answered = load((gateway.host, gateway.port), seconds, 2000)
        after = health(gateway.state)
    ticks, missed = after["ticks"] - before["ticks"], after["missed_ticks"] - before["missed_ticks"]
    verdict = "reached" if missed <= GOAL_MISSED * ticks else "MISSED"
    print(f"loop {loop_hz} Hz under {answered / seconds:.0f} requests/s for {seconds:g} s:")
    print(f"  lateness p50 < {after['late_p50_us']} us, p99 < {after['late_p99_us']} us")
    print(
        f"  missed ticks {missed:g} of {ticks:g} ({100 * missed / ticks:.2f} %); goal <= {100 * GOAL_MISSED:g} %: {verdict}"
    )


def main() -> None:
    """Print both benchmarks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--setpoints", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args()
    bench_latency(100, options.setpoints)
    bench_load(250, options.seconds)
    wire_s = 9 * 10 / 9600
    print(
        f"on a real wire at 9600 baud the nine bytes of `SET 512` alone take {wire_s * 1e3:.1f} ms more to arrive whole"
    )


if __name__ == "__main__":
    main()
