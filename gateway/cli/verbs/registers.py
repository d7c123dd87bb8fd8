"""`registers`: the Modbus map as a table, from the same file that the server answers by."""

import click

from gateway import defaults


@click.command()
@click.option("--format", "form", type=click.Choice(["markdown", "csv", "json"]), default="markdown", show_default=True)
@click.option(
    "--map", "map_name", default=defaults.REGISTER_MAP, metavar="NAME", show_default=True, help="Map name or file."
)
def command(*, form: str, map_name: str) -> None:
    """Print the register table."""
    from gateway.profiles import load_register_map
    from gateway.registers import render_registers

    click.echo(render_registers(load_register_map(map_name), form), nl=False)
