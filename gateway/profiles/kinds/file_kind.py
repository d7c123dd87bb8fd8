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
from gateway.profiles.strict_yaml.faults import closest
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
_ANYWHERE: Final = frozenset(("name", "description", "format", "version"))
_MAP_KEYS: Final = frozenset(("blocks", "version"))


@cache
def _keys() -> Mapping[str, frozenset[str]]:
    """Return the keys that each kind of file may have at its top."""
    keys = {kind: frozenset(field.name for one in types for field in fields(one)) for kind, types in _TYPES.items()}
    return keys | {"registers": _MAP_KEYS}


def is_foreign(value: Any, wanted: str) -> bool:
    """Decide whether a document has nothing of the wanted kind: no key of its own, and none that may be a slip of one."""
    known, present = _keys()[wanted], set(map(str, value)) if isinstance(value, dict) else set()
    others = present - _ANYWHERE
    return bool(others) and not others & known and not any(closest(key, known - _ANYWHERE) for key in others)


@cache
def _own_keys() -> Mapping[str, frozenset[str]]:
    """Return the keys that only one kind of file has at its top."""
    keys = _keys()
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
