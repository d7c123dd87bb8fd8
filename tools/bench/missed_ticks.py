#!/usr/bin/env python3
"""What onlookers cost the control loop: `tools/bench/missed_ticks.py [--viewers 20] [--seconds 30]`.

A demo gateway holds 12 N and publishes over MQTT: first with nobody at its page, then with so many open streams of events that
are read as a browser reads them, then with the MQTT broker (mosquitto, where it is installed) killed and started again besides.
Printed for each: missed ticks, the processor time of control and of the page (in percent of a core), and what the streams
carry. On a busy machine ticks are missed in all of them; what counts is the difference.
"""

import argparse
import contextlib
import selectors
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gateway.cli.control_socket import ask
from gateway.profiles import shipped_profiles_folder
from tools.bench.harness.running_gateway import RunningGateway, running_gateway

MOSQUITTO = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
BROKER_LIVES_S = 3.0  # and is away as long: both ends of an outage several times in a stretch of 30 s


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


def measure(gateway: RunningGateway, viewers: int, seconds: float) -> dict[str, float]:
    """Return what one stretch of time has cost; share: in percent of one core."""
    processes = {name: psutil.Process(gateway.ready["pids"][name]) for name in ("control", "web")}
    before = {name: sum(one.cpu_times()[:2]) for name, one in processes.items()}
    loop = ask(gateway.state, {"do": "state"})["loop"]
    received = watch(tuple(gateway.ready["web"]), viewers, seconds)
    after = ask(gateway.state, {"do": "state"})["loop"]
    ticks, missed = after["ticks"] - loop["ticks"], after["missed"] - loop["missed"]
    used = {name: 100.0 * (sum(one.cpu_times()[:2]) - before[name]) / seconds for name, one in processes.items()}
    return {"missed_percent": 100.0 * missed / ticks, "kB_per_s": received / seconds / 1000.0} | {
        f"{name}_percent": share for name, share in used.items()
    }


@contextlib.contextmanager
def dying_broker(folder: Path, port: int) -> Iterator[list[int]]:
    """Start the broker, kill it, start it again, until the block ends. Yields the times of death's growing list, of pids."""
    assert MOSQUITTO
    settings, ended, died = folder / "mosquitto.conf", threading.Event(), list[int]()
    settings.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\n")

    def live_and_die() -> None:
        while not ended.is_set():
            broker = subprocess.Popen([MOSQUITTO, "-c", settings], stderr=subprocess.DEVNULL)
            ended.wait(BROKER_LIVES_S)
            broker.kill()
            broker.wait()
            died.append(broker.pid)
            ended.wait(BROKER_LIVES_S)

    thread = threading.Thread(target=live_and_die)
    thread.start()
    try:
        yield died
    finally:
        ended.set()
        thread.join()


def rig_with_broker(folder: Path, port: int) -> Path:
    """Write the demo rig with an `mqtt:` section; return its file."""
    demo = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    rig = folder / "demo.yaml"
    rig.write_text(f"{demo}mqtt: {{host: 127.0.0.1, port: {port}, sparkplug: {{group: bench}}}}\n", encoding="utf-8")
    return rig


def measure_each(gateway: RunningGateway, folder: Path, port: int, asked: argparse.Namespace) -> Iterator[str]:
    """Yield a line for each stretch."""
    for count in (0, asked.viewers):
        yield line(f"{count} viewers", measure(gateway, count, asked.seconds))
    if MOSQUITTO is None:
        yield "no mosquitto here (apt-get install mosquitto): the broker that dies was not tried"
        return
    with dying_broker(folder, port) as died:
        figures = measure(gateway, asked.viewers, asked.seconds)
    yield line(f"{asked.viewers} viewers, the broker died {len(died)} times", figures)


def line(name: str, figures: dict[str, float]) -> str:
    """Return a stretch's figures as a line."""
    return f"{name:>39}  " + "  ".join(f"{key} {value:.3f}" for key, value in figures.items())


def run(asked: argparse.Namespace) -> Iterator[str]:
    """Start a gateway that holds 12 N, and yield its lines."""
    with tempfile.TemporaryDirectory() as name, socket.socket() as free:
        folder = Path(name)
        free.bind(("127.0.0.1", 0))  # nobody listens: the broker is away at first
        port = free.getsockname()[1]
        free.close()
        with running_gateway(str(rig_with_broker(folder, port)), "--sim", "--web", "127.0.0.1:0") as gateway:
            gateway.hold()
            yield from measure_each(gateway, folder, port, asked)


def main() -> None:
    """Print each stretch."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--viewers", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=30.0)
    for told in run(parser.parse_args()):
        print(told, flush=True)


if __name__ == "__main__":
    main()
