"""The tabs of the page: one module each with `routes(context)`, and what they share beside them; their scripts are in
static/tabs."""

from typing import Final

NAMES: Final = ("calibrate", "recordings", "calibrations", "diagnosis", "wiring", "configuration")
"""The modules that have routes."""
