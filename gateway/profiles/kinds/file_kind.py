"""What a file is, told by its keys: a calibration that is given where a rig belongs gets one sentence, not thirty faults."""

from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from typing import Any, Final

from gateway.bsfm.model import Calibration
from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.devices import DeviceProfile
from gateway.profiles.rigs.rig_file import RigFile
from gateway.twin import Plant

CALLED: Final = {
    "rig": "a rig",
    "device": "a device profile",
    "plant": "a plant",
    "calibration": "a calibration",
    "registers": "a register map",
    "plan": "a plan",
}
"""Kind of profile -> as people say it."""

_TYPES: Final[dict[str, tuple[type, ...]]] = {
    "rig": (RigFile,),
    "device": (DeviceProfile,),
    "plant": (Plant,),
    "calibration": (Calibration,),
    "plan": (ExperimentPlan, CalibrationPlan),
}
_MAP_KEYS: Final = frozenset(("blocks", "version"))


@cache
def _own_keys() -> Mapping[str, frozenset[str]]:
    """Return the keys that only one kind of file has at its top."""
    keys = {kind: {field.name for one in types for field in fields(one)} for kind, types in _TYPES.items()}
    keys["registers"] = set(_MAP_KEYS)
    return {
        kind: frozenset(own - {key for other, theirs in keys.items() if other != kind for key in theirs})
        for kind, own in keys.items()
    }


def kind_of(value: Any, wanted: str = "") -> str | None:
    """Return the kind whose own keys stand most often at the top of a document, None where none does; a tie is the
    wanted one's."""
    present = set(map(str, value)) if isinstance(value, dict) else set()
    counts = {kind: len(present & own) for kind, own in _own_keys().items()}
    best = max(counts, key=lambda kind: (counts[kind], kind == wanted))
    return best if counts[best] else None
