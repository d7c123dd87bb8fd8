"""What one decision costs, and how much of that is waiting for memory: `.venv/bin/python tools/bench/decision.py`.

    a setpoint    from the bank's write of a voltage until its bytes are handed to the port (`loop.py` has the rest of the way)
    a sample      from a cell's sentence to the decision with its reasons, while 2 V are out

Each is measured in one process, with nothing of a kernel in it, once the same code has just run, and after something that
leaves a processor's caches to others: 64 MB read through, or 10 ms of asking the clock, in which this process does not even
sleep. What the last takes more, the program does not compute: it waits for its own code and data to come back from memory. The
peer is the same way once it has just run.
"""

import argparse
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gateway.cli.diagnosis.progress_line import show_progress
from gateway.progress import report
from tests.service.wired import ENABLE, MASTER, Wired

GOAL_S = 60e-6
CACHES = np.zeros(64 << 20, dtype=np.uint8)
VOLTAGE_MODE, LOW_MV, HIGH_MV = 1, 2000, 3000
WORDS = struct.Struct(">6H")
FREE_LINE_S = 0.12
"""Of simulated time: the last setting has been answered, and no poll is out."""
WAIT_S = 0.01


def read_through() -> None:
    """Read more than any cache holds."""
    CACHES.sum()


def ask_the_clock() -> None:
    """Wait without sleeping, and without touching anything."""
    end_s = time.perf_counter() + WAIT_S
    while time.perf_counter() < end_s:
        pass


BEFORE: dict[str, Callable[[], None]] = {
    "once it has just run": lambda: None,
    "after 64 MB were read": read_through,
    "after 10 ms of asking the clock": ask_the_clock,
}


class Decisions:
    """A whole gateway in this process, whose output's port says when it is given bytes."""

    def __init__(self) -> None:
        self._wired = Wired().ready()
        self._handed_s: list[float] = []
        self._write, self._wired.exchange._write = self._wired.exchange._write, self._hand_over
        self._voltage_mv = LOW_MV
        self._set(LOW_MV)

    def _hand_over(self, data: bytes) -> None:
        self._handed_s.append(time.perf_counter())
        self._write(data)

    def _set(self, voltage_mv: int) -> None:
        self._wired.bank.write_registers(0, WORDS.pack(ENABLE, 0, 0, VOLTAGE_MODE, 0, voltage_mv), MASTER)

    def _set_other_voltage(self) -> None:
        self._voltage_mv = LOW_MV + HIGH_MV - self._voltage_mv
        self._set(self._voltage_mv)

    def measure_setpoint(self, before: Callable[[], None]) -> float | None:
        """Return the seconds from a write to the port; None where a poll was just out."""
        self._set_other_voltage()  # unmeasured: the simulation writes none, and the round before may have emptied the caches
        self._wired.run(FREE_LINE_S)
        before()
        self._handed_s.clear()
        began_s = time.perf_counter()
        self._set_other_voltage()
        return self._handed_s[0] - began_s if self._handed_s else None

    def measure_sample(self, before: Callable[[], None]) -> float:
        """Return the seconds that one sentence of the load cell takes."""
        self._wired.run(FREE_LINE_S)
        before()
        began_s = time.perf_counter()
        self._wired.loop.on_cell_bytes(b"ST,GS,+0001.60kg\r\n", self._wired.now_s)
        return time.perf_counter() - began_s


def print_way(name: str, measure: Callable[[Callable[[], None]], float | None], rounds: int) -> None:
    """Print one way's costs, measured in turn, so that the machine's own speed is the same for all."""
    seconds: dict[str, list[float]] = {label: [] for label in BEFORE}
    for _ in range(rounds):
        for label, before in BEFORE.items():
            if (taken_s := measure(before)) is not None:
                seconds[label].append(taken_s)
    peer_s = median(next(iter(seconds.values())))
    print(f"{name}, median of {rounds}:")
    for label, all_s in seconds.items():
        print(f"  {label:32} {median(all_s) * 1e6:5.0f} us  {median(all_s) / peer_s:4.1f} x")
    print(f"  goal {GOAL_S * 1e6:.0f} us: {'reached' if peer_s <= GOAL_S else 'MISSED'} once it has just run")


def main() -> None:
    """Print both ways."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=200)
    options = parser.parse_args()
    decisions = Decisions()
    with show_progress("decision benchmark"):
        report("setpoints (1 of 2)")
        print_way("a setpoint until its bytes are handed to the port", decisions.measure_setpoint, options.rounds)
        report("samples (2 of 2)")
        print_way("a sample until it is decided on", decisions.measure_sample, options.rounds)


if __name__ == "__main__":
    main()
