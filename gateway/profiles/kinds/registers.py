"""Register maps: read by the registers room itself, its faults told with their lines."""

from gateway.profiles.strict_yaml.faults import ProfileFault
from gateway.profiles.strict_yaml.text import Document
from gateway.registers.map.map_reader import MapError, read_map
from gateway.registers.map.register_map import RegisterMap


def read_registers(document: Document) -> tuple[RegisterMap | None, list[ProfileFault]]:
    """Return the register map of a file, or None and every fault."""
    try:
        return read_map(document.value), []
    except MapError as error:
        faults = (document.fault(flaw.place, flaw.sentence, at_key=flaw.is_of_key) for flaw in error.faults)
        return None, sorted(dict.fromkeys(faults))
