# ruff: noqa: E402  the tests must be found before they are imported
"""What a measured response is worth on machines that nobody here has built: hold, steps and tracking, with and without trim.

    .venv/bin/python tools/bench/response.py                # 8 machines, virtual time, some minutes
    .venv/bin/python tools/bench/response.py --seeds 20
    .venv/bin/python tools/bench/response.py --write        # calibrate anew, and keep that for the tests

Machines are drawn from a seed (tests/control/foreign/machine.py: dead time 20-150 ms, lags 30-300 ms, one or two, LuGre
friction of 0.5-4 N, noise). Each is calibrated by the product's quick ladder, in virtual time, starting with the demo's
calibration; then the same course with the numbers of the demo rig's file (`fixed`) and with what was measured, trim on and
off. "settled" is the median time until the force stays within 0.5 N; "of bound" the median of that over what the plant's
physics allows (tests/control/foreign/course.py says which bound). Never run on hardware.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in the tests: another order of sums may lead a fit elsewhere

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[2])]
from gateway.bsfm import Bsfm
from gateway.bsfm.ladder.ladder_error import LadderError
from gateway.cli.diagnosis.progress_line import show_progress
from gateway.control.settings import ControlSettings, LeadSettings, Trim
from gateway.profiles import load_rig
from gateway.progress import reported
from tests.control.foreign.course import Course, allowed_s, course
from tests.control.foreign.kept_calibrations import KEPT, kept, stored
from tests.control.foreign.machine import drawn
from tests.control.foreign.stand import Calibrated, calibrated, settings

FIXED: Final = LeadSettings(lag_s=0.072, second_lag_s=0.072)


def ways() -> dict[str, tuple[ControlSettings, bool]]:
    """Return name -> settings, and whether the measured response is used."""
    off = Trim()
    return {
        "fixed, no trim": (settings(off, lead=FIXED), False),
        "fixed, trim": (settings(lead=FIXED), False),
        "measured, no trim": (settings(off), True),
        "measured, trim": (settings(), True),
    }


def describe_machine(one: Calibrated) -> str:
    """Return a machine in one line, with what was measured of it."""
    machine, response = one.machine, one.response
    late_s = machine.dead_time_s + machine.wire_s + machine.cell_lag_s
    true = f"{late_s * 1e3:.0f} + {machine.lag_s * 1e3:.0f} + {machine.second_lag_s * 1e3:.0f} ms"
    measured = "not measured"
    if response:
        measured = (
            f"{response.dead_time_s * 1e3:.0f} + {response.lag_s * 1e3:.0f} + {response.second_lag_s * 1e3:.0f} ms"
        )
    return f"{machine.name}: {true}, measured {measured}; friction {machine.coulomb_n:.1f} N, noise {machine.noise_n:.2f} N"


def row(name: str, one: Calibrated, done: Course) -> dict[str, object]:
    """Return one way's figures on one machine."""
    ratios = [step.settled_s / allowed_s(one.machine, step) for step in done.steps]
    return {
        "machine": one.machine.name,
        "way": name,
        "hold_n": done.hold_n,
        "after_1_s_n": done.after_1_s_n,
        "still_n": done.still_n,
        "swing_n": done.swing_n,
        "settled_s": done.settled_s(),
        "of_bound": float(np.median(ratios)),
        "within_1_5": float(np.mean(np.array(ratios) <= 1.5)),
        "never": sum(not step.is_settled for step in done.steps),
        "sine_0_5_n": done.sines_n[0],
        "sine_0_2_n": done.sines_n[1],
        "ramp_n": done.ramp_n,
        "warnings": list(done.warnings[:2]),
    }


def format_row(result: dict[str, object]) -> str:
    """Return the figures as a line of the table."""
    numbers = "hold_n after_1_s_n still_n settled_s of_bound within_1_5 sine_0_5_n sine_0_2_n ramp_n".split()
    cells = "".join(f"{float(str(result[name])):>9.2f}" for name in numbers)
    return f"  {result['way']!s:<18}{cells}{result['never']!s:>7}"


def write(seeds: Sequence[int], demo: Bsfm) -> None:
    """Calibrate these machines anew; the others stay as they were."""
    for seed in reported("calibrating machines", seeds):
        try:
            one = calibrated(drawn(seed), demo)
        except LadderError as error:
            print(f"plant {seed}: no calibration: {error}", flush=True)
            continue
        KEPT.write_text(stored(dict(sorted((kept() | {seed: one}).items()))), encoding="utf-8")
        print(describe_machine(one), flush=True)


def measure_all(seeds: Sequence[int], demo: Bsfm, *, quiet: bool) -> list[dict[str, object]]:
    """Return a row for each way on each machine; unless quiet it is printed as it comes."""
    known, rows = kept(), []
    say = (lambda text: None) if quiet else partial(print, flush=True)
    say(" " * 22 + "hold    1 s   still  settled of bound <=1.5   0.5 Hz   0.2 Hz     ramp  never")
    for seed in reported("machines", seeds):
        one = known.get(seed) or calibrated(drawn(seed), demo)
        say(describe_machine(one))
        for name, (control, measured) in ways().items():
            rows.append(row(name, one, course(one.machine, one.calibration, control, measured=measured)))
            say(format_row(rows[-1]))
    return rows


def main() -> None:
    """Print how each way holds, steps and tracks on the drawn machines."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--write", action="store_true", help=f"calibrate anew and write {KEPT.name}")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds)
    demo = load_rig("demo").calibration.model()
    if options.write:
        with show_progress("drawn machines"):
            write(seeds, demo)
        return
    with show_progress("drawn machines"):
        rows = measure_all(seeds, demo, quiet=options.json)
    if options.json:
        print(json.dumps(rows))


if __name__ == "__main__":
    main()
