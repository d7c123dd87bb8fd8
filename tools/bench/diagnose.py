#!/usr/bin/env python3
"""Where the time of one diagnosis goes: `tools/bench/diagnose.py [RECORDING]`; without one, a hidden delay is generated.

The recording without an argument is 60 s at 200 Hz, made by the twin with a delay that the model does not
have and 0.1 N of noise. Prints seconds per stage, the whole, and the largest memory.
"""

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np

from gateway.diagnosis import Measurement, Options, diagnose
from gateway.diagnosis.search.base_fit import DEFAULT_PLANT
from gateway.recording import read_table
from gateway.recording.measurement import measurement_of
from gateway.twin.plant import with_value
from gateway.twin.replay.replay import Drive, Replay

SEED = 11
ROW_S = 0.005


def make_measurement() -> Measurement:
    """Return 60 s of steps and ramps with a hidden transport delay of 40 ms."""
    rng = np.random.default_rng(SEED)
    time_s = np.arange(0.0, 60.0, ROW_S)
    levels = np.repeat(rng.uniform(0.3, 6.0, 60), 200)
    ramps = np.convolve(levels, np.ones(40) / 40.0, mode="same")
    command_v = np.where((np.arange(time_s.size) // 1000) % 2 == 0, levels, ramps)
    plant = with_value(DEFAULT_PLANT, "regulator", "delay_s", 0.04)
    force_n = Replay(Drive(time_s=time_s, command_v=command_v)).run([plant]).reading_n[0]
    return Measurement(
        name="generated",
        time_s=time_s,
        force_n=force_n + rng.normal(0.0, 0.1, time_s.size),
        command_v=command_v,
        usable=np.ones(time_s.size, dtype=bool),
        repeated=np.zeros(time_s.size, dtype=bool),
    )


def main() -> None:
    """Diagnose a made-up recording, and print where the time goes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", nargs="?", type=Path)
    given = parser.parse_args().recording
    began = time.perf_counter()
    measurement = measurement_of(read_table(given)) if given else make_measurement()
    read_s = time.perf_counter() - began
    diagnosis = diagnose([measurement], None, Options(clock=time.perf_counter))
    print(f"{measurement.name}: {measurement.rows} rows, {measurement.duration_s:.0f} s, seed {SEED}")
    print(f"{'read':24s} {read_s:6.2f} s")
    for stage, spent_s in diagnosis.spent_s.items():
        print(f"{stage:24s} {spent_s:6.2f} s")
    print(f"{'whole':24s} {time.perf_counter() - began:6.2f} s")
    print(f"largest memory           {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:6.0f} MB")
    print(
        f"verdict {diagnosis.verdict}: "
        + (", ".join(f"{c.name} {c.confidence:.2f}" for c in diagnosis.causes) or "no cause")
    )


if __name__ == "__main__":
    sys.exit(main())
