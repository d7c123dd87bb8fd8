"""`registers`: the Modbus map as a table, or as the client of a robot or PLC, from the same file that the server answers by."""

from typing import Final

import click

from gateway import defaults
from gateway.cli.errors import CliError

TABLES: Final = ("markdown", "csv", "json")
CLIENTS: Final = ("rapid", "scl", "st", "urscript", "c", "python")


@click.command()
@click.option("--format", "form", type=click.Choice([*TABLES, *CLIENTS]), default="markdown", show_default=True)
@click.option(
    "--map", "map_name", default=None, metavar="NAME", help=f"Map name or file.  [default: {defaults.REGISTER_MAP}]"
)
@click.option("--rig", "rig_name", default=None, metavar="RIG", help="Rig whose map, address and port a client gets.")
def command(*, form: str, map_name: str | None, rig_name: str | None) -> None:
    """Print the register table, or the whole client of a robot or PLC.

    rapid: ABB IRC5 over sockets. scl: S7-1200/1500, MB_CLIENT. st: TwinCAT 3 and CODESYS V3. urscript: Universal Robots. c: C99
    and POSIX sockets. python: standard library only.
    """
    from gateway.profiles import load_register_map, load_rig
    from gateway.registers import render_registers

    rig = load_rig(rig_name) if rig_name else None
    register_map = rig.register_map if rig and not map_name else load_register_map(map_name or defaults.REGISTER_MAP)
    if form in TABLES:
        click.echo(render_registers(register_map, form), nl=False)
        return
    from gateway.clients import MissingRegisterError, endpoint_of, render_client

    try:
        click.echo(render_client(register_map, form, endpoint_of(rig)), nl=False)
    except MissingRegisterError as error:
        raise CliError(f"E185 {error}: a {form} client needs them; copy them from {defaults.REGISTER_MAP}") from None
