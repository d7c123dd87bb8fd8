"""Thousands of drawn scenes of what is kept on disk: what was said to be stored is there, whatever befell disk and power.

A scene is one seed: which stores there are, what is done with them, and what befalls them. The laws are the players' own.
"""

import gc
from pathlib import Path

import pytest

from tests.disk.drawn.players.archive_player import ArchivePlayer
from tests.disk.drawn.players.audit_player import AuditPlayer
from tests.disk.drawn.players.own_words import EventsPlayer, MarkerPlayer
from tests.disk.drawn.players.player import Player
from tests.disk.drawn.players.recording_player import RecordingPlayer
from tests.disk.drawn.players.small_players import CounterPlayer, Onlooker, ReferencePlayer, Terminal
from tests.disk.drawn.players.store_player import CalibrationPlayer, PlantPlayer
from tests.disk.drawn.players.upload_player import UploadPlayer
from tests.disk.drawn.players.value_players import FilePlayer, ForceReferencePlayer, SettingsPlayer
from tests.disk.drawn.scene import Scene, clean
from tests.gate.budgets import scenes

SMALL: list[type[Player]] = [EventsPlayer, MarkerPlayer, SettingsPlayer, ForceReferencePlayer, FilePlayer]
LARGE: list[type[Player]] = [ArchivePlayer, UploadPlayer]
EVERY: list[type[Player]] = [
    AuditPlayer,
    CalibrationPlayer,
    PlantPlayer,
    RecordingPlayer,
    ReferencePlayer,
    CounterPlayer,
    Onlooker,
    *SMALL,
    *LARGE,
]
COUNTS: dict[str, tuple[list[type[Player]], int]] = {
    "audit": ([AuditPlayer], 25),
    "calibrations": ([CalibrationPlayer], 25),
    "recordings": ([RecordingPlayer], 30),
    "reference": ([ReferencePlayer], 25),
    "archives": ([ArchivePlayer], 10),
    "uploads": ([UploadPlayer], 15),
    "events": ([EventsPlayer], 25),
    "files": ([FilePlayer], 25),
    "small": (SMALL, 30),
    "all": (EVERY, 25),
    "verbs": ([Terminal, Terminal, *EVERY], 6),
}
"""How many scenes of each, of which the push gate plays one in three."""


@pytest.mark.parametrize("which", COUNTS)
def test_what_was_said_to_be_stored_is_there_and_all_heals_with_the_disk(
    fast_folder: Path, which: str, budget: int
) -> None:
    gc.freeze()  # what the tests before have left is not walked through
    kinds, count = COUNTS[which]
    broken, opened = [], _descriptors()
    for seed in range(scenes(count, budget)):
        broken += [(seed, words) for words in Scene(seed, fast_folder, kinds).run().broken]
        clean(fast_folder)
    assert broken == []
    assert _descriptors() == opened, "of what was open behind each scene"


def _descriptors() -> int:
    gc.collect()  # what was killed is held by its traceback
    return len(list(Path("/proc/self/fd").iterdir()))
