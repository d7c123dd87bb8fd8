"""Every check of a rig: FAULTS keep it from starting, WARNINGS do not, HARDWARE keeps it from starting on its real devices."""

from typing import Final

from gateway.profiles.rigs.checks import faces, lines, listeners, network, tls, values, valve, wires

FAULTS: Final = (
    *values.FAULTS,
    *lines.FAULTS,
    *valve.FAULTS,
    *wires.FAULTS,
    *network.FAULTS,
    *faces.FAULTS,
    *tls.FAULTS,
    *listeners.FAULTS,
)
WARNINGS: Final = (
    *values.WARNINGS,
    *lines.WARNINGS,
    *wires.WARNINGS,
    *network.WARNINGS,
    *faces.WARNINGS,
    *tls.WARNINGS,
    *listeners.WARNINGS,
)
HARDWARE: Final = (*lines.HARDWARE, *valve.HARDWARE, *faces.HARDWARE)
