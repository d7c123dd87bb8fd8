"""What one call of the model costs, against a cubic polynomial in plain Python, all in the same run.

    python tools/bench/model.py [--json] [--rounds 7]

Rows: plain Python (the control loop's way), numpy scalars, numpy arrays per element, numba and C where they can be had.
Each figure is the lowest of several rounds: the lowest is the code, the rest the machine. More about the C code, beside a
cubic in C: model_c.py.
"""

import argparse
import json
import sys
import timeit
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
import model_c

from gateway.bsfm import RationalBezier
from gateway.cli.diagnosis.progress_line import show_progress
from gateway.progress import reported

ORDERS = (2, 5, 15)
ELEMENTS = 10_000
FORWARD_V, INVERSE_N = 2.3, 21.7


@dataclass(frozen=True, slots=True)
class Cost:
    """nanoseconds per call, or per element for arrays; ratio: to the clamped cubic in plain Python of this run."""

    way: str
    what: str
    order: int
    nanoseconds: float
    ratio: float = 0.0


def curve(order: int) -> RationalBezier:
    """Return an increasing curve of this order."""
    handles = [0.5 + 37.5 * i / order + (1.5 if 0 < i < order else 0.0) for i in range(order + 1)]
    return RationalBezier(0.0, 5.0, handles, [1.0 + 0.15 * (i % 3) for i in range(order + 1)])


def cubic(x: float) -> float:
    """Return the force by a polynomial model, clamped to the range (Horner): what one call of it would cost."""
    if x < 0.0:
        x = 0.0
    elif x > 5.0:
        x = 5.0
    return ((0.013 * x - 0.21) * x + 8.1) * x + 0.5


def bare_cubic(x: float) -> float:
    """Return the cubic without the clamp."""
    return ((0.013 * x - 0.21) * x + 8.1) * x + 0.5


def nanoseconds(call: Callable[[Any], object], argument: Any, rounds: int) -> float:
    """Return the time of one call, ns: the best of several rounds."""
    timer = timeit.Timer("call(argument)", globals={"call": call, "argument": argument})
    number = max(1, int(0.02 / max(timer.timeit(1), 1e-7)))
    return min(timer.repeat(rounds, number)) / number * 1e9


def plain_python(rounds: int) -> Iterator[Cost]:
    """Yield the costs of one call in plain Python."""
    yield Cost("python", "cubic", 3, nanoseconds(cubic, FORWARD_V, rounds))
    yield Cost("python", "cubic without clamp", 3, nanoseconds(bare_cubic, FORWARD_V, rounds))
    for order in ORDERS:
        one = curve(order)
        yield Cost("python", "forward", order, nanoseconds(one.value, FORWARD_V, rounds))
        yield Cost("python", "inverse", order, nanoseconds(one.inverse, INVERSE_N, rounds))


def numpy_scalars(rounds: int) -> Iterator[Cost]:
    """Yield the costs of one call with a numpy scalar."""
    yield Cost("numpy scalar", "cubic", 3, nanoseconds(cubic, np.float64(FORWARD_V), rounds))
    for order in ORDERS:
        one = curve(order)
        yield Cost("numpy scalar", "forward", order, nanoseconds(one.value, np.float64(FORWARD_V), rounds))
        yield Cost("numpy scalar", "inverse", order, nanoseconds(one.inverse, np.float64(INVERSE_N), rounds))


def numpy_arrays(rounds: int) -> Iterator[Cost]:
    """Yield the costs per element of an array."""
    places = np.linspace(0.0, 5.0, ELEMENTS)
    for order in ORDERS:
        yield Cost("numpy array", "forward", order, nanoseconds(curve(order).value, places, rounds) / ELEMENTS)


def numba_compiled(rounds: int) -> Iterator[Cost]:
    """Return the costs of the same formulas compiled, if numba is here: cubic, forward by Horner in r, order-2 inverse."""
    if find_spec("numba") is None:
        return
    compiled = import_module("numba").njit(cache=False)
    fast_cubic = compiled(bare_cubic)
    fast_cubic(FORWARD_V)
    yield Cost("numba", "cubic without clamp", 3, nanoseconds(fast_cubic, FORWARD_V, rounds))
    for order in ORDERS:
        one = curve(order)
        totals = np.array([w for _, w in one._below.pairs])
        products = np.array([a for a, _ in one._below.pairs])

        def forward(x: float, products: Any = products, totals: Any = totals) -> float:
            r, numerator, denominator = x / (5.0 - x), 0.0, 0.0
            for i in range(len(totals)):
                numerator = numerator * r + products[i]
                denominator = denominator * r + totals[i]
            return numerator / denominator

        fast = compiled(forward)
        fast(FORWARD_V)
        yield Cost("numba", "forward", order, nanoseconds(fast, FORWARD_V, rounds))


def compiled_c(_rounds: int) -> Iterator[Cost]:
    """Return the costs of the exported C, gcc -O2; nothing where there is no compiler, and say so."""
    if which("gcc") is None:
        print("SKIPPED: C needs gcc", file=sys.stderr)
        return
    for cost in model_c.costs("gcc"):
        if cost.name != "demo" and cost.order in ORDERS:
            yield Cost("C, gcc -O2", "cubic", 3, cost.cubic_ns)
            yield Cost("C, gcc -O2", "forward", cost.order, cost.forward_ns)
            yield Cost("C, gcc -O2", "inverse", cost.order, cost.inverse_ns)


SOURCES: tuple[Callable[[int], Iterator[Cost]], ...] = (
    plain_python,
    numpy_scalars,
    numpy_arrays,
    numba_compiled,
    compiled_c,
)


def measure(rounds: int) -> list[Cost]:
    """Measure everything."""
    costs = [cost for source in reported("ways to calculate", SOURCES) for cost in source(rounds)]
    base = costs[0].nanoseconds
    return [Cost(cost.way, cost.what, cost.order, cost.nanoseconds, cost.nanoseconds / base) for cost in costs]


def main() -> None:
    """Print the table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--rounds", type=int, default=7)
    arguments = parser.parse_args()
    with show_progress("model benchmark"):
        costs = measure(arguments.rounds)
    if arguments.json:
        print(json.dumps([asdict(cost) for cost in costs]))
        return
    print(f"{'way':<14}{'what':<22}{'order':>5}{'ns':>10}{'x cubic':>9}")
    for cost in costs:
        print(f"{cost.way:<14}{cost.what:<22}{cost.order:>5}{cost.nanoseconds:>10.1f}{cost.ratio:>9.2f}")


if __name__ == "__main__":
    main()
