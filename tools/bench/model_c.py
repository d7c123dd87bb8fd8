"""What the generated C costs per call, against a cubic polynomial in C in the same run.

    .venv/bin/python tools/bench/model_c.py [--json] [--compiler gcc]

Compiles the C of the shipped demo calibration and of made-up ones of order 1, 2, 3, 5 and 15 with -O2, each in a
translation unit of its own (nothing can be inlined, as in a controller), and calls it with 1024 inputs spread over the
range in an order that the branch predictor cannot learn. Each figure is the fastest of ROUNDS rounds; the functions take
turns within a round, so that a slow moment of the machine meets all of them. Needs a C compiler; exit 2 without one.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from math import comb
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from gateway.bsfm.c_export.code import c_source
from gateway.bsfm.model import Calibration
from gateway.cli.diagnosis.progress_line import show_progress
from gateway.profiles import load_calibration
from gateway.progress import reported

ORDERS = (1, 2, 3, 5, 15)
ROUNDS = 40
FLAGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror")

CUBIC = """\
float cubic(float x);
float cubic(float x)
{
    return 1.25f + x * (3.5f + x * (0.75f + x * 0.0625f));
}
"""

MAIN = """\
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
#include "@p@.h"

float cubic(float x);

enum { COUNT = 1024, REPEATS = 20, ROUNDS = @rounds@, KINDS = 4 };

static float volts[COUNT];
static float newtons[COUNT];
static volatile float sink;

static double now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

static float once(int kind, @p@_state *state)
{
    float sum = 0.0f;
    float result;
    int i;
    for (i = 0; i < COUNT; ++i) {
        switch (kind) {
        case 0: result = cubic(volts[i]); break;
        case 1: @p@_rising_force(volts[i], &result); break;
        case 2: @p@_rising_voltage(newtons[i], &result); break;
        default: @p@_command(state, newtons[i], &result); break;
        }
        sum += result;
    }
    return sum;
}

int main(void)
{
    static const char *names[KINDS] = { "cubic", "forward", "inverse", "command" };
    double best[KINDS] = { 1e9, 1e9, 1e9, 1e9 };
    @p@_state state;
    int round;
    int kind;
    int i;
    @p@_reset(&state);
    for (i = 0; i < COUNT; ++i) {
        float share = (float)((i * 619) % COUNT) / COUNT;
        volts[i] = @P@_VOLTAGE_MIN_V + share * (@P@_VOLTAGE_MAX_V - @P@_VOLTAGE_MIN_V);
        newtons[i] = @P@_FORCE_MIN_N + share * (@P@_FORCE_MAX_N - @P@_FORCE_MIN_N);
    }
    for (round = 0; round < ROUNDS; ++round) {
        for (kind = 0; kind < KINDS; ++kind) {
            double start = now_ns();
            double spent;
            for (i = 0; i < REPEATS; ++i) {
                sink = once(kind, &state);
            }
            spent = (now_ns() - start) / (REPEATS * COUNT);
            best[kind] = spent < best[kind] ? spent : best[kind];
        }
    }
    for (kind = 0; kind < KINDS; ++kind) {
        printf("%s %.3f\\n", names[kind], best[kind]);
    }
    return @p@_self_test();
}
"""


@dataclass(frozen=True, slots=True)
class Cost:
    """Nanoseconds per call; command is the inverse of both branches with the reversal state."""

    name: str
    order: int
    cubic_ns: float
    forward_ns: float
    inverse_ns: float
    command_ns: float


def make_up_calibration(order: int) -> Calibration:
    """Return a loop of this order, 0 .. 5 V, 0.5 .. 38 N: handles and weights that bend either way, tied ends."""
    shares = [i / order for i in range(order + 1)]
    rising = tuple(0.5 + 37.5 * (share - 0.25 * share * (1.0 - share)) for share in shares)
    falling = tuple(0.5 + 37.5 * (share + 0.25 * share * (1.0 - share)) for share in shares)
    weights = tuple(1.0 + 0.3 * comb(3, i % 4) / 3 for i in range(order + 1))
    return Calibration(
        number=order, name=f"order_{order}", order=order, x0_v=0.0, x1_v=5.0, blend_span_n=3.0, rms_n=0.0, max_n=0.0,
        rising_handles_n=rising, rising_weights=weights, falling_handles_n=falling, falling_weights=weights,
        date_utc="", source="made up for the benchmark", rig="none", data_sha256="",
    )  # fmt: skip


def cost(calibration: Calibration, compiler: str) -> Cost:
    """Compile and run the C of a calibration; the program's own self-test must pass."""
    sources = c_source(calibration)
    prefix = next(name for name in sources if name.endswith(".h")).removesuffix(".h")
    main = MAIN.replace("@p@", prefix).replace("@P@", prefix.upper()).replace("@rounds@", str(ROUNDS))
    with tempfile.TemporaryDirectory() as directory:
        for name, text in {**sources, "cubic.c": CUBIC, "main.c": main}.items():
            Path(directory, name).write_text(text, encoding="ascii")
        units = ["main.c", "cubic.c", f"{prefix}.c"]
        subprocess.run([compiler, *FLAGS, "-o", "bench", *units, "-lm"], cwd=directory, check=True)
        shown = subprocess.run([Path(directory, "bench")], check=True, capture_output=True, text=True).stdout
    figures = {name: float(number) for name, number in (line.split() for line in shown.splitlines())}
    return Cost(calibration.name, calibration.order, *(figures[k] for k in ("cubic", "forward", "inverse", "command")))


def costs(compiler: str = "gcc") -> list[Cost]:
    """Return the costs of all orders. FileNotFoundError without the compiler."""
    if shutil.which(compiler) is None:
        raise FileNotFoundError(f"{compiler} is not installed: the C part of the benchmark needs a C compiler")
    calibrations = [load_calibration("demo"), *map(make_up_calibration, ORDERS)]
    return [cost(calibration, compiler) for calibration in reported("compiling and timing", calibrations)]


def table(rows: list[Cost]) -> str:
    """Return the costs as text."""
    lines = [f"{'C, ns per call':<14}{'order':>6}{'cubic':>8}{'forward':>16}{'inverse':>16}{'command':>16}"]
    for cost in rows:
        cells = (
            f"{ns:7.1f} ({ns / cost.cubic_ns:4.1f}x)" for ns in (cost.forward_ns, cost.inverse_ns, cost.command_ns)
        )
        lines.append(f"{cost.name:<14}{cost.order:>6}{cost.cubic_ns:>8.1f}" + "".join(f"{cell:>16}" for cell in cells))
    return "\n".join(lines)


def main() -> int:
    """Print the table, or JSON."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--json", action="store_true", help="one object per calibration instead of the table")
    options.add_argument("--compiler", default="gcc")
    chosen = options.parse_args()
    try:
        with show_progress("model in C"):
            rows = costs(chosen.compiler)
    except FileNotFoundError as missing:
        print(missing, file=sys.stderr)
        return 2
    if chosen.json:
        rows = [{name: getattr(cost, name) for name in Cost.__dataclass_fields__} for cost in rows]
        print(json.dumps(rows, indent=2))
    else:
        print(table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
