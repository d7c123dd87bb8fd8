"""The register map for the page's live table: what each register is, how its words read, and the mbpoll line that reads it."""

from typing import Any

from gateway import defaults
from gateway.profiles import Rig
from gateway.registers.map.register_map import Register


def register_table(rig: Rig, port: int | None) -> dict[str, Any]:
    """Return {"blocks": [...], "registers": [...]} of the rig's map, and where plain Modbus TCP is served: port, None for
    nowhere; host, empty where it is the page's own; unit."""
    map_, network = rig.register_map, rig.network
    return {
        "map": map_.name,
        "port": port,
        "host": "" if network.bind in ("0.0.0.0", "::") else network.bind,
        "unit": defaults.UNIT_ID if defaults.UNIT_ID in network.units else network.units[0],
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
