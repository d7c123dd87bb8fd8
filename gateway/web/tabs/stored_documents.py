"""Numbered calibrations and plants as the page lists them, and what a change of the one in use is called by the verbs."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from annotated_types import Ge, Le
from starlette.requests import Request

from gateway import defaults
from gateway.calibrations.store import CalibrationStore
from gateway.numbered_documents.store import StoredDocument
from gateway.plain_file import exists
from gateway.plants.store import NumberedPlant, PlantStore
from gateway.profiles import ProfileError, Rig, load_rig
from gateway.web.context import WebContext
from gateway.web.tabs.answers import BAD_REQUEST, TabRefusedError, read_body

if TYPE_CHECKING:
    from gateway.bsfm import Calibration


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """What is to be in use. back: what was before the last change; force: a calibration whose fit was rejected, too."""

    __pydantic_config__ = defaults.STRICT
    use: Annotated[int, Ge(0), Le(999_999)] | None = None
    back: bool = False
    force: bool = False


async def read_change(request: Request) -> Change:
    """Return what a request wants changed. TabRefusedError for nothing, or both."""
    change = await read_body(request, Change)
    if change.back == (change.use is not None):
        raise TabRefusedError('{"use": number} or {"back": true}', BAD_REQUEST)
    return change


def change_words(noun: str, change: Change) -> tuple[str, ...]:
    """Return the verb's words for a change."""
    if change.back:
        return ("rollback",)
    forced = ("--force",) if change.force and noun == "calibration" else ()
    return ("use", str(change.use), *forced)


def calibration_facts(context: WebContext) -> dict[str, Any]:
    """Return the calibrations, the newest first, the rig's own last."""
    rig = _rig(context)
    store = CalibrationStore(context.state, rig.calibration if rig else None)
    selected = store.find_selected()
    rows = [_calibration_row(entry, selected.selection.number) for entry in reversed(store.list())]
    for row in rows:
        row["has_report"] = exists(store.directory / f"{row['number']:04d}.json")
    if store.built_in:
        own = StoredDocument(store.built_in.number, store.built_in)
        row = _calibration_row(own, store.built_in.number if selected.selection.number is None else None)
        rows.append(row | {"is_own": True, "has_report": False})
    can_go_back = selected.pointer.generation > 0
    return {"calibrations": rows, "notes": list(selected.notes), "can_go_back": can_go_back}


def _calibration_row(entry: "StoredDocument[Calibration]", active: int | None) -> dict[str, Any]:
    row: dict[str, Any] = {
        "number": entry.number,
        "active": entry.number == active,
        "is_own": False,
        "fault": entry.fault,
    }
    found = entry.document
    if found is None:
        return row
    return row | {
        "name": found.name,
        "made": found.date_utc,
        "model": found.kind,
        "reversal": found.reversal_kind,
        "forces_n": list(found.allowed_n),
        "rms_n": found.rms_n if found.rms_n >= 0.0 else None,
        "max_n": found.max_n if found.max_n >= 0.0 else None,
        "rejected": found.rejected,
    }


def plant_facts(context: WebContext) -> dict[str, Any]:
    """Return the plants, the newest first, the rig's own (number 0) last."""
    store = PlantStore(context.state)
    selected = store.find_selected()
    active = selected.selection.number or 0
    rows = [_plant_row(entry, active) for entry in reversed(store.list())]
    rig = _rig(context)
    own = rig.plant_profile.name if rig and rig.plant_profile else "none"
    rows.append({"number": 0, "active": active == 0, "name": own, "is_own": True, "fault": ""})
    return {"plants": rows, "notes": list(selected.notes), "can_go_back": selected.pointer.generation > 0}


def _plant_row(entry: StoredDocument[NumberedPlant], active: int) -> dict[str, Any]:
    row: dict[str, Any] = {
        "number": entry.number,
        "active": entry.number == active,
        "is_own": False,
        "fault": entry.fault,
    }
    if entry.document is None:
        return row
    source = entry.document.provenance
    return row | {
        "name": entry.document.profile.name,
        "made": source.made_utc,
        "verdict": source.verdict or "added",
        "causes": [{"name": cause.name, "confidence": cause.confidence} for cause in source.causes],
        "from": source.file or ", ".join(each.name for each in source.recordings),
    }


def _rig(context: WebContext) -> Rig | None:
    """None for a rig that cannot be read any more: its file has been changed since the start."""
    try:
        return load_rig(context.rig, simulated=context.simulated)
    except ProfileError:
        return None
