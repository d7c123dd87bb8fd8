"""Names of a recording's columns: those of the contract, and what our recorder writes beside them; what it adds to a
calibration ladder is gateway.bsfm.ladder.plan.LABELS.

What is around the tool stands in the contract under the names of the twin's Surroundings; edges do not import the twin, so
a test holds the two together.
"""

from typing import Final

CONTRACT: Final = (
    "time_s",
    "force_n",
    "command_v",
    "pressure_kpa",
    "temperature_c",
    "supply_kpa",
    "spindle_rpm",
    "feed_mm_s",
    "tilt_deg",
    "position_mm",
    "distance_m",
    "quality",
)
"""Columns with a meaning of their own; a number that cannot be read there is a fault, not a missing value."""

DERIVED: Final = (
    "setpoint_n",
    "applied_n",
    "feedforward_v",
    "trim_v",
    "state",
    "fault_code",
    "limited_by",
    "model_residual_n",
)
"""What our recorder writes beside the contract. The trim and the residual hold the measured force."""

SENT: Final = ("sent_v", "sent_age_s")
"""What our recorder writes since it knows the wire: the last voltage sent, and how long before the row."""

PULLING: Final = "pulling"
"""What our recorder writes since it knows a valve: 1 while the tool pulls, where forces are negative; else 0."""

CALIBRATION: Final = "calibration"
"""What our recorder writes since one may change amid a recording, whose header has the first: its number, 0 the rig's own."""
