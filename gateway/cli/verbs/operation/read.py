"""`read`: registers by name, in engineering units."""

import json
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.completion_words import complete_registers
from gateway.cli.options import gateway_options, json_option

if TYPE_CHECKING:
    from gateway.cli.master.client import RegisterReading
    from gateway.cli.master.wires import Wire
    from gateway.registers import Register, RegisterMap


EXAMPLES = ("read force_measured state", "read status --json")


@click.command()
@click.argument("names", metavar="NAME...", nargs=-1, required=True, shell_complete=complete_registers)
@gateway_options
@json_option
def command(*, names: tuple[str, ...], wire: "Wire", unit: int, map_name: str, as_json: bool) -> None:
    """Read registers by name, in engineering units.

    NAME, NAME@BLOCK, or a whole BLOCK (command, status, float_abcd, ...).
    """
    from gateway.cli.master.client import GatewayClient
    from gateway.cli.master.refusal_text import explain_refusals
    from gateway.cli.master.value_text import format_value, raw
    from gateway.profiles import load_register_map

    register_map = load_register_map(map_name)
    registers = _find_registers(register_map, names)
    with GatewayClient(wire, unit, register_map) as client, explain_refusals(client):
        client.check_map()
        readings = client.read_values(registers)
    if as_json:
        click.echo(json.dumps({label(reading.register): _facts(reading) for reading in readings}, indent=2))
        return
    width = max(len(label(reading.register)) for reading in readings)
    for reading in readings:
        click.echo(f"{label(reading.register):<{width}}  {format_value(reading):<28}  {raw(reading)}")


def label(register: "Register") -> str:
    """Return the name as `read` takes it."""
    from gateway.registers.map.register_map import PLAIN_BLOCKS

    return register.name if register.block in PLAIN_BLOCKS else f"{register.name}@{register.block}"


def _find_registers(register_map: "RegisterMap", names: tuple[str, ...]) -> "list[Register]":
    from gateway.registers import UnknownRegister

    blocks = {block.name for block in register_map.blocks}
    registers: list[Register] = []
    for name in names:
        try:
            registers += register_map.registers_of(name) if name in blocks else [register_map.find(name)]
        except UnknownRegister as error:
            raise click.UsageError(str(error)) from None
    return registers


def _facts(reading: "RegisterReading") -> dict[str, Any]:
    from gateway.cli.master.value_text import format_value

    return {
        "value": reading.value if reading.is_available else None,
        "text": format_value(reading),
        "unit": reading.register.unit,
        "address": reading.register.address,
        "words": list(reading.words),
    }
