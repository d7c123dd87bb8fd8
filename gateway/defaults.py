"""Defaults that more than one room states: rig files, command line, messages and generated texts take them from here.

A default that only one dataclass states (the bounds of control, for one) stands there, beside its unit and its limits.
"""

from typing import Final

STRICT: Final = {"extra": "forbid"}
"""Of every dataclass that is built from a file: unknown keys are refused (`__pydantic_config__`, read in gateway.profiles)."""

RIG: Final = "demo"
"""The shipped rig that verbs mean where none is named."""
REGISTER_MAP: Final = "force-v1"
PLANT: Final = "paper-slide"
"""Simulated where a real rig names no plant of its own."""

HOST: Final = "127.0.0.1"
MODBUS_PORT: Final = 5020
WEB_PORT: Final = 8080
METRICS_PORT: Final = 9464
"""Modbus' own is 502 (IANA), which Linux gives to programs with a right of their own only."""
UNIT_ID: Final = 1
UNIT_IDS: Final = (0, 1, 255)
"""0 and 255 mean the device itself on Modbus TCP ("Messaging on TCP/IP Implementation Guide V1.0b", 4.4.2.3); 1 is what most
clients send."""
CONNECTIONS: Final = 32
PER_ADDRESS: Final = 4
"""Connections."""
IDLE_S: Final = 60.0
REQUESTS_PER_S: Final = 200.0

TLS_PORT: Final = 802
"""Modbus/TCP Security, as registered with IANA."""
RTU_BAUD: Final = 19200
RTU_PARITY: Final = "even"
"""With 19200 baud what Modbus asks devices to come with ("MODBUS over Serial Line V1.02", section 2.5.1 and 3.3)."""

OUTPUT_BAUD: Final = 9600
CELL_BAUD: Final = 115200
VOLTAGE_MAX_V: Final = 10.0
"""End of the usual range of DACs and regulators, 0 .. 10 V."""
UNLIMITED: Final = 1.0e12
"""A bound of the simulated machine that is never met, in any unit; infinity cannot be said in JSON."""
PAD_STIFFNESS_N_PER_M: Final = 4.1e4
"""Pad and workpiece together, of the simulated machine where nobody says another."""
CELL_RANGE_N: Final = 100.0
LARGEST_CELL_N: Final = 5000.0
"""Of any rig: no calibration may need more, and no rig file may name more."""
LOOP_HZ: Final = 100.0
TICK_S: Final = 1.0 / LOOP_HZ
"""Nominal tick of the control loop."""
RING_ROWS: Final = 1 << 16
"""Newest readings that are kept for the processes beside control: eleven minutes at 100 Hz, one at 1 kHz."""
WATCHED_SHARE: Final = 0.9
"""Of the residual watch's window, that must be there, and usable; and before it:"""
WATCH_SETTLED_S: Final = 1.0
"""From the first reading that is kept until one may be judged."""
STALL_S: Final = 0.1
"""Silence of the control loop after which the guardian replaces it."""
PILE_S: Final = 0.25
"""What has waited for longer in a pile, of a client that waits for no answer, renews no lease and begins nothing."""
COMMIT_PATIENCE_S: Final = 10.0
"""For which the terminal waits for a commit: a disk may be slow, one that takes longer hangs."""
LEASE_S: Final = 0.2
"""Of a starter rig; and what `hold` keeps where the rig's is unknown."""
BEATS_PER_LEASE: Final = 4.0
"""Of `hold` and of the page: several may be late before one is missed."""
SHORTEST_UNTOLD_LEASE_S: Final = round(0.75 * LEASE_S, 3)
"""`hold` keeps it without knowing the lease: it beats three times in this."""

LADDER_STEP_V: Final = 0.2
LADDER_GROUPS: Final = 5
LADDER_MINOR_POINTS: Final = 150
LADDER_RESPONSE_STEPS: Final = 12
QUICK_LADDER_STEP_V: Final = 0.5

MOST_FRAMES: Final = 7
"""Of a master, whose heartbeats the next control process is told."""
