#!/usr/bin/env python3
"""From a fault to the safe voltage on the wire, in virtual time: `tools/bench/faults/bounds.py`. A quarter of a minute.

The whole gateway with the twin and its two wires, which take their baud rates' time; an observer reads the wire to the device
and notes when the last byte of `SET 0` has passed. Each fault comes at 20 moments, a millisecond apart, since where it falls
between two samples and two ticks counts. The same seeds give the same figures on any machine.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.service.rigs import strict, with_supervision
from tests.service.wired import ENABLE, Wired

MOMENTS = 20
LEASE_S, BEAT_S = 0.2, 0.05
LAST_WORD_S = 0.06 + 0.02 + 0.04
"""An overdue answer is waited for, two ticks, `SET 0` at 9600 baud."""


def pressing(moment_ms: int) -> Wired:
    """Return a gateway that holds 20 N, so many milliseconds into it."""
    wired = Wired(strict(), seed=moment_ms).pressing(20.0)
    wired.run(moment_ms / 1e3)
    return wired


def until_safe(wired: Wired) -> float:
    """Return the seconds until the safe voltage has passed the wire."""
    return wired.voltage_reaches_safe(3.0)


def heartbeat_stops(moment_ms: int) -> float:
    """Measure from the last new heartbeat; reads, and the same heartbeat again, flow on."""
    return _heartbeat_stops(Wired(with_supervision(strict(), lease_s=LEASE_S), seed=moment_ms), moment_ms)


def heartbeat_stops_of_slow(moment_ms: int) -> float:
    """Measure it where the loop decides seldom: by its slowest tick, and few readings between."""
    rig = with_supervision(strict(), lease_s=LEASE_S)
    stream = rig.load_cell.device.stream
    assert stream
    device = replace(rig.load_cell.device, stream=replace(stream, rate_hz=25.0))
    wired = Wired(replace(rig, load_cell=replace(rig.load_cell, device=device)), seed=moment_ms)
    wired.tick_steps = 20
    return _heartbeat_stops(wired, moment_ms)


def _heartbeat_stops(wired: Wired, moment_ms: int) -> float:
    wired.ready()
    wired.write(0, ENABLE, 1500, 0, 0, 1)
    for beat in range(2, 40):
        wired.run(BEAT_S + moment_ms / 1e3)
        wired.write(4, beat)
    began_s = wired.now_s
    while not any(one.voltage_v == 0.0 for one in wired.settings_since(began_s)):
        wired.run(0.01)
        wired.word("force_measured")
        if wired.word("control_word"):
            wired.write(4, 39)
    return next(one.time_s for one in wired.settings_since(began_s) if one.voltage_v == 0.0) - began_s


def named(name: str) -> Callable[[int], float]:
    """Return what measures a fault of the simulated world, from its beginning."""

    def measure(moment_ms: int) -> float:
        wired = pressing(moment_ms)
        wired.fault(name)
        return until_safe(wired)

    return measure


def frozen(moment_ms: int) -> float:
    """Measure a cell that freezes, once a few seconds have shown how much its noise moves it."""
    wired = pressing(moment_ms)
    wired.run(3.0)
    wired.fault("cell-frozen")
    return until_safe(wired)


def over_force(moment_ms: int) -> float:
    """Let the workpiece push back with 70 N at once."""
    wired = pressing(moment_ms)
    wired.twin.set_disturbance(70.0)
    return until_safe(wired)


def disabled(moment_ms: int) -> float:
    """Clear enable, as a master does."""
    wired = pressing(moment_ms)
    wired.write(0, 0)
    return until_safe(wired)


ROWS: tuple[tuple[str, float, Callable[[int], float]], ...] = (
    ("the master clears enable", LAST_WORD_S, disabled),
    ("the owner's heartbeat stops (lease 200 ms)", LEASE_S + 0.02, heartbeat_stops),
    ("the same, 25 readings/s, a loop of 50 Hz", LEASE_S + 0.04, heartbeat_stops_of_slow),
    ("the load cell falls silent (50 ms)", 0.05 + LAST_WORD_S, named("cell-cut")),
    ("over-force, three samples of 10 ms", 0.03 + LAST_WORD_S, over_force),
    ("the load cell's sign turns", 1.0 + LAST_WORD_S, named("sign-inverted")),
    ("the load cell freezes, held for 3 s before", 2.0 + LAST_WORD_S, frozen),
)


def main() -> int:
    """Print the table; return 1 where a bound is missed."""
    kept = True
    print(f"{'what happens at 20 N':<44}{'median':>9}{'longest':>9}{'bound':>9}")
    for name, bound_s, measure in ROWS:
        took_s = sorted(measure(moment_ms) for moment_ms in range(MOMENTS))
        kept = kept and took_s[-1] <= bound_s
        verdict = "kept" if took_s[-1] <= bound_s else "MISSED"
        figures = "".join(f"{1e3 * value_s:>6.0f} ms" for value_s in (took_s[MOMENTS // 2], took_s[-1], bound_s))
        print(f"{name:<44}{figures} {verdict}", flush=True)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
