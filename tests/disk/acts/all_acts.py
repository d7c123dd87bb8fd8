"""All the acts: those that refuse when the disk does, and those whose acknowledgement outlives a power cut."""

from typing import Final

from tests.disk.acts.acts import Act, AuditedWrites, StoredCalibrations, StoredPlants
from tests.disk.acts.file_acts import (
    BackedUp,
    Bundled,
    CleanEnd,
    CleanEndOfNobody,
    CountedBirths,
    Exported,
    ReportedFit,
    Restored,
)
from tests.disk.acts.recording_acts import KeptRecordings, OneRecording, ReferenceRecordingKept, SyncedRecording

BOTH: Final[tuple[type[Act], ...]] = (
    StoredCalibrations,
    StoredPlants,
    AuditedWrites,
    SyncedRecording,
    KeptRecordings,
    ReferenceRecordingKept,
    ReportedFit,
    Exported,
    Bundled,
    BackedUp,
    Restored,
)
REFUSED: Final = (*BOTH, OneRecording)
SYNCED: Final = (*BOTH, CountedBirths, CleanEnd, CleanEndOfNobody)
