"""`registers`: the Modbus map as a table, or as the client of a robot or PLC, from the same file that the server answers by."""

from typing import TYPE_CHECKING, Final

import click

from gateway import defaults
from gateway.cli.command_line.completion_words import complete_registers
from gateway.cli.command_line.rig_choice import rig_option
from gateway.cli.errors import CliError

if TYPE_CHECKING:
    from gateway.profiles import Rig
    from gateway.registers import RegisterMap

TABLES: Final = ("markdown", "csv", "json")
CLIENTS: Final = ("rapid", "scl", "st", "urscript", "c", "python")


EXAMPLES = ("registers force_setpoint", "registers --format scl --rig irc5-cell")


@click.command()
@click.argument("name", required=False, shell_complete=complete_registers)
@click.option(
    "--format", "form", type=click.Choice([*TABLES, *CLIENTS]), help="[default: markdown; of one NAME a card]"
)
@click.option(
    "--map", "map_name", default=None, metavar="NAME", help=f"Map name or file.  [default: {defaults.REGISTER_MAP}]"
)
@rig_option("The rig whose map, address and port a client gets")
def command(*, name: str | None, form: str | None, map_name: str | None, rig: str | None) -> None:
    """Print the register table, one register, or a robot's client.

    NAME: a register such as force_setpoint, its number such as 40002, or its address counted from 0.
    rapid: ABB IRC5 over sockets. scl: S7-1200/1500, MB_CLIENT. st: TwinCAT 3 and CODESYS V3. urscript: Universal Robots. c: C99
    and POSIX sockets. python: standard library only. Each begins with how to load it and what it does when things fail.
    """
    from gateway.profiles import load_register_map
    from gateway.registers import render_registers

    chosen = _read_rig(rig) if rig else None
    register_map = (
        chosen.register_map if chosen and not map_name else load_register_map(map_name or defaults.REGISTER_MAP)
    )
    if name is not None:
        _show_card(register_map, name, form)
        return
    form = form or "markdown"
    if form in TABLES:
        click.echo(render_registers(register_map, form), nl=False)
        return
    from gateway.clients import MissingRegisterError, UnspeakableNameError, endpoint_of, render_client

    try:
        click.echo(render_client(register_map, form, endpoint_of(chosen)), nl=False)
    except MissingRegisterError as error:
        raise CliError(f"E185 {error}: a {form} client needs them; copy them from {defaults.REGISTER_MAP}") from None
    except UnspeakableNameError as error:
        raise CliError(f"E185 {error}") from None


def _read_rig(name: str) -> "Rig":
    """Import what a rig needs only for who names one."""
    from gateway.profiles import read_rig

    return read_rig(name)


def _show_card(register_map: "RegisterMap", name: str, form: str | None) -> None:
    """Print one register; UsageError with the nearest names where there is none of this name."""
    import json

    from rich.console import Console

    from gateway.cli.cards.card import render_card
    from gateway.cli.cards.register_card import find_registers, register_facts
    from gateway.registers import UnknownRegister, render_registers

    try:
        found = find_registers(register_map, name)
    except UnknownRegister as error:
        raise click.UsageError(str(error)) from None
    if form not in (None, "json"):
        raise click.UsageError(f"--format {form} is of the whole map; of one register there is a card, or json")
    if form == "json":
        whole = {(one["block"], one["name"]): one for one in json.loads(render_registers(register_map, "json"))}
        entries = [whole[register.block, register.name] for register in found]
        click.echo(json.dumps(entries[0] if len(entries) == 1 else entries, indent=2))
        return
    console = Console()
    for register in found:
        for part in render_card(f"{register.name} @ {register.block}", register_facts(register_map, register)):
            console.print(part, highlight=False)
