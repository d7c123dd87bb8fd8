"""From a recording to what drives the twin in a replay, and when its unknown past does not matter any more."""

from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Measurement
from gateway.robust import noise_from_second_differences
from gateway.twin.replay.drive import Motion
from gateway.twin.replay.replay import Drive, Replay
from gateway.twin.surroundings import COLUMNS, Surroundings

MOTIONS: Final[tuple[Motion, ...]] = ("inferred", "measured", "measured-reversed")  # how the slide's may be known
SETTLING_S: Final = 1.0  # of a recording's start are not judged, unless it begins at rest at its lowest:
_LOWEST_SHARE: Final = 0.02  # of the drive's range
_FORGOTTEN_SHARE: Final = (
    0.15  # of the drive's range: a drive that went so far has wiped out what friction remembered ...
)
_LATEST_SHARE: Final = 0.25  # ... and this share of a recording may go by until it has
REST_S: Final = 0.2  # command and force stand still for so long
_REST_SLACK_SHARE: Final = 5.0e-3  # of the forces' range that a force at rest may wander


def settled_s(measurement: Measurement) -> float:
    """Return when the state before the first row does not matter any more: lags have settled, and friction has slid."""
    settled_s = min(SETTLING_S, 0.1 * measurement.duration_s)
    drive = measurement.command_v if measurement.command_v is not None else measurement.pressure_pa
    if drive is None:
        return settled_s
    gone = np.maximum.accumulate(drive) - np.minimum.accumulate(drive)
    forgotten_s = float(measurement.time_s[int(np.argmax(gone >= _FORGOTTEN_SHARE * gone[-1]))])
    return min(settled_s + forgotten_s, max(settled_s, _LATEST_SHARE * measurement.duration_s))


def begins_at_rest(measurement: Measurement) -> bool:
    """Do command and force stand still at first, and the command at its lowest, so that the state before the first row is
    known? Rest further up may have been reached from either side."""
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


def replay_of(measurement: Measurement, motion: Motion) -> Replay:
    """Return the twin over a recording; in steps as long as the rows where the reader has made them even."""
    return Replay(drive_of(measurement, motion), measurement.even_s or None)


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
        settled_s=0.0 if begins_at_rest(measurement) else min(SETTLING_S, 0.1 * measurement.duration_s),
    )
