"""A gateway that holds a force is asked for all that it stores, and the n-th call to the disk fails: the loop feels nothing,
what was acknowledged is there, what was not has said so, and all works once the disk does."""

import re
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.calibrations.store import CalibrationStore
from gateway.plants.store import PlantStore
from gateway.recording import RecordingError, list_recordings, read_recording
from tests.disk.failing_disks import FailingDisk, describe
from tests.disk.working_day import Day, a_day, prepare

IN_THE_GATE = {"once": (90,), "full": (40,), "read-only": (1,)}
"""Which calls fail there, half a second of a processor each; with --long each of them does, of each kind."""
LONG_STRIDE = {"once": 1, "for a while": 2, "full": 3, "read-only": 3, "broken": 3}

WORDS = r"\b[EW]\d{3}\b|Input/output error|No space left on device|Read-only file system"
"""One of them is in every refusal; the command line puts a code before the system's own words."""


@pytest.mark.long
def test_an_ordinary_day_is_acknowledged_as_a_whole(fast_folder: Path) -> None:
    day = worked_on(fast_folder / "state", FailingDisk(fast_folder / "state", "once", 0))
    assert not [answer for answer in day.answers if "error" in answer]
    assert not [outcome for outcome in day.outcomes if outcome.get("failed")]
    assert {"record", "calibration in use", "plant in use"} <= {record["what"] for record in read_audit(day.state)}


@pytest.mark.parametrize(
    "kind", [*IN_THE_GATE, *(pytest.param(kind, marks=pytest.mark.long) for kind in ("for a while", "broken"))]
)
def test_control_feels_no_call_that_fails(fast_folder: Path, kind: str, budget: int) -> None:
    failed = 0
    for n in count(1, LONG_STRIDE[kind]) if budget > 1 else IN_THE_GATE[kind]:
        state = fast_folder / f"{n}"
        disk = FailingDisk(state, kind, n)
        worked_on(state, disk)
        failed += disk.has_failed
        if not disk.has_failed and len(disk.calls) < n:
            break
    print(f"{kind}: {failed} days with a failure, {len(disk.calls)} calls a day")
    assert failed


def worked_on(state: Path, disk: FailingDisk) -> Day:
    """A day on this disk, judged, and another one on the same when it is well."""
    state.mkdir()
    prepare(state)
    with a_day(state, disk, from_the_start=True) as day:
        try:
            assert day.end() == []
            if not is_beyond_taking_back(disk):
                judge(day)
            day.answers.clear(), day.outcomes.clear()
            day.work()
            assert [answer["error"] for answer in day.answers if "error" in answer] == []
            assert [outcome["said"] for outcome in day.outcomes if outcome.get("failed")] == []
            judge(day)
        except Exception as error:
            raise AssertionError(f"{describe(disk)}\n{day.outcomes}\n{day.said[-12:]}") from error
    assert verify_audit(state).broken is None
    return day


def is_beyond_taking_back(disk: FailingDisk) -> bool:
    """The name stands, and neither its fsync nor its removal is to be had: the one place where the disk may hold what was
    refused, until the next change."""
    first = disk.refused[0] if disk.refused else None
    is_store = first is not None and Path(first.path).name in ("calibrations", "plants")
    return disk.kind in ("broken", "for a while") and first is not None and first.what == "fsync" and is_store


def judge(day: Day) -> None:
    """What is on the disk is what control says, and what was not done was said."""
    for noun, store in (("calibration", CalibrationStore(day.state)), ("plant", PlantStore(day.state))):
        status = day.ask({"do": noun})
        selected = store.find_selected()
        in_use = 0 if status.get("built_in") else status["active"]
        assert (selected.selection.number or 0, selected.notes) == (in_use, ()), f"{noun}: {status['said']}"
    for answer, outcome in zip(day.answers, day.outcomes, strict=True):
        told = answer.get("error") or (outcome.get("failed") and outcome["said"])
        assert not told or re.search(WORDS, str(told)), told
    for answer in day.answers:
        if "written" in answer:
            judge_recording(day, Path(answer["written"]), answer["rows"])
    assert all(entry.rows == 0 for entry in list_recordings(day.state) if entry.fault)
    assert not day.running._audit._log._waiting, "the audit is stored once the disk is well"


def judge_recording(day: Day, path: Path, rows: int) -> None:
    """All the rows that were told are in the file, or a line says that it has stopped."""
    try:
        kept = read_recording(path).rows
    except (OSError, RecordingError):
        kept = 0
    stopped: list[Any] = [text for text in day.said if "E402" in text and str(path) in text]
    assert kept == rows or stopped, f"{path.name}: {kept} rows, {rows} were told"
