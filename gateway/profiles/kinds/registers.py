"""Register maps: read by the registers room itself, its faults told with their lines."""

from gateway.profiles.strict_yaml.faults import Fault
from gateway.profiles.strict_yaml.text import Document
from gateway.registers.map.map_reader import MapError, read_map
from gateway.registers.map.register_map import RegisterMap


def read_registers(document: Document) -> tuple[RegisterMap | None, list[Fault]]:
    """The register map of a file, or None and every fault."""
    try:
        return read_map(document.value), []
    except MapError as error:
        faults = (document.fault(place, sentence, at_key=_is_about_key(sentence)) for place, sentence in error.faults)
        return None, sorted(dict.fromkeys(faults))


def _is_about_key(sentence: str) -> bool:
    return sentence.startswith("is not a known key") or sentence.endswith("is missing")
