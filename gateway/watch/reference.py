"""What the residual watch compares with: the rig's plant, what the serial lines add to it, and floors for the excess.

A plant file tells of regulator, slide and cell; it does not know that a setting takes 10 ms of wire at 9600 baud, and a
reading 2 ms. The first well excited window shows it, and as far as it is of that size it is taken into the reference
once. Anything larger, and anything later, is a difference.

A floor is the residual's rms in a window in which the whole search found nothing. The residual grows with what is asked of
the machine, so there is one for each octave of excitation; where none is known, the search is run.
"""

from dataclasses import dataclass, field
from math import floor as whole
from math import log2
from typing import Final

import numpy as np

from gateway.diagnosis import Diagnosis
from gateway.diagnosis.bench.bench import bench_of
from gateway.diagnosis.bench.recording_drive import replays_of
from gateway.diagnosis.measurement import Floats, Measurement
from gateway.diagnosis.model_fit.initial_state import fit_initial_states
from gateway.twin.plant import Plant, with_value
from gateway.watch.window import Window

LINES: Final = {
    "regulator.delay_s": 0.035,
    "cell.clock_offset_s": 0.035,
}
"""Parameters that serial lines change, and by how much at most. A resolution (quantum_n) is left out, though it is found: a
model that answers in steps has no derivatives to fit by, and what it does to the force is far below what matters."""
_EXCESS: Final = 1.25  # rms over the floor from which the whole search is worth its time
_STILL_V: Final = 0.02


@dataclass(slots=True)
class WatchReference:
    """What windows are compared with. plant: without noise. is_settled: what the lines add is known."""

    plant: Plant
    is_settled: bool = False
    floors_n: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.plant = with_value(self.plant, "cell", "noise_n", 0.0)

    def rms_n(self, window: Window) -> float:
        """Return the RMS of measured minus replayed over the judged rows, see `rms_of`."""
        return rms_of(window.measurement, self.plant)

    def floor_n(self, window: Window) -> float | None:
        """Return the floor for such a window; None where none is known."""
        return self.floors_n.get(_octave(window.excitation_v))

    def is_exceeded(self, window: Window, rms_n: float) -> bool:
        """Return whether the residual is above the floor of such windows, or no floor is known."""
        floor_n = self.floor_n(window)
        return floor_n is None or rms_n > _EXCESS * floor_n

    def raise_floor(self, window: Window, rms_n: float) -> None:
        """Note that nothing was found in this window."""
        octave = _octave(window.excitation_v)
        self.floors_n[octave] = max(rms_n, self.floors_n.get(octave, 0.0))

    def take_line_delays(self, diagnosis: Diagnosis) -> None:
        """Take what the lines add out of the first judged window, as far as it is of their size."""
        self.is_settled = True
        for path, most in LINES.items():
            section, name = path.split(".")
            value = getattr(getattr(diagnosis.plant, section), name)
            if abs(value - getattr(getattr(self.plant, section), name)) <= most:
                self.plant = with_value(self.plant, section, name, value)


def rms_of(measurement: Measurement, plant: Plant) -> float:
    """Return the RMS of measured minus replayed over the judged rows, N, without its mean and with the start that fits
    best: a tare is no difference, and neither is what the machine remembers from before the window.
    """
    bench = bench_of([measurement])
    return bench.rms_n(fit_initial_states(bench, plant).residual_n)


def residuals(measurement: Measurement, plants: list[Plant]) -> Floats:
    """Return measured minus replayed at the judged rows; shape (plants, judged rows)."""
    readings_n = replays_of([measurement], "inferred")[0].run(plants).reading_n
    return np.asarray((measurement.force_n - readings_n)[:, measurement.usable])


def _octave(excitation_v: float) -> int:
    return whole(log2(max(excitation_v, _STILL_V)))
