"""Register maps: read by the registers room itself, its faults told with their lines."""

from dataclasses import replace

from gateway import defaults
from gateway.profiles.strict_yaml.faults import ProfileFault
from gateway.profiles.strict_yaml.text import Document
from gateway.registers import BankRules, RegisterBank
from gateway.registers.map.map_reader import MapError, read_map
from gateway.registers.map.register_map import RegisterMap
from gateway.registers.map.value_names import check_numbers


def read_registers(document: Document) -> tuple[RegisterMap | None, list[ProfileFault]]:
    """Return the register map of a file, or None and every fault."""
    try:
        return replace(read_map(document.value), file=document.file), []
    except MapError as error:
        faults = (document.fault(flaw.place, flaw.sentence, at_key=flaw.is_of_key) for flaw in error.faults)
        return None, sorted(dict.fromkeys(faults))


def read_served_registers(document: Document) -> tuple[RegisterMap | None, list[ProfileFault]]:
    """Return the map of a rig, which has what a gateway serves: the bank itself says what is missing. Others need less."""
    register_map, faults = read_registers(document)
    if register_map is None:
        return None, faults
    try:
        RegisterBank(register_map, BankRules(rig_name="", force_max_n=1.0), now=lambda: 0.0)
        check_numbers(register_map)
    except (ValueError, LookupError) as error:
        sentence = f"a gateway cannot serve it: {error}; {defaults.REGISTER_MAP} has all that it needs, to copy it from"
        return None, [document.fault((), sentence)]
    return register_map, faults
