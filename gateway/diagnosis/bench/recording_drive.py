"""From a recording to what drives the twin in a replay, and when its unknown past does not matter any more.

The past before the first row is a parameter (initial_state.py). The coarse look that comes before any parameter is fitted is
taken at rows that have forgotten it, and so is a fit to a measured motion."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Flags, Floats, Measurement
from gateway.robust import noise_from_second_differences
from gateway.twin.replay.cache import room_bytes_now, room_for_series
from gateway.twin.replay.drive import Motion
from gateway.twin.replay.replay import Drive, Replay
from gateway.twin.surroundings import COLUMNS, Surroundings

MOTIONS: Final[tuple[Motion, ...]] = ("inferred", "measured", "measured-reversed")  # how the slide's may be known
SETTLING_S: Final = 1.0  # until lags have forgotten what was asked before; 0 for a recording that begins at its lowest:
_LOWEST_SHARE: Final = 0.02  # of the drive's range
_FORGOTTEN_SHARE: Final = (
    0.15  # of the drive's range: a drive that went so far has wiped out what friction remembered ...
)
_LATEST_SHARE: Final = 0.25  # ... and this share of a recording may go by until it has
_AT_WORK_SHARE: Final = 0.05  # of the drive's range, by which it moves about a gap, and so may have moved in it
_ABOUT_S: Final = 0.2  # after a gap: what a lead asks for at a step lasts so long
_MOST_UNSEEN_SHARE: Final = 0.5  # of the rows of a recording
REST_S: Final = 0.2  # command and force stand still for so long
_REST_SLACK_SHARE: Final = 5.0e-3  # of the forces' range that a force at rest may wander


def settled_s(measurement: Measurement) -> float:
    """Return when the state before the first row does not matter any more: lags have settled, and friction has slid."""
    settled_s = min(SETTLING_S, 0.1 * measurement.duration_s)
    drive = measurement.command_v if measurement.command_v is not None else measurement.pressure_pa
    if drive is None:
        return settled_s
    forgotten_s = float(measurement.time_s[_forgetting_row(drive, 0)])
    return min(settled_s + forgotten_s, max(settled_s, _LATEST_SHARE * measurement.duration_s))


def rows_after_unseen_settings(measurement: Measurement) -> Flags:
    """Return the rows (rows,) that a setting may have moved which nobody recorded.

    A recording of the gateway's own tells with each reading what was sent last. Where its loop woke late there is no
    reading for some ticks, and of two settings sent meanwhile the first is lost: 0 V for 14 ms, the lead of a fall, left a
    clean recording off by 2 N, and the rest seemed a jump of the gain. What went in is unknown then, as it is before the
    first row, and rows are judged again once it is forgotten in the same way. Gaps while the command hardly moves lose
    nothing that matters. Where more than half of a recording would go, nothing goes: it has no better witness.
    """
    unseen = np.zeros(measurement.rows, dtype=bool)
    command_v = measurement.command_v
    if measurement.even_s <= 0.0 or command_v is None:
        return unseen
    about, settling = (max(round(duration_s / measurement.even_s), 1) for duration_s in (_ABOUT_S, SETTLING_S))
    for before, after in pairwise(np.flatnonzero(measurement.usable)):
        moved_v = np.ptp(command_v[before : after + about]) if after > before + 1 else 0.0
        if moved_v > _AT_WORK_SHARE * np.ptp(command_v):
            settled = min(int(after) + settling, measurement.rows - 1)
            latest = int(after) + round(_LATEST_SHARE * measurement.rows)
            unseen[before + 1 : min(_forgetting_row(command_v, settled) + settling, latest)] = True
    return unseen if np.mean(unseen) <= _MOST_UNSEEN_SHARE else np.zeros_like(unseen)


def _forgetting_row(drive: Floats, first: int) -> int:
    """The row at which the drive has gone so far since row `first` that friction has forgotten what it remembered there; the
    last one where it never does."""
    gone = np.maximum.accumulate(drive[first:]) - np.minimum.accumulate(drive[first:])
    far = np.flatnonzero(gone >= _FORGOTTEN_SHARE * np.ptp(drive))
    return first + int(far[0]) if far.size else drive.size - 1


def begins_at_rest(measurement: Measurement) -> bool:
    """Return whether command and force stand still at first, the command at its lowest: then the state before the first row is
    known. Rest further up may have been reached from either side."""
    rows = measurement.time_s < REST_S
    if measurement.command_v is None or rows.sum() < 8 or np.ptp(measurement.command_v[rows]) > 0.0:
        return False
    if measurement.command_v[0] > np.min(measurement.command_v) + _LOWEST_SHARE * np.ptp(measurement.command_v):
        return False
    first, second = np.array_split(measurement.force_n[rows & measurement.usable], 2)
    if min(first.size, second.size) < 4:
        return False
    error_n = float(np.sqrt(np.var(first) / first.size + np.var(second) / second.size))
    slack_n = _REST_SLACK_SHARE * float(np.ptp(measurement.force_n[measurement.usable]))  # slow noise wanders, too
    return abs(float(np.mean(first) - np.mean(second))) < max(4.0 * error_n, slack_n) + 1.0e-9


def replays_of(measurements: Sequence[Measurement], motion: Motion) -> tuple[Replay, ...]:
    """Return the twin over each recording; in steps as long as the rows where the reader has made them even. Several share the
    room that one has for what it keeps."""
    with room_for_series(room_bytes_now() // max(1, len(measurements))):
        return tuple(Replay(drive_of(each, motion), each.even_s or None) for each in measurements)


def drive_of(measurement: Measurement, motion: Motion) -> Drive:
    """Return what drives the twin in a replay."""
    noise_m = 0.0
    if measurement.position_m is not None:
        noise_m = noise_from_second_differences(measurement.position_m)
    columns = dict(measurement.covariates)
    if measurement.position_m is not None:
        columns["position_mm"] = measurement.position_m * 1.0e3
    return Drive(
        time_s=measurement.time_s,
        command_v=measurement.command_v,
        pressure_pa=measurement.pressure_pa,
        position_m=measurement.position_m,
        motion=motion if measurement.position_m is not None else "inferred",
        position_noise_m=noise_m,
        surroundings=Surroundings(**{name: columns[name] for name in COLUMNS if name in columns}),
        repeated=measurement.repeated,
        before_v=None,
    )
