"""What a scan over orders 1 to 5 of a full ladder costs (1010 points), beside scipy.optimize.least_squares in the same run.

    python tools/bench/fit.py [--json] [--rounds 3]

scipy fits the same residuals by its trust region with derivatives by differences, from one start, all handles and weights free;
the fit here screens many starts and solves for the handles exactly. Processor time, the lowest of several rounds; and what
each leaves, for a fast fit that is worse would be none.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gateway.bsfm.fit.branch_fit import fit_orders
from gateway.bsfm.fit.projected_problem import Floats, bernstein
from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.cli.diagnosis.progress_line import show_progress
from gateway.progress import report, reported

ORDERS: Final = range(1, 6)
GROUPS, STAIRS, SEED = 10, 51, 13
NOISE_N: Final = 0.1


def made_up_ladder() -> Ladder:
    """Return ten groups up and down over 0..5 V, a loop of some newtons, with noise."""
    rng = np.random.default_rng(SEED)
    up_v = np.linspace(0.0, 5.0, STAIRS)
    voltage_v = np.tile(np.concatenate([up_v, up_v[-2::-1]]), GROUPS)
    direction = np.tile(np.concatenate([np.ones(STAIRS), -np.ones(STAIRS - 1)]), GROUPS).astype(int)
    t = voltage_v / 5.0
    force_n = 36.0 * t**1.1 - direction * 6.0 * t * (1.0 - t) * (1.0 + t)
    group = np.repeat(np.arange(GROUPS), 2 * STAIRS - 1)
    return Ladder(voltage_v, force_n + rng.normal(0.0, NOISE_N, t.size), direction, group)


def fit_by_scipy(ladder: Ladder, order: int) -> float:
    """Return the RMS that scipy leaves with both branches joined at their ends, N."""
    t, up = ladder.voltage_v / 5.0, ladder.direction > 0
    basis = bernstein(t, order)
    inner = max(order - 1, 0)

    def branch(handles: Floats, weights: Floats) -> Floats:
        return np.asarray(basis @ (weights * handles) / (basis @ weights))

    def residuals(numbers: Floats) -> Floats:
        ends, rising, falling = numbers[:2], numbers[2 : 2 + inner], numbers[2 + inner : 2 + 2 * inner]
        logs = numbers[2 + 2 * inner :].reshape(2, order)
        handles = [np.concatenate([ends[:1], part, ends[1:]]) for part in (rising, falling)]
        weights = [np.concatenate([[1.0], np.exp(part)]) for part in logs]
        return np.asarray(np.where(up, *map(branch, handles, weights)) - ladder.force_n)

    straight = np.linspace(0.0, 36.0, order + 1)
    start = np.concatenate([[0.0, 36.0], straight[1:-1], straight[1:-1], np.zeros(2 * order)])
    return float(np.sqrt(2.0 * least_squares(residuals, start, max_nfev=150).cost / len(ladder)))


def lowest_s(call: Callable[[], object], rounds: int) -> float:
    """Return the lowest processor time of a call, s."""
    spent = []
    for _ in range(rounds):
        begun_s = time.process_time()
        call()
        spent.append(time.process_time() - begun_s)
    return min(spent)


def main() -> None:
    """Print both, and the ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--rounds", type=int, default=3)
    chosen = parser.parse_args()
    ladder = made_up_ladder()
    ours_s = lowest_s(lambda: fit_orders(ladder, "bsfm", ORDERS), chosen.rounds)
    with show_progress("fit benchmark"):
        report("scipy least_squares: timing")
        scipy_s = lowest_s(lambda: [fit_by_scipy(ladder, order) for order in ORDERS], chosen.rounds)
        ours_n = [result.rms_n for result in fit_orders(ladder, "bsfm", ORDERS)]
        scipy_n = [fit_by_scipy(ladder, order) for order in reported("scipy least_squares: orders", ORDERS)]
    facts = {"points": len(ladder), "ours_s": ours_s, "scipy_s": scipy_s, "ratio": ours_s / scipy_s}
    if chosen.json:
        print(json.dumps(facts | {"ours_rms_n": ours_n, "scipy_rms_n": scipy_n}))
        return
    print(f"orders 1 to 5 over {len(ladder)} points, processor time")
    for name, spent_s, left_n in (("ours", ours_s, ours_n), ("scipy least_squares", scipy_s, scipy_n)):
        print(
            f"{name:20} {spent_s:6.3f} s  x scipy {spent_s / scipy_s:5.2f}  RMS {'  '.join(f'{n:.4f}' for n in left_n)} N"
        )


if __name__ == "__main__":
    main()
