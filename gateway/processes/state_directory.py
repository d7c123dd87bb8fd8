"""What stands where in the state directory of a rig, by the names that several rooms open.

Beside these: `events.jsonl` (event_file), `lock` (state_lock), `reference` (gateway.watch.reference_recording), each known to
one file.
"""

from typing import Final

RECORDINGS: Final = "recordings"
CALIBRATIONS: Final = "calibrations"
PLANTS: Final = "plants"
AUDIT: Final = "audit"
CONTROL_SOCKET: Final = "control.sock"
RIG_SOCKET: Final = "rig.sock"
"""Of the simulated rig's process."""
RUNNING: Final = "running"
"""A file that exists only while a gateway runs."""
LEFT: Final = "left.json"
"""What a gateway that has ended cleanly leaves to the next start."""
