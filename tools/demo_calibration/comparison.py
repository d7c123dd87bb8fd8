"""Whether a fit gives the answers of the committed calibration, and what a model answers along a path."""

from dataclasses import asdict
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from demo_calibration.twin_runs import OTHER_TURNS_V, stairs_between
from gateway.bsfm.model import Bsfm, Calibration
from gateway.twin.experiment import Floats

SAME_N, SAME_V, SAME_S = (
    1.0e-3,
    2.0e-4,
    5.0e-4,
)  # of the answers of two fits: an iteration ends elsewhere on another machine


def differences(committed: dict[str, Any], again: Calibration) -> list[str]:
    """Return what is not the same, as sentences. The date is not compared, and coefficients are by what they answer (never
    judge or compare by parameters): forces of both branches, and voltages along a walk with reversals.
    """
    faults, coefficients = [], ("handles_n", "weights", "slip_radii_v", "slip_shares")
    for name, value in asdict(again).items():
        if name == "date_utc" or value in ((), "") or name.endswith(coefficients):
            continue
        if name == "response":
            faults += response_differences(committed.get(name), value)
            continue
        old = committed.get(name)
        same = old == value if value is None or isinstance(value, str | int) else close(old, value)
        faults += [] if same else [f"{name}: committed {old}, now {value}"]
    old_n, old_v = answers(TypeAdapter(Calibration).validate_python(committed).model())
    new_n, new_v = answers(again.model())
    faults += [] if np.allclose(old_n, new_n, rtol=0.0, atol=SAME_N) else ["the branches differ"]
    return faults + ([] if np.allclose(old_v, new_v, rtol=0.0, atol=SAME_V) else ["the reversal differs"])


def response_differences(committed: dict[str, Any] | None, again: dict[str, Any]) -> list[str]:
    """Return the difference of two responses as a sentence; that of their source is not compared."""
    times = {name: value for name, value in again.items() if name != "source"}
    same = committed is not None and all(
        abs(committed.get(name, 0.0) - value) <= SAME_S for name, value in times.items()
    )
    return [] if same else [f"response: committed {committed}, now {again}"]


def answers(model: Bsfm) -> tuple[Floats, Floats]:
    """Return (N of both branches on a grid, V along the turns of the validation)."""
    grid_v = np.linspace(*model.voltage_range_v, 201)
    path_n = model.branches.rising.value(np.array(stairs_between(OTHER_TURNS_V)))
    curves = (model.branches.rising, model.branches.falling)
    return np.concatenate([curve.value(grid_v) for curve in curves]), np.array(voltages_along(model, path_n.tolist()))


def voltages_along(model: Bsfm, path_n: list[float]) -> list[float]:
    """Return what the model commands for these forces in turn, V, from a vented tool."""
    memory, last_n, voltages_v = model.reversal.start(), path_n[0], []
    for force_n in path_n:
        memory, last_n = model.memory_after(memory, last_n, force_n), force_n
        voltages_v.append(model.voltage_v(force_n, model.branch_share(memory))[0])
    return voltages_v


def close(old: Any, new: float) -> bool:
    """Return whether two numbers of a calibration are the same to SAME_N."""
    return isinstance(old, float) and bool(np.isclose(old, new, rtol=0.0, atol=SAME_N))
