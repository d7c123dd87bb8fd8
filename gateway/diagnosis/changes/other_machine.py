"""Doubt that recordings are of the machine that they are compared as: a file of something else gives an answer, too."""

from collections.abc import Sequence
from math import sqrt
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Measurement
from gateway.robust import noise_from_second_differences

_LEAST_EXPLAINED: Final = 0.5  # of the variance of a force; the drive of a machine explains nearly all of it
_MOVES: Final = 5.0  # times its noise: the variance of a force that is held is of noise and drift
_FEWEST: Final = 30


def doubt_machine(recordings: Sequence[Measurement], left_n: float) -> tuple[str, ...]:
    """Return a note where the machine's model explains little of these recordings, none where it explains them. left_n: RMS of
    what it does not explain."""
    forces_n = [one.force_n[one.usable] for one in recordings if np.count_nonzero(one.usable) >= _FEWEST]
    rows = sum(force_n.size for force_n in forces_n)
    if not rows:
        return ()
    moves_n = sqrt(sum(float(np.var(force_n)) * force_n.size for force_n in forces_n) / rows)
    noise_n = max(noise_from_second_differences(force_n) for force_n in forces_n)
    explained = 1.0 - (left_n / moves_n) ** 2 if moves_n > _MOVES * noise_n else 1.0
    if explained >= _LEAST_EXPLAINED:
        return ()
    names = ", ".join(one.name for one in recordings)
    share = f"{max(0.0, explained):.0%} of how its force moves"
    return (f"{names}: drive and model explain {share}: is it of the same machine, and are its columns what they say?",)
