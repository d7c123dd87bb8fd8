# ruff: noqa: E402  tools/paper must be found before it is imported
"""What each reversal policy gets wrong on the twin: full loop, partial reversals, chatter, beside a first study of it.

    .venv/bin/python tools/bench/reversal.py                # copies 0..4 of the paper's rig, virtual time, half a minute
    .venv/bin/python tools/bench/reversal.py --seeds 0      # the rig itself
    .venv/bin/python tools/bench/reversal.py --json

Each copy is calibrated with its cell's noise: ladder 0-5-0 V, ten groups, order 2, and a minor-loop walk of some 150
points. Then every policy commands the same setpoints without any feedback, each until the twin has settled; errors are true
force minus setpoint, over all copies. The walk of partial reversals is not the one that was fitted. "largest step" is of the
voltage between two setpoints, which are 1 N apart, or 0.1 N in chatter. The first study (figures written
here as it gave them; it is not in this repository) had another plant, without noise.
The twin's friction is Maxwell slip on the travel, which is kin to the model: a real rig will not fit it as well.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).resolve().parents[1])]
from paper.experiments.calibration import (
    MINOR_READINGS,
    READ_ONCE,
    STAIR_V,
    TURNS_V,
    ladder_of,
    noise_n,
    quiet_twin,
    stairs_between,
)
from paper.experiments.rigs import copy_of
from paper.paper_values import GROUPS, LADDER_STEP_V, LADDER_TOP_V

from gateway.bsfm import Bsfm
from gateway.bsfm.fit.branch_fit import fit
from gateway.bsfm.ladder.measured_ladder import ladder_plan
from gateway.bsfm.slip.slip_fit import Walk, compare_policies, fit_joint, fit_stops, walk_of
from gateway.cli.diagnosis.progress_line import show_progress
from gateway.progress import reported
from gateway.twin import Plant
from gateway.twin.experiment import Dwell, Floats, settle, staircase

FULL_N: Final = tuple(float(n) for n in (*range(1, 34), *range(32, 0, -1)))
PARTIAL_TURNS_N: Final = (2.0, 30.0, 12.0, 22.0, 8.0, 18.0, 14.0, 26.0, 4.0, 11.0, 6.0, 33.0, 24.0, 28.0, 16.0, 20.0)
CHATTER_N: Final = tuple(20.0 + 0.05 * (-1) ** k for k in range(40))
APPROACH_N: Final = tuple(float(n) for n in range(1, 21))
EXERCISES: Final = ("full 1-33 N", "partial reversals", "chatter 20 +- 0.05 N")
FIRST_STUDY: Final = {
    "branches switched": ((0.32, 1.44), (1.11, 2.82), (1.45, 2.87), 0.9),
    "linear blend": ((0.23, 0.87), (0.46, 1.24), (0.05, 0.13), 0.17),
    "slip, branches kept": None,
    "slip, joint fit": ((0.10, 0.41), (0.32, 0.87), (0.10, 0.26), 0.2),
}


@dataclass(frozen=True, slots=True)
class Score:
    """One policy: (RMS, max) in N per exercise, the largest voltage step, and the first study's row."""

    policy: str
    errors_n: tuple[tuple[float, float], ...]
    largest_step_v: float
    first_study: tuple[tuple[tuple[float, float], ...], float] | None


def calibrate_policies(plant: Plant, seed: int) -> dict[str, Bsfm]:
    """Return every policy's model of this copy, from the same noisy data."""
    one, whole = (ladder_plan(LADDER_TOP_V, LADDER_STEP_V, groups) for groups in (1, GROUPS))
    twin, minor_v = quiet_twin(plant), stairs_between(TURNS_V, STAIR_V)
    group_n, minor_n = (staircase(twin, voltages_v, READ_ONCE) for voltages_v in (one.voltage_v, minor_v))
    noise = noise_n(plant, seed, len(whole) + len(minor_v))
    ladder = ladder_of(whole, np.tile(group_n, GROUPS) + noise[: len(whole)])
    minor = Walk(np.array(minor_v), minor_n + noise[len(whole) :] / np.sqrt(MINOR_READINGS))
    branches = fit(ladder, "bsfm", 2, "tied").branches
    fits = [fit_stops(branches, [minor]), fit_joint(branches, [walk_of(ladder), minor])]
    if not fits[1].joint:
        raise SystemExit(f"copy {seed}: the joint fit led to no usable model")
    return dict(zip(FIRST_STUDY, (row.model for row in compare_policies(branches, fits, minor, minor)), strict=True))


def between(turns_n: Sequence[float]) -> list[float]:
    """Return setpoints 1 N apart from turn to turn."""
    return stairs_between(turns_n, 1.0)


def run_commands(model: Bsfm, plant: Plant, setpoints_n: Sequence[float]) -> tuple[Floats, Floats]:
    """Return (true force - setpoint, voltage) at each setpoint, settled, from a vented tool on the workpiece."""
    twin, memory, last_n = quiet_twin(plant), model.reversal.start(), 0.0
    errors_n, voltages_v = [], []
    for setpoint_n in setpoints_n:
        memory, last_n = model.memory_after(memory, last_n, setpoint_n), setpoint_n
        voltages_v.append(model.voltage_v(setpoint_n, model.branch_share(memory))[0])
        twin.command(voltages_v[-1])
        settle(twin, Dwell())
        errors_n.append(twin.force_n - setpoint_n)
    return np.array(errors_n), np.array(voltages_v)


def run(model: Bsfm, plant: Plant) -> tuple[list[Floats], float]:
    """Return the errors of each exercise and the largest voltage step of all."""
    skipped = {EXERCISES[2]: len(APPROACH_N)}  # the way to the chatter is no chatter
    walks = {
        EXERCISES[0]: FULL_N,
        EXERCISES[1]: between(PARTIAL_TURNS_N),
        EXERCISES[2]: (*APPROACH_N, *CHATTER_N),
    }
    results = {name: run_commands(model, plant, setpoints_n) for name, setpoints_n in walks.items()}
    step_v = max(float(np.abs(np.diff(voltages_v)).max()) for _, voltages_v in results.values())
    return [errors_n[skipped.get(name, 0) :] for name, (errors_n, _) in results.items()], step_v


def scores(seeds: Sequence[int]) -> list[Score]:
    """Return every policy's score over the copies."""
    errors: dict[str, list[list[Floats]]] = {policy: [] for policy in FIRST_STUDY}
    steps_v = dict.fromkeys(FIRST_STUDY, 0.0)
    for seed in reported("copies of the rig", seeds):
        plant = copy_of(seed)
        for policy, model in calibrate_policies(plant, seed).items():
            exercise_errors, step_v = run(model, plant)
            errors[policy].append(exercise_errors)
            steps_v[policy] = max(steps_v[policy], step_v)
    return [_score(policy, errors[policy], steps_v[policy]) for policy in FIRST_STUDY]


def _score(policy: str, copies: list[list[Floats]], step_v: float) -> Score:
    pooled = [np.concatenate(parts) for parts in zip(*copies, strict=True)]
    figures = tuple((float(np.sqrt(np.mean(e**2))), float(np.abs(e).max())) for e in pooled)
    row = FIRST_STUDY[policy]
    return Score(policy, figures, step_v, (row[:3], row[3]) if row else None)


def table(rows: Sequence[Score]) -> str:
    """Return the scores as text."""
    lines = [f"{'RMS / max error in N':24}" + "".join(f"{name:>22}" for name in EXERCISES) + f"{'largest step':>16}"]
    for score in rows:
        lines.append(_line(score.policy, score.errors_n, score.largest_step_v))
        if score.first_study:
            lines.append(_line("  first study", *score.first_study))
    return "\n".join(lines)


def _line(name: str, figures: Sequence[tuple[float, float]], step_v: float) -> str:
    cells = "".join(f"{f'{rms:.2f} / {largest:.2f}':>22}" for rms, largest in figures)
    return f"{name:24}{cells}{f'{step_v:.2f} V':>16}"


def main() -> int:
    """Print the table, or JSON."""
    parser = argparse.ArgumentParser(description="errors of the reversal policies on the twin, without feedback")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3, 4], help="copies of the rig; 0 is the rig")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    with show_progress("reversal policies"):
        rows = scores(arguments.seeds)
    if arguments.json:
        print(json.dumps({"seeds": arguments.seeds, "scores": [asdict(row) for row in rows]}, indent=2))
    else:
        print(f"copies {', '.join(map(str, arguments.seeds))} of the paper's rig, cell noise in the calibration\n")
        print(table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
