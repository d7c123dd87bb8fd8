"""What the load cell would read over a recording, if the machine were a plant."""

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from gateway.diagnosis.measurement import Floats, Measurement
    from gateway.profiles import PlantProfile

_MOST_STEPS: Final = 2_000_000  # one plant alone may have many
_MOTION_NOTES: Final = {
    "inferred": "position_mm is not taken for the motion of the slide: inferred motion fits better",
    "measured": "position_mm is taken for the motion of the slide",
    "measured-reversed": "position_mm is taken for the motion of the slide, and counts down when the tool moves out",
}


def simulate_reading(measurement: "Measurement", profile: "PlantProfile") -> "tuple[Floats, list[str]]":
    """Return readings, N, and notes. Where a position was measured nobody says which way is out, or whether it is that of the
    slide at all and not of the tool along the workpiece: as in a diagnosis, the way that fits best is taken."""
    import numpy as np

    from gateway.diagnosis.bench.recording_drive import MOTIONS, drive_of
    from gateway.twin.replay.drive import Motion
    from gateway.twin.replay.replay import Replay

    ways: tuple[Motion, ...] = ("inferred",) if measurement.position_m is None else MOTIONS
    replays = [Replay(drive_of(measurement, way), most_steps=_MOST_STEPS) for way in ways]
    answers = [replay.run([profile.plant]).reading_n[0] for replay in replays]
    errors = [float(np.mean((measurement.force_n - answer)[measurement.usable] ** 2)) for answer in answers]
    best = int(np.argmin(errors))
    notes = [_MOTION_NOTES[ways[best]]] if measurement.position_m is not None else []
    return np.asarray(answers[best]), [*notes, *replays[best].notes]
