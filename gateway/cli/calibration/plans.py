"""Plan files of `calibrate --plan`, as the control socket takes them."""

from pathlib import Path
from typing import Any


def fields_of(path: Path) -> dict[str, Any]:
    """Return the fields of a plan file. ProfileError (78) with every fault at its line and column."""
    from gateway.profiles.kinds.plans import load_plan_fields

    return load_plan_fields(path)


def is_experiment(fields: dict[str, Any]) -> bool:
    """Return whether these are an experiment's fields, not those of a ladder, of which a calibration is made."""
    return "parts" in fields
