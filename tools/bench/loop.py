"""How fast a setpoint reaches the wire, and how steady the loop stays under load.

    .venv/bin/python tools/bench/loop.py

Runs the whole gateway (guardian, control process) on two ptys whose far ends a process of this program serves, so that the
wire costs nothing. Prints

- setpoint-to-first-byte: from before the FC16 is sent on loopback TCP until the first byte of `SET n` is readable on the pty;
- what the control process takes of a core and of memory at 100 Hz while nobody asks;
- loop lateness and missed ticks at 250 Hz while masters ask 2000 times a second.

Beside latency and idle cost stands an empty loop of the same wake-ups (`harness/empty_loop.py`): what is left above it is the
gateway's own work, what it takes itself no Python program on this machine gets below. Its latency is measured behind the
gateway's and not beside it: its two hundred wake-ups a second were load on caches and cores that no cell has.

Goals: p99 at most 250 us above that of a bare pty hop into the same process in the same run; missed ticks at most 0.5 %.
"""

import argparse
import contextlib
import json
import os
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gateway.cli.diagnosis.progress_line import show_progress
from gateway.progress import report
from tools.bench.harness.far_end import Devices
from tools.bench.harness.running_gateway import RunningGateway, running_gateway

GOAL_ABOVE_HOP_S = 250e-6
GOAL_MISSED = 0.005
GOAL_IDLE_SHARE = 0.03
GOAL_IDLE_BYTES = 60e6
FUNCTION, IS_REFUSED = 7, 0x80  # place of an answer's function code, and its bit of an exception

RIG = """\
name: bench
description: both devices served by tools/bench/harness/far_end.py on ptys, no wire time
simulated: false
loop_hz: {loop_hz}
registers: force-v1
calibration: demo
output: {{device: smc-itv-rc, port: {output}, baud: 9600}}
load_cell: {{device: stream-st-gs, port: {cell}, baud: 115200}}
limits: {{force_max_n: 60, over_force_n: 75, voltage_max_v: 8}}
accept_no_device_watchdog: true
"""


@contextlib.contextmanager
def gateway_on_devices(loop_hz: int) -> Iterator[tuple[Devices, RunningGateway]]:
    """Run a gateway whose devices this program serves, at this rate."""
    with contextlib.closing(Devices()) as devices, tempfile.TemporaryDirectory() as folder:
        rig = Path(folder) / "bench.yaml"
        rig.write_text(RIG.format(loop_hz=loop_hz, output=devices.paths[0], cell=devices.paths[1]))
        with running_gateway(str(rig), told=subprocess.DEVNULL) as gateway:
            yield devices, gateway


@dataclass(frozen=True)
class EmptyLoop:
    """A loop of the gateway's wake-ups with nothing in them: its devices, where it listens, its process."""

    devices: Devices
    address: tuple[str, int]
    pid: int


@contextlib.contextmanager
def empty_loop(loop_hz: int) -> Iterator[EmptyLoop]:
    """Run one until the block ends."""
    script = Path(__file__).parent / "harness" / "empty_loop.py"
    with contextlib.closing(Devices()) as devices:
        process = subprocess.Popen(
            [sys.executable, str(script), *devices.paths, str(loop_hz)], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout
        try:
            yield EmptyLoop(devices, ("127.0.0.1", int(process.stdout.readline())), process.pid)
        finally:
            process.kill()
            process.wait()
            process.stdout.close()


def write_request(address: int, *words: int) -> bytes:
    """Return one FC16 as it goes over TCP."""
    pdu = struct.pack(f">BHHB{len(words)}H", 16, address, len(words), 2 * len(words), *words)
    return struct.pack(">HHHB", 1, 0, len(pdu) + 1, 1) + pdu


def ask(master: socket.socket, request: bytes) -> bytes:
    """Send a request and return the bytes of its answer."""
    master.sendall(request)
    return master.recv(512)


def connect(address: tuple[str, int]) -> socket.socket:
    """Return a master's connection, whose requests go out at once."""
    master = socket.create_connection(address)
    master.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return master


def latencies(devices: Devices, bare: Devices, address: tuple[str, int], count: int) -> tuple[list[float], list[float]]:
    """Return the seconds to the wire of voltage mode steps up and down, one every 0.1 s: each moves the output by many counts
    at once; and, in turn with them, those of bare hops: from a write on a pty until its far end sees it, what the machine
    itself takes at this moment. SystemExit where the gateway refuses one: what is on the wire then is no setpoint.
    """
    seconds, hops = [], []
    line = os.open(bare.paths[0], os.O_RDWR | os.O_NOCTTY)
    with connect(address) as master:
        ask(master, write_request(0, 1, 0, 0, 1, 0, 2000))
        for number in range(count):
            time.sleep(0.05)  # idle line: the last setting has been answered long ago
            request = write_request(0, 1, 0, 0, 1, 0, 3000 if number % 2 else 2000)
            seconds += first_byte_after(devices, partial(master.sendall, request))
            if master.recv(512)[FUNCTION] & IS_REFUSED:
                sys.exit(
                    "the gateway has refused a setpoint: as a rule the machine is too busy; end other programs, then again"
                )
            time.sleep(0.05)
            hops += first_byte_after(bare, partial(os.write, line, b"SET 512\r\n"))
        ask(master, write_request(0, 0, 0))
    os.close(line)
    return seconds, hops


def empty_latencies(empty: EmptyLoop, count: int) -> list[float]:
    """Return the seconds to the wire of as many requests to an empty loop."""
    seconds = []
    with connect(empty.address) as master:
        for _ in range(count):
            time.sleep(0.05)
            seconds += first_byte_after(empty.devices, partial(master.sendall, write_request(0, 1, 0, 0, 1, 0, 2000)))
            master.recv(512)
    return seconds


def first_byte_after(devices: Devices, send: Callable[[], object]) -> list[float]:
    """Return the seconds from before `send` until the first byte of a setting; nothing where none arrives."""
    devices.forget()
    sent_s = time.perf_counter()
    send()
    seen_s = devices.next_setting_s(1.0)
    return [] if seen_s is None else [seen_s - sent_s]


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


def bench_latency(loop_hz: int, count: int) -> None:
    """Print how long a setpoint takes to the wire."""
    with gateway_on_devices(loop_hz) as (devices, gateway), contextlib.closing(Devices(has_cell=False)) as bare:
        seconds, hops = latencies(devices, bare, gateway.modbus, count)
    with empty_loop(loop_hz) as empty:
        empties = empty_latencies(empty, count)
    p50, p99 = quantile(seconds, 0.5), quantile(seconds, 0.99)
    goal_s = quantile(hops, 0.99) + GOAL_ABOVE_HOP_S
    verdict = "reached" if p99 <= goal_s else "MISSED"
    print(f"setpoint to first byte, idle unpaced pty, {len(seconds)} of {count} setpoints:")
    print(f"  p50 {p50 * 1e6:.0f} us, p99 {p99 * 1e6:.0f} us, max {max(seconds) * 1e6:.0f} us")
    for name, peer in (("an empty loop, behind it", empties), ("a bare pty hop, in turn with it", hops)):
        print(f"  {name}: p50 {quantile(peer, 0.5) * 1e6:.0f} us, p99 {quantile(peer, 0.99) * 1e6:.0f} us")
    print(f"  goal p99 <= hop's p99 + 250 us = {goal_s * 1e6:.0f} us: {verdict}; ratio to the goal {p99 / goal_s:.2f}")


def bench_load(loop_hz: int, seconds: float) -> None:
    """Print how late the loop is while masters read."""
    with gateway_on_devices(loop_hz) as (_, gateway):
        before = health(gateway.state)
        answered = load(gateway.modbus, seconds, 2000)
        after = health(gateway.state)
    ticks, missed = after["ticks"] - before["ticks"], after["missed_ticks"] - before["missed_ticks"]
    verdict = "reached" if missed <= GOAL_MISSED * ticks else "MISSED"
    print(f"loop {loop_hz} Hz under {answered / seconds:.0f} requests/s for {seconds:g} s:")
    print(f"  lateness p50 < {after['late_p50_us']} us, p99 < {after['late_p99_us']} us")
    print(
        f"  missed ticks {missed:g} of {ticks:g} ({100 * missed / ticks:.2f} %); goal <= {100 * GOAL_MISSED:g} %: {verdict}"
    )


def used_s(process: psutil.Process) -> float:
    """Return the processor time that a process has had, s."""
    times = process.cpu_times()
    return float(times.user + times.system)


def bench_idle(loop_hz: int, seconds: float) -> None:
    """Print what the control process takes while nobody asks anything."""
    with gateway_on_devices(loop_hz) as (_, gateway), empty_loop(loop_hz) as empty:
        process, peer = psutil.Process(gateway.ready["pids"]["control"]), psutil.Process(empty.pid)
        time.sleep(2.0)  # the start is over
        before_s, began_s = (used_s(process), used_s(peer)), time.perf_counter()
        time.sleep(seconds)
        after_s, lasted_s = (used_s(process), used_s(peer)), time.perf_counter() - began_s
        share, empty_share = ((after - before) / lasted_s for before, after in zip(before_s, after_s, strict=True))
        used_bytes = process.memory_full_info().uss
    verdict = "reached" if share <= GOAL_IDLE_SHARE and used_bytes <= GOAL_IDLE_BYTES else "MISSED"
    print(
        f"control process, {loop_hz} Hz, idle for {seconds:g} s: {100 * share:.1f} % of a core, "
        f"{used_bytes / 1e6:.0f} MB of its own"
    )
    print(f"  an empty loop of the same wake-ups, beside it: {100 * empty_share:.1f} %")
    print(f"  goal <= {100 * GOAL_IDLE_SHARE:g} % and {GOAL_IDLE_BYTES / 1e6:.0f} MB: {verdict}")


def main() -> None:
    """Print both benchmarks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--setpoints", type=int, default=600)
    parser.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args()
    with show_progress("loop benchmark"):
        report(f"setpoint to the wire, {options.setpoints} setpoints (1 of 3)")
        bench_latency(100, options.setpoints)
        report(f"idle for {options.seconds:g} s (2 of 3)")
        bench_idle(100, options.seconds)
        report(f"under load for {options.seconds:g} s (3 of 3)")
        bench_load(250, options.seconds)
    wire_s = 9 * 10 / 9600
    print(
        f"on a real wire at 9600 baud the nine bytes of `SET 512` alone take {wire_s * 1e3:.1f} ms more to arrive whole"
    )


if __name__ == "__main__":
    main()
