"""A gateway on a machine that is not the twin, as its sample ring shows it: quiet, then an effect is switched on."""

from pathlib import Path
from typing import Final

import numpy as np

from gateway.recording import Recorder
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from tests.diagnosis.changes.foreign_rig import Floats, Wish, record

_PLACES: Final = {name: COLUMNS.index(name) for name in ("time_s", "command_v", "force_n", "sent_v")}


def rows_of(wish: Wish) -> Floats:
    """Rows of the gateway's own, whose settings are there at once; (rows, columns)."""
    measurement, _ = record(wish)
    assert measurement.command_v is not None
    table = np.zeros((measurement.rows, len(COLUMNS)))
    for name, values in (
        ("time_s", measurement.time_s),
        ("command_v", measurement.command_v),
        ("force_n", measurement.force_n),
        ("sent_v", measurement.command_v),
    ):
        table[:, _PLACES[name]] = values
    return table


def recorded(wish: Wish, directory: Path) -> Path:
    """The same as a recording."""
    recorder = Recorder(directory, {"rig": "foreign"}, COLUMNS)
    for row in rows_of(wish):
        recorder.append(tuple(row.tolist()))
    recorder.close()
    return recorder.path


class CourseRing:
    """The newest rows at a moment; the effect of the second wish is there from `switched_s` on."""

    columns = COLUMNS

    def __init__(self, quiet: Wish, changed: Wish | None = None, switched_s: float = 0.0) -> None:
        self._rows = rows_of(quiet)
        if changed:
            later = self._rows[:, 0] >= switched_s
            self._rows[later] = rows_of(changed)[later]
        self.now_s = 0.0

    def newest(self, count: int) -> bytes:
        """Return all rows until now, at most so many seconds' worth as a ring holds."""
        fresh = (self._rows[:, 0] <= self.now_s) & (self._rows[:, 0] > self.now_s - 120.0)
        return self._rows[fresh].tobytes()
