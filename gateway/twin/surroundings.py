"""What is around the tool and enters its force: temperature, supply, spindle, feed, tilt, place on the path.

Units are those of a recording's columns. None means that nobody knows: the effects that need the column are off then.
`TwinConditions` is the same together with what the effects need besides - the time, the command, the spindle's angle - for one
instant of the running twin (floats) or for a whole recording (arrays): the formulas of gateway/twin/effects take either.
"""

from dataclasses import dataclass, fields

import numpy as np

from gateway.twin.elementwise import Real


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """Each a float, an array (one value per row of a recording, or per lane of a twin), or None: not known."""

    temperature_c: Real = None
    supply_kpa: Real = None  # air line, gauge
    spindle_rpm: Real = None
    feed_mm_s: Real = None
    tilt_deg: Real = None
    position_mm: Real = None  # along the path
    distance_m: Real = None  # ground so far


UNKNOWN = Surroundings()
COLUMNS = tuple(entry.name for entry in fields(Surroundings))


@dataclass(slots=True, kw_only=True, eq=False)
class TwinConditions:
    """An instant, or all of a recording's: surroundings, and what follows from them.

    aside_mm: position minus its mean over the recording; the running twin, which knows no mean, takes the position as it
    is given. spindle_rad: the angle turned since time 0. command_v: in force when the load cell is read.
    """

    time_s: Real = 0.0
    command_v: Real = None
    temperature_c: Real = None
    supply_kpa: Real = None
    spindle_rpm: Real = None
    feed_mm_s: Real = None
    tilt_deg: Real = None
    position_mm: Real = None
    distance_m: Real = None
    aside_mm: Real = None
    spindle_rad: Real = 0.0

    def update(self, around: Surroundings) -> None:
        """Take over what is around now. ValueError when a known value is not finite."""
        for name in COLUMNS:
            value = getattr(around, name)
            if value is not None and not np.all(np.isfinite(value)):
                raise ValueError(f"{name} {value} is not finite")
            plain = value if value is None or isinstance(value, np.ndarray) else float(value)
            setattr(self, name, plain)
        self.aside_mm = self.position_mm
