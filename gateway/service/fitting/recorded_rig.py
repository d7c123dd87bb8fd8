"""The rig that a recording was made on, and its plant, as the recording itself has them.

A recording carries the texts of its rig's files (`rig_texts`), so that it can be judged on another machine and after the
files have changed. A table without them is taken by its rig's name, if that is known here.
"""

import json
from collections.abc import Mapping
from math import inf
from pathlib import PurePath
from typing import TYPE_CHECKING

from gateway.profiles.kinds.plants import PlantProfile, read_plant
from gateway.profiles.strict_yaml.faults import ProfileError
from gateway.profiles.strict_yaml.text import Document, parse
from gateway.recording import Recording

if TYPE_CHECKING:
    from gateway.profiles import Rig


def rig_of(recording: Recording) -> "Rig | None":
    """Return the rig that the recording names, from the files that are here now; None where none is named or known.

    Of a table that names none nothing is loaded that reads rigs.
    """
    name = str(recording.header.get("rig", "")).strip()
    if not name:
        return None
    from gateway.service.fitting.ladder_source import find_rig

    return find_rig(name, str(recording.header.get("rig_file", "")))[0]


def plant_of(recording: Recording) -> PlantProfile | None:
    """Return the plant as it was recorded, else that of the rig of the same name; None where no plant is known.

    ProfileError, with its place in the recorded text, when this version cannot read it.
    """
    texts = rig_texts(recording)
    if texts:
        return _read_recorded_plant(texts)
    rig = rig_of(recording)
    return rig.plant_profile if rig else None


def recorded_noise_n(recording: Recording) -> float | None:
    """Return the noise of the readings at rest as the calibration has it under which the recording was made, N; None where
    neither knows it."""
    try:
        noise_n = float(recording.header.get("calibration_noise_n") or 0.0)
    except (TypeError, ValueError):
        return None
    return noise_n if 0.0 < noise_n < inf else None


def rig_texts(recording: Recording) -> dict[str, str]:
    """Return the recorded files by name, the rig's own first; empty for a table without them. A CSV holds them as JSON."""
    texts = recording.header.get("rig_texts", {})
    try:
        texts = json.loads(texts) if isinstance(texts, str) else texts
    except (ValueError, RecursionError):
        return {}
    return {str(file): str(text) for file, text in texts.items()} if isinstance(texts, Mapping) else {}


def is_rehearsal(recording: Recording) -> bool:
    """Decide whether it was made while the devices of a real rig were simulated: what it has measured is no machine."""
    if str(recording.header.get("simulated")).lower() != "true":
        return False
    texts = rig_texts(recording)
    try:
        return bool(texts) and _document(next(iter(texts)), texts).at("simulated") is not True
    except ProfileError:  # a table that somebody has edited
        return False


def _read_recorded_plant(texts: Mapping[str, str]) -> PlantProfile | None:
    rig_file, *others = texts
    named = str(_document(rig_file, texts).at("plant") or "")
    for file in others:
        if named and PurePath(named).name in (PurePath(file).name, PurePath(file).stem) and _is_plant(file, texts):
            plant, faults = read_plant(_document(file, texts))
            if plant is None:
                raise ProfileError(faults)
            return plant
    return None


def _is_plant(file: str, texts: Mapping[str, str]) -> bool:
    """Return whether the file holds a plant: a device or a calibration may have the plant's name."""
    return _document(file, texts).at("cylinder") is not None


def _document(file: str, texts: Mapping[str, str]) -> Document:
    return parse(texts[file].encode(), file)
