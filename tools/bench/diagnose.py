#!/usr/bin/env python3
"""How long a diagnosis takes as a command, and its memory: `.venv/bin/python tools/bench/diagnose.py [RECORDING...]`.

Each figure is `force-gateway diagnose` in a process of its own, imports included; what it compiles once is compiled before.
Processor: of all its threads, what a busy machine stretches least. Without recordings of yours:

    one effect, two or three  the twin with effects that the model does not have, 60 s at 200 Hz, 0.1 N of noise, as CSV
    own                       a gateway's own recordings in virtual time, whose rows are uneven (tests/watch/clean_runs.py)
    four                      four of these under one model
"""

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from gateway.cli.diagnosis.progress_line import show_progress  # noqa: E402
from gateway.diagnosis.model_fit.base_fit import DEFAULT_PLANT  # noqa: E402
from gateway.progress import report, reported  # noqa: E402
from gateway.twin.plant import with_value  # noqa: E402
from gateway.twin.replay.replay import Drive, Replay  # noqa: E402

SEED, ROW_S, LASTS_S, NOISE_N = 11, 0.005, 60.0, 0.1
EFFECTS: Mapping[str, Mapping[str, float]] = {
    "transport-delay": {"regulator.delay_s": 0.014},
    "extra-lag": {"regulator.second_lag_s": 0.028},
    "command-quantisation": {"regulator.command_step_v": 0.25},
    "leak": {"regulator.leak_per_s": 0.011},
    "presliding": {"friction.presliding_m": 1.4e-4},
    "load-dependent-friction": {"friction.load_dependent_n_per_n": 0.028},
    "creep": {"contact.creep_share": 0.055, "contact.creep_s": 5.0},
    "warm-up": {"cell.warm_up_n": 1.2, "cell.warm_up_s": 10.0},
    "sensor-quadratic": {"cell.quadratic_per_n": 0.002},
}
TOGETHER = (
    ("transport-delay", "creep"),
    ("leak", "sensor-quadratic"),
    ("presliding", "extra-lag", "warm-up"),
)
OWN = (("random", 2, 80.0), ("random", 3, 200.0))
FOUR = (("random", 4), ("ladder", 5), ("stairs", 6), ("sine", 7))
MOST_MB = 500


@dataclass(frozen=True)
class Spent:
    """What one command took, and the causes that it named."""

    wall_s: float
    processor_s: float
    memory_mb: float
    causes: tuple[str, ...]


@dataclass(frozen=True)
class Figure:
    """A line of the table. median_s, worst_s: bounds on the wall time, on two idle cores; 0: none."""

    what: str
    runs: Sequence[Spent]
    median_s: float
    worst_s: float

    def line(self, *, busy: bool) -> str:
        """Return the row of the table; of a busy machine without wall times."""
        wall, processor = ([getattr(run, name) for run in self.runs] for name in ("wall_s", "processor_s"))
        bounds = " and ".join(f"{bound:.0f} s" for bound in (self.median_s, self.worst_s) if bound)
        memory_mb = max(run.memory_mb for run in self.runs)
        cells = [f"{statistics.median(spent):.1f} / {max(spent):.1f} s" for spent in (wall, processor)]
        return " | ".join([f"| {self.what}", *cells[busy:], f"{memory_mb:.0f} MB", f"{bounds} |"])


def write_recording(file: Path, effects: Sequence[str]) -> Path:
    """Write 60 s of steps and ramps of a machine with these effects, as CSV."""
    rng = np.random.default_rng(SEED)
    time_s = np.arange(0.0, LASTS_S, ROW_S)
    levels = np.repeat(rng.uniform(0.3, 6.0, 60), time_s.size // 60)
    ramps = np.convolve(levels, np.ones(40) / 40.0, mode="same")
    command_v = np.where((np.arange(time_s.size) // 1000) % 2 == 0, levels, ramps)
    plant = DEFAULT_PLANT
    for path, value in (change for name in effects for change in EFFECTS[name].items()):
        section, name = path.split(".")
        plant = with_value(plant, section, name, value)
    force_n = Replay(Drive(time_s=time_s, command_v=command_v)).run([plant]).reading_n[0]
    columns = np.stack([time_s, force_n + rng.normal(0.0, NOISE_N, time_s.size), command_v], axis=1)
    np.savetxt(file, columns, fmt="%.5f", delimiter=",", header="time_s,force_n,command_v", comments="")
    return file


def own_recording(folder: Path, kind: str, seed: int, lasts_s: float) -> Path:
    """Make a gateway's own recording in virtual time."""
    from tests.watch.clean_runs import recorded

    inside = folder / f"{kind}-{seed}"
    inside.mkdir()
    return Path(recorded(kind, seed, inside, lasts_s))


def measure(files: Sequence[Path]) -> Spent:
    """Diagnose recordings under one model in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "answer.json"
        words = [sys.executable, "-m", "gateway", "diagnose", *map(str, files), "--json", str(out)]
        quiet = [(os.POSIX_SPAWN_OPEN, stream, os.devnull, os.O_WRONLY, 0) for stream in (1, 2)]
        began_s = time.perf_counter()
        process = os.posix_spawn(sys.executable, words, os.environ, file_actions=quiet)
        _, status, used = os.wait4(process, 0)
        wall_s = time.perf_counter() - began_s
        if status:
            raise SystemExit(f"{' '.join(words)} ended with {os.waitstatus_to_exitcode(status)}")
        causes = tuple(cause["name"] for cause in json.loads(out.read_text(encoding="utf-8"))["causes"])
    return Spent(wall_s, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0, causes)


def measure_effects(folder: Path, wanted: Sequence[Sequence[str]]) -> list[Spent]:
    """Diagnose a recording of each set of effects, and say what was named."""
    found = []
    for effects in reported("recordings with hidden effects", wanted):
        found.append(measure([write_recording(folder / f"{'+'.join(effects)}.csv", effects)]))
        tell(" and ".join(effects), found[-1])
    return found


def tell(what: str, spent: Spent) -> None:
    """Print what was found, and the time it took, on stderr."""
    named = ", ".join(spent.causes) or "no cause"
    print(f"  {what}: {spent.wall_s:.1f} s, {spent.processor_s:.1f} s of processor: {named}", file=sys.stderr)


def measure_all(folder: Path) -> list[Figure]:
    """Return every figure; what is compiled once has been."""
    report("compiling what is compiled once")
    measure([write_recording(folder / "first.csv", ["creep"])])
    figures = [
        Figure("one effect, 60 s at 200 Hz", measure_effects(folder, [(name,) for name in EFFECTS]), 2.0, 5.0),
        Figure("two or three effects", measure_effects(folder, TOGETHER), 0.0, 6.0),
    ]
    for (kind, seed, lasts_s), most_s in reported("own recordings", list(zip(OWN, (4.0, 8.0), strict=True))):
        own = measure([own_recording(folder, kind, seed, lasts_s)])
        tell(f"own recording, {kind}, {lasts_s:.0f} s", own)
        figures.append(Figure(f"own recording of {lasts_s:.0f} s", [own], 0.0, most_s))
    four = measure([own_recording(folder, kind, seed, 70.0) for kind, seed in FOUR])
    tell("four own recordings of 70 s", four)
    return [*figures, Figure("four own recordings of 70 s under one model", [four], 0.0, 12.0)]


def main() -> None:
    """Print the table, or the figures of recordings that are given."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--busy", action="store_true", help="other work stretches wall times here: leave them out")
    options = parser.parse_args()
    given, busy = options.recordings, options.busy
    with tempfile.TemporaryDirectory() as folder, show_progress("timing diagnoses"):
        figures = [Figure("given", [measure(given)], 0.0, 0.0)] if given else measure_all(Path(folder))
    heads = ["`force-gateway diagnose`, median / worst", "wall", "of processor", "memory", f"bound: {MOST_MB} MB and"]
    heads = [head for head in heads if not (busy and head == "wall")]
    print(f"| {' | '.join(heads)} |\n|{' --- |' * len(heads)}")
    for figure in figures:
        print(figure.line(busy=busy))
    if given:
        tell("given", figures[0].runs[0])


if __name__ == "__main__":
    main()
