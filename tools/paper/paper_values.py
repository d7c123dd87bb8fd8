"""What the paper says, number by number, so that each has one place. Source: the paper's text."""

from typing import Final

LADDER_TOP_V: Final = 5.0
LADDER_STEP_V: Final = 0.1
GROUPS: Final = 10
POINTS: Final = 1010  # 10 groups of 101
ORDERS: Final = tuple(range(1, 16))

NORM: Final = {"pfm": (0.1004, 0.0971), "bfm": (0.1014, 0.0971), "psfm": (0.1400, 0.0279), "bsfm": (0.1100, 0.0237)}
"""Objective at order 1 and order 15 (Fig. 6): the paper's own normalised norm, not newtons of anything."""
ORDER_NEEDED: Final = {"pfm": 3, "bfm": 2, "psfm": 3, "bsfm": 2}

VALIDATION_MAX_N: Final = {"bsfm": 1.32, "psfm": 2.65}

TARGETS_N: Final = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)
SETTLING_S: Final = {2.0: (0.27, 0.38, 0.43), 1.0: (0.33, 0.38, 0.49)}
"""Band in N: shortest, mean, longest time to stay within it (Fig. 8). The mean for 1 N repeats that for 2 N in the text."""

TRACKING_FORCES_N: Final = (10.0, 15.0)
TRACKING_FEEDS_M_PER_S: Final = (5.0e-3, 15.0e-3)
TRACKING_BAND_N: Final = 2.0
SPINDLE_HZ: Final = 65.0  # 3900 rpm
ROUGHNESS_UM: Final = 0.4
