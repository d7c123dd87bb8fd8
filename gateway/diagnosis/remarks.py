"""What a reader of an answer has to know beside it: sentences about the recordings and about what was asked."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Measurement
from gateway.diagnosis.noise import fast_noise_n

_MOVES: Final = 30.0  # times the noise, from which a force moves
_APART: Final = 10.0  # times the floor, from which offsets are told


def remarks(measurements: Sequence[Measurement], offsets_n: Sequence[float], floor_n: float) -> Iterator[str]:
    """Each recording's own notes, then what only all of them together show."""
    for each in measurements:
        yield from each.notes
        yield from _of_a_dead_drive(each)
    if max(offsets_n) - min(offsets_n) > _APART * floor_n:
        told = ", ".join(
            f"{each.name} {offset_n:.3g} N" for each, offset_n in zip(measurements, offsets_n, strict=True)
        )
        yield (
            f"the recordings have offsets of their own ({told}); the extended plant has their mean: "
            "a simulation of one of them is off by the difference"
        )


def too_high_a_floor(given_n: float, rms_n: float) -> str:
    return (
        f"the noise floor of {given_n:.3g} N that was given is more than the base model leaves ({rms_n:.3g} N), so it "
        "confirms nothing and was not used: it is the noise of the readings at rest, in newtons"
    )


def _of_a_dead_drive(measurement: Measurement) -> Iterator[str]:
    volts = measurement.command_v
    if volts is None or measurement.pressure_pa is not None or np.ptp(volts) > 0.0:
        return
    force_n = measurement.force_n[measurement.usable]
    if np.ptp(force_n) > _MOVES * fast_noise_n(force_n):
        yield (
            f"{measurement.name}: command_v stands at {volts[0]:g} V throughout while the force moves by "
            f"{np.ptp(force_n):.3g} N: is it the right column? Without a command that moves, no cause can be told"
        )
