"""What a file is, told by its keys: a calibration that is given where a rig belongs gets one sentence, not thirty faults.

A file with no key but those of the kind that is wanted is of that kind, and the others are not even imported: who reads a
register map need not wait for the simulated world.
"""

import re
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from typing import Any, Final

from gateway.profiles.strict_yaml.faults import closest

CALLED: Final = {
    "rig": "a rig",
    "device": "a device profile",
    "plant": "a plant",
    "calibration": "a calibration",
    "registers": "a register map",
    "plan": "a plan",
}
"""Kind of profile -> as people say it."""

_ANYWHERE: Final = frozenset(("name", "description", "format", "version"))
_KEY: Final = re.compile(rb"^([a-z_]+):", re.M)
_MAP_KEYS: Final = frozenset(("blocks", "version", "text"))


@cache
def _keys_of(kind: str) -> frozenset[str]:
    """Return the keys that a file of this kind may have at its top."""
    return _MAP_KEYS if kind == "registers" else frozenset(key.name for one in _types_of(kind) for key in fields(one))


def _types_of(kind: str) -> tuple[type, ...]:
    match kind:
        case "rig":
            from gateway.profiles.rigs.rig_file import RigFile

            return (RigFile,)
        case "device":
            from gateway.devices import DeviceProfile

            return (DeviceProfile,)
        case "plant":
            from gateway.twin import Plant

            return (Plant,)
        case "calibration":
            from gateway.bsfm.model import Calibration

            return (Calibration,)
    from gateway.control.runs.experiment_plan import ExperimentPlan
    from gateway.control.runs.ladder_stairs import CalibrationPlan

    return (ExperimentPlan, CalibrationPlan)


def keys_at_the_top(text: bytes) -> dict[str, None]:
    """Return what look like keys in a file that may be no YAML: a tab or a key that stands twice hides not what it is."""
    return {key.decode("ascii"): None for key in _KEY.findall(text)}


def _keys_in(value: Any) -> set[str]:
    return set(map(str, value)) if isinstance(value, dict) else set()


def has_no_other_key(value: Any, wanted: str) -> bool:
    """Decide whether each key at the top of a document is one of the wanted kind's: then it is of no other kind."""
    return isinstance(value, dict) and _keys_in(value) - _ANYWHERE <= _keys_of(wanted)


def is_foreign(value: Any, wanted: str) -> bool:
    """Decide whether a document has nothing of the wanted kind: no key of its own, and none that may be a slip of one."""
    known, others = _keys_of(wanted), _keys_in(value) - _ANYWHERE
    return bool(others) and not others & known and not any(closest(key, known - _ANYWHERE) for key in others)


@cache
def _own_keys() -> Mapping[str, frozenset[str]]:
    """Return the keys that only one kind of file has at its top."""
    keys = {kind: _keys_of(kind) for kind in CALLED}
    return {
        kind: frozenset(own - {key for other, theirs in keys.items() if other != kind for key in theirs})
        for kind, own in keys.items()
    }


def kind_of(value: Any, wanted: str = "") -> str | None:
    """Return the kind whose own keys stand most often at the top of a document, None where none does; a tie is the
    wanted one's."""
    present = _keys_in(value)
    counts = {kind: len(present & own) for kind, own in _own_keys().items()}
    best = max(counts, key=lambda kind: (counts[kind], kind == wanted))
    return best if counts[best] else None
