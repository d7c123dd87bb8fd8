#!/usr/bin/env python3
"""What is on the wire when a process dies or stands still, or a plug is pulled: `tools/bench/faults/process_faults.py`.

A gateway on a real rig's file presses with 4 V; both devices are a program at the far ends of two ptys, which shares no code
with it and notes when the last byte of each setting has come. Each round does one thing to it (harness/pressing_gateway.py):
SIGKILL or SIGSTOP of control, of control while it records, of the guardian, of the residual watch; a pulled plug. Printed: from
then until the safe voltage is on the wire whole, and until the gateway presses again where that is its promise; of what
must not be felt, that it was not. Bounds are those of gateway/control/supervision; the peer is the bound itself, and how long
a bare pty takes on this machine stands beside it.
"""

import argparse
import os
import pty
import signal
import statistics
import sys
import time
import tty
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from gateway.processes.scheduling.withheld_time import most_growth, read_stolen_s
from tests.gate.tried_again import STOLEN_S
from tools.bench.harness.pressing_gateway import (
    Scene,
    Times,
    fault_control,
    fault_recording,
    fault_watch,
    kill_guardian,
    pull_plug,
    stop_guardian,
)

STALL_S = 0.1
KILL_S, STOP_S, READY_S = 0.025, STALL_S + 0.04, 2.0
KILLS_OF_ONE_GATEWAY = 4
"""Five restarts within a minute end it, as they should."""
MANY = 10_000


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing to do. safe_s, ready_s: bounds, None where the force must not feel it; per_gateway: how often to the same
    one; is_watched: with the residual watch."""

    name: str
    act: Callable[[Scene], Times]
    safe_s: float | None
    ready_s: float | None
    per_gateway: int = KILLS_OF_ONE_GATEWAY
    is_watched: bool = False


def faults() -> tuple[Fault, ...]:
    """Return everything that is done."""
    bounds = {signal.SIGKILL: KILL_S, signal.SIGSTOP: STOP_S}
    of_control = [
        Fault(f"{number.name} of control{more}", partial(act, number=number), bound_s, READY_S)
        for act, more in ((fault_control, ""), (fault_recording, " while it records"))
        for number, bound_s in bounds.items()
    ]
    return (
        *of_control,
        Fault("SIGKILL of the guardian", kill_guardian, KILL_S, READY_S),
        Fault("SIGSTOP of the guardian for 0.25 s", stop_guardian, None, None, MANY),
        Fault("SIGKILL of the residual watch", partial(fault_watch, number=signal.SIGKILL), None, None, 1, True),
        Fault(
            "SIGSTOP of the residual watch for 0.25 s",
            partial(fault_watch, number=signal.SIGSTOP),
            None,
            None,
            MANY,
            True,
        ),
        Fault("the output's plug comes back", pull_plug, 2.2, 4.0, MANY),
    )


def run(fault: Fault, rounds: int) -> list[Times]:
    """Return what was measured, so many times, on a new gateway after every few. A round that the machine's host has spoiled is
    made again, on a new one; as many of those as rounds are a failure."""
    figures: list[Times] = []
    spoiled = 0
    while len(figures) < rounds:
        assert spoiled < rounds, (
            f"the machine's host took a processor away in {spoiled} rounds, {len(figures)} were left"
        )
        scene = Scene(is_watched=fault.is_watched)
        try:
            for _ in range(min(fault.per_gateway, rounds - len(figures))):
                times = undisturbed(fault, scene)
                if times is None:
                    spoiled += 1
                    break
                figures.append(times)
                print(f"\r{fault.name}: {len(figures)} of {rounds}", end="", file=sys.stderr, flush=True)
        except BaseException:
            print(f"\n{scene.close()}", file=sys.stderr)
            raise
        scene.close()
    print(f"\r{fault.name}: {len(figures)}, and {spoiled} made again (steal)", file=sys.stderr)
    return figures


def undisturbed(fault: Fault, scene: Scene, stolen_s: Callable[[], dict[str, float]] = read_stolen_s) -> Times | None:
    """Return the times of one round, or None where it failed or took too long while the host of this virtual machine kept a
    processor away: control ends itself when its loop comes by too late, so this says nothing of the fault."""
    before = stolen_s()
    try:
        times = fault.act(scene)
    except Exception:
        if most_growth(stolen_s(), before) < STOLEN_S:
            raise
        return None
    bounds = (fault.safe_s, fault.ready_s)
    is_kept = all(bound_s is None or time_s <= bound_s for time_s, bound_s in zip(times, bounds, strict=True))
    return times if is_kept or most_growth(stolen_s(), before) < STOLEN_S else None


def p99(values: Sequence[float]) -> float:
    """Return the value that one in a hundred is above."""
    return sorted(values)[min(len(values) - 1, int(0.99 * len(values)))]


def row(name: str, bound_s: float | None, values_s: Sequence[float]) -> str:
    """Return a line of the table."""
    kept = "" if bound_s is None else f"{bound_s * 1e3:.0f} ms: {'kept' if p99(values_s) <= bound_s else 'MISSED'}"
    figures = " | ".join(f"{1e3 * each:.0f} ms" for each in (statistics.median(values_s), p99(values_s), max(values_s)))
    return f"| {name} | {len(values_s)} | {figures} | {kept} |"


def rows(fault: Fault, times: Sequence[Times]) -> list[str]:
    """Return the lines of one fault."""
    if fault.safe_s is None:
        return [f"| {fault.name}: 4 V stay out | {len(times)} | | | | kept each time |"]
    return [
        row(f"{fault.name}: safe voltage on the wire", fault.safe_s, [safe_s for safe_s, _ in times]),
        row(f"{fault.name}: ready again", fault.ready_s, [ready_s for _, ready_s in times]),
    ]


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
    parser.add_argument("--only", default="", help="faults whose name holds this")
    arguments = parser.parse_args()
    print("| what happens while 4 V are out | n | median | p99 | worst | bound at p99 |")
    print("| --- | --- | --- | --- | --- | --- |")
    print(row("a byte through a bare pty", None, bare_pty()), flush=True)
    for fault in faults():
        if arguments.only in fault.name:
            print("\n".join(rows(fault, run(fault, arguments.rounds))), flush=True)


if __name__ == "__main__":
    main()
