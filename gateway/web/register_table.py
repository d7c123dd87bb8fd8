"""The register map for the page's live table: what each register is, how its words read, and the mbpoll line that reads it."""

from typing import Any

from gateway.profiles import Rig
from gateway.registers.map.register_map import Register


def register_table(rig: Rig) -> dict[str, Any]:
    """Return {"blocks": [...], "registers": [...]} of the rig's map. name4x: as PLC people count, 40001 for address 0."""
    map_ = rig.register_map
    return {
        "map": map_.name,
        "blocks": [
            {"name": block.name, "first": block.first, "last": block.last, "text": block.text} for block in map_.blocks
        ],
        "registers": [_described(register) for register in map_.registers],
    }


def _described(register: Register) -> dict[str, Any]:
    return {
        "name": register.name,
        "block": register.block,
        "address": register.address,
        "words": register.words,
        "type": register.type,
        "order": register.word_order.value,
        "scale": register.scale,
        "decimals": register.decimals,
        "unit": register.unit,
        "writable": register.is_writable,
        "text": register.text,
        "values": {str(number): name for number, name in register.values.items()},
        "bits": {str(bit): name for bit, name in register.bits.items()},
    }
