"""The whole page of one rig, in the order in which a cell is wired."""

from shlex import quote

from gateway.clients.wiring.masters import network_sections
from gateway.clients.wiring.section import Section
from gateway.clients.wiring.serial_lines import serial_sections
from gateway.profiles import Rig


def wiring_page(rig: Rig, called: str) -> tuple[str, tuple[Section, ...]]:
    """Return title and sections. called: the rig, as commands name it. Raises MissingRegisterError."""
    title = f"Wiring of rig {rig.name}: {rig.description or 'no description'}"
    safe_v = rig.control.limits.safe_voltage_v
    first = Section(
        "Before you begin",
        (
            "Not a safety device: emergency stop, air dump and guarding are separate hardware.",
            f"On a fault the output goes to {safe_v:g} V (limits.safe_voltage_v): check what your tool does then.",
            f"Written from {rig.file}; check it first: force-gateway check {quote(called)}",
        ),
    )
    return title, (first, *serial_sections(rig), *network_sections(rig, called))
