"""Calibrations of foreign machines as the product made them, kept: a ladder and its fit take seconds for each.

Written by `tools/bench/response.py --write`; a test with --long makes one again and compares.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Final

from pydantic import TypeAdapter

from gateway.bsfm.model import Calibration
from tests.control.foreign.machine import drawn
from tests.control.foreign.stand import Calibrated

KEPT: Final = Path(__file__).with_name("calibrations.json")


def stored(found: Mapping[int, Calibrated]) -> str:
    """One machine a line."""
    rows = [f'"{seed}": {json.dumps(asdict(one.calibration))}' for seed, one in found.items()]
    return "{\n" + ",\n".join(rows) + "\n}\n"


def kept() -> dict[int, Calibrated]:
    """By seed; empty before anything was written."""
    if not KEPT.exists():
        return {}
    adapter = TypeAdapter(Calibration)
    rows = json.loads(KEPT.read_text(encoding="utf-8"))
    return {int(seed): Calibrated(drawn(int(seed)), adapter.validate_python(row)) for seed, row in rows.items()}
