#!/usr/bin/env python3
"""What the residual watch takes of the machine: `tools/bench/watch.py [--hours 1] [--reference] [--live SECONDS]`.

Without --live: the watch with its real search, in virtual time, beside a healthy demo machine that moves between random
settings, 100 rows a second; processor and memory are those of this process, libraries included. With --reference: compared
with a reference recording of that machine, whose friction grows after half of the time. With --live: the watch of a
running demo gateway, as the kernel counts it; on a busy machine its idle class gets next to nothing.
"""

import argparse
import math
import os
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import gateway.diagnosis  # noqa: F401  # all steps, before the first loop is compiled
from gateway.cli.diagnosis.progress_line import show_progress
from gateway.profiles import load_rig
from gateway.progress import report
from gateway.recording import Recorder
from gateway.recording.ring import RingReader, SampleRing
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.twin.plant import with_value
from gateway.twin.replay.replay import Drive, Replay
from gateway.watch.memory import resident_mb
from gateway.watch.processor_budget import ProcessorBudget
from gateway.watch.reference_recording import keep_reference_recording
from gateway.watch.watch_process import make_watch, work_gently
from tools.bench.harness.running_gateway import running_gateway

SEED = 5
ROW_S = 0.01
OPTIONS = {"rig": "demo", "simulated": True, "window_s": 60.0, "every_s": 20.0}


class Machine:
    """The demo rig's plant, which writes what it does into a ring."""

    def __init__(self, descriptor: int) -> None:
        self.ring = SampleRing(descriptor, COLUMNS)
        self.rng = np.random.default_rng(SEED)
        self.plant = load_rig("demo", simulated=True).plant
        self.now_s = 0.0

    def wear(self) -> None:
        """Have three times the friction from now on."""
        self.plant = with_value(self.plant, "friction", "coulomb_n", 3.0 * self.plant.friction.coulomb_n)

    def record(self, lasts_s: float, state: Path) -> None:
        """Keep so many seconds as the rig's reference."""
        recorder = Recorder(state / "recordings", {"rig": "demo"}, COLUMNS)
        self.work(lasts_s, recorder.append)
        recorder.close()
        keep_reference_recording(state, recorder.path)

    def work(self, lasts_s: float, append: Callable[[tuple[float, ...]], None] | None = None) -> None:
        """Go on for some seconds; every stretch begins and ends at rest, so that they fit together. append: takes the rows;
        None: the ring."""
        time_s = np.arange(0.0, lasts_s, ROW_S)
        levels_v = self.rng.uniform(0.5, 4.5, math.ceil(lasts_s))
        is_at_rest = (time_s < 1.0) | (time_s > lasts_s - 2.0)
        command_v = np.where(is_at_rest, 0.0, levels_v[time_s.astype(int)])
        force_n = Replay(Drive(time_s=time_s, command_v=command_v)).run([self.plant]).reading_n[0]
        force_n = force_n + self.rng.normal(0.0, self.plant.cell.noise_n, time_s.size)
        for at_s, volts, newtons in zip(self.now_s + time_s, command_v, force_n, strict=True):
            row = {"time_s": at_s, "command_v": volts, "force_n": newtons}
            (append or self.ring.append)(tuple(float(row.get(name, 0.0)) for name in COLUMNS))
        self.now_s += lasts_s


def run_virtual(hours: float, state: str, *, with_reference: bool) -> None:
    """Watch for some hours of virtual time; print what that took."""
    descriptor = os.memfd_create("ring")
    machine, budget = Machine(descriptor), ProcessorBudget()
    if with_reference:
        machine.record(70.0, Path(state))
    with work_gently():
        watch, _ = make_watch(RingReader(descriptor), OPTIONS | {"state": state})
    watch._clock = lambda: machine.now_s
    machine.work(80.0)
    watched_s, first_s, last_s, told_s = 0.0, machine.now_s, machine.now_s, machine.now_s
    print(f"{'hours':>6} {'looks':>6} {'searches':>8} {'processor':>10} {'share':>7} {'memory':>8} {'peak':>8}")
    half_s = first_s + hours * 1800.0 if with_reference else math.inf
    while machine.now_s < first_s + hours * 3600.0:
        report("virtual time, s", round(machine.now_s - first_s), round(hours * 3600.0))
        if machine.now_s >= half_s:
            half_s = math.inf
            machine.wear()
        began_s = time.process_time()
        with work_gently():
            watch.check_newest_window()
        spent_s = time.process_time() - began_s
        watched_s += spent_s
        rest_s = budget.pause_s(OPTIONS["every_s"], machine.now_s - last_s, spent_s)
        last_s = machine.now_s
        machine.work(rest_s + spent_s)
        if machine.now_s - told_s >= hours * 360.0:
            told_s = machine.now_s
            peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            lasted_s = machine.now_s - first_s
            print(
                f"{lasted_s / 3600:6.2f} {watch.counters['looks']:6.0f} {watch.counters['judged']:8.0f} {watched_s:8.1f} s "
                f"{watched_s / lasted_s:7.2%} {resident_mb():5.0f} MB {peak_mb:5.0f} MB",
                flush=True,
            )
    print(f"published: {watch.published.cause.name} {watch.published.sentence}")


def run_live(lasts_s: float) -> None:
    """Watch the watch of a running gateway."""
    draw = random.Random(SEED)
    with running_gateway("demo", told=subprocess.DEVNULL) as gateway:
        where = ["--gateway", ":".join(map(str, gateway.modbus))]
        began_s, told_s = time.monotonic(), 0.0
        while (now_s := time.monotonic() - began_s) < lasts_s:
            words = [f"force_setpoint={draw.uniform(4, 40):.1f}", "control_word=1"]
            subprocess.run([sys.executable, "-m", "gateway", "write", *words, *where], check=True, capture_output=True)
            if now_s - told_s >= 20.0:
                told_s = now_s
                spent_s, memory = figures_of(watch_of(gateway.state))
                print(f"{now_s:6.0f} s: {spent_s:6.1f} s, {spent_s / now_s:.2%} of a core, {memory}", flush=True)
            time.sleep(1.0)


def watch_of(state: Path) -> Path:
    """Return the folder in /proc of the watch of the gateway with this state directory."""
    for process in Path("/proc").glob("[0-9]*"):
        line = (process / "cmdline").read_text()
        if "watch_process" in line and str(state) in line:
            return process
    raise SystemExit("the gateway has no watch")


def figures_of(process: Path) -> tuple[float, str]:
    """Return seconds of processor, and memory now and at most."""
    ticks = (process / "stat").read_text().rpartition(")")[2].split()[11:13]
    lines = (process / "status").read_text().splitlines()
    memory = " ".join(" ".join(line.split()) for line in lines if line.startswith(("VmRSS", "VmHWM")))
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK"), memory


def main() -> None:
    """Print processor share and memory."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=1.0, help="of virtual time")
    parser.add_argument("--reference", action="store_true", help="compare with a reference recording")
    parser.add_argument("--live", type=float, metavar="SECONDS", help="a running gateway instead")
    options = parser.parse_args()
    if options.live:
        run_live(options.live)
        return
    with tempfile.TemporaryDirectory() as state, show_progress("watch"):
        run_virtual(options.hours, state, with_reference=options.reference)


if __name__ == "__main__":
    sys.exit(main())
