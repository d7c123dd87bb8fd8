#!/usr/bin/env python3
"""What is on the wire when a process dies, stands still, or a plug is pulled: `tools/bench/process_faults.py [--rounds 50]`.

A gateway on a real rig's file presses with 4 V; both devices are a program at the far ends of two ptys, which shares no code
with it and notes when the last byte of each setting has come. Each round does one thing to it: SIGKILL or SIGSTOP of control, a
pulled plug. Printed: from then until the safe voltage is on the wire whole, and until the gateway
presses again where that is its promise. Bounds are those of gateway/control/supervision; the peer is the bound itself, and how
long a bare pty takes on this machine stands beside it.
"""

import argparse
import contextlib
import io
import os
import pty
import signal
import statistics
import sys
import tempfile
import time
import tty
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.end_to_end.conftest import RunningGateway, start, stop
from tests.end_to_end.own_devices import OwnDevices

STALL_S = 0.1
KILLS_OF_ONE_GATEWAY = 4
"""Five restarts within a minute end it, as they should."""


class Scene:
    """A gateway that presses, and its devices; a new one after every few kills."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self.devices = OwnDevices(Path(self._folder.name))
        self.devices.__enter__()
        self.gateway: RunningGateway = start(Path(self._folder.name) / "state", rig=str(self.devices.rig))

    def close(self) -> None:
        """Stop the gateway, then its devices."""
        stop_quietly(self.gateway)
        self.devices.__exit__()
        self._folder.cleanup()

    def press(self) -> None:
        """Hold 4 V."""
        self.gateway.wait_until(lambda status: bool(status["status_word"] & 2))  # an enable would be accepted
        assert not self.gateway.write(0, 1, 0, 0, 1, 0, 4000).isError()
        self.gateway.wait_until(lambda status: status["state"] == 3)

    def reconnect(self) -> None:
        """Wait until a new control process answers, in OFF."""
        self.gateway.next_ready()
        self.gateway.client.close()
        while not self.gateway.client.connect():
            time.sleep(0.002)
        self.gateway.wait_until(lambda status: status["state"] == 0)


def stop_quietly(gateway: RunningGateway) -> None:
    """Stop it without its log."""
    with contextlib.redirect_stdout(io.StringIO()):  # it prints the log, for tests
        stop(gateway)


def kill_control(scene: Scene, number: int) -> tuple[float, float]:
    """Return (until safe, until another control answers) after this signal to control, s."""
    scene.press()
    began_s = time.monotonic()
    os.kill(scene.gateway.ready["pids"]["control"], number)
    safe_s = scene.devices.until_safe(began_s)
    scene.reconnect()
    return safe_s, time.monotonic() - began_s


def pull_plug(scene: Scene) -> tuple[float, float]:
    """Return (0, until the safe voltage is the first word to what is plugged in) after the plug is back, s."""
    scene.press()
    scene.devices.pull_output()
    scene.gateway.wait_until(lambda status: status["state"] == 4)
    scene.devices.plug_output()
    plugged_s = time.monotonic()
    safe_s = scene.devices.until_safe(plugged_s)
    assert scene.devices.settings_since(plugged_s)[0].voltage_v == 0.0, "the first word was not safe"
    scene.gateway.wait_until(lambda _: not scene.gateway.write(0, 2, 0).isError(), within_s=5.0)
    scene.gateway.wait_until(lambda status: status["state"] == 0)
    return safe_s, time.monotonic() - plugged_s


def run(rounds: int, act: Callable[[Scene], tuple[float, float]], per_gateway: int) -> list[tuple[float, float]]:
    """Return what act measured, so many times, on a new gateway after every few."""
    figures: list[tuple[float, float]] = []
    while len(figures) < rounds:
        scene = Scene()
        try:
            for _ in range(min(per_gateway, rounds - len(figures))):
                figures.append(act(scene))
                print(f"\r{len(figures)} of {rounds}", end="", file=sys.stderr, flush=True)
        finally:
            scene.close()
    print("\r", end="", file=sys.stderr)
    return figures


def row(name: str, bound_s: float | None, values_s: list[float]) -> str:
    """Return a line of the table."""
    values_s = sorted(values_s)
    p99_s = values_s[min(len(values_s) - 1, int(0.99 * len(values_s)))]
    kept = "" if bound_s is None else f"{bound_s * 1e3:.0f} ms: {'kept' if p99_s <= bound_s else 'MISSED'}"
    middle_s = statistics.median(values_s)
    figures = " | ".join(f"{1e3 * each:.0f} ms" for each in (middle_s, p99_s, values_s[-1]))
    return f"| {name} | {len(values_s)} | {figures} | {kept} |"


def bare_pty(rounds: int = 300) -> list[float]:
    """Measure how long one byte takes from one end of a pty to the other on this machine, s."""
    device, client = pty.openpty()
    tty.setraw(device)
    tty.setraw(client)
    took_s = []
    for _ in range(rounds):
        began_s = time.monotonic()
        os.write(client, b"x")
        os.read(device, 1)
        took_s.append(time.monotonic() - began_s)
    os.close(device)
    os.close(client)
    return took_s


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=50, help="of each row")
    rounds = parser.parse_args().rounds
    print("| what happens while 4 V are out | n | median | p99 | worst | bound at p99 |")
    print("| --- | --- | --- | --- | --- | --- |")
    print(row("a byte through a bare pty", None, bare_pty()), flush=True)
    for word, number, bound_s in (("SIGKILL", signal.SIGKILL, 0.025), ("SIGSTOP", signal.SIGSTOP, STALL_S + 0.04)):
        figures = run(rounds, lambda scene, number=number: kill_control(scene, number), KILLS_OF_ONE_GATEWAY)
        print(row(f"{word} of control: safe voltage on the wire", bound_s, [safe_s for safe_s, _ in figures]))
        print(row(f"{word} of control: answers again", 2.0, [again_s for _, again_s in figures]), flush=True)
    pulled = run(rounds, pull_plug, rounds)
    print(row("the output's plug comes back: safe voltage first", 2.2, [safe_s for safe_s, _ in pulled]))
    print(row("the output's plug comes back: reset, ready", 4.0, [again_s for _, again_s in pulled]))


if __name__ == "__main__":
    main()
