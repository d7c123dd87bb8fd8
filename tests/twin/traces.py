"""What a twin does between two moments, seen at even intervals."""

from collections.abc import Callable
from typing import Any

import numpy as np

from gateway.twin import Twin
from gateway.twin.experiment import Floats


def trace(twin: Twin, duration_s: float, look: Callable[[Twin], Any], every_s: float = 1.0e-3) -> Floats:
    """Return what `look` sees after each `every_s` of `duration_s`; shape (samples,), or (samples, lanes)."""
    samples = []
    for _ in range(round(duration_s / every_s)):
        twin.advance(every_s)
        samples.append(look(twin))
    return np.asarray(samples, dtype=np.float64)


def step_response(twin: Twin, voltage_v: float, duration_s: float = 1.5) -> Floats:
    """Return the true contact force every millisecond after a step of the command, N."""
    twin.command(voltage_v)
    return trace(twin, duration_s, lambda running: running.force_n)
