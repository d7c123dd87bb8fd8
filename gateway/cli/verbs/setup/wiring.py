"""`wiring`: one page for whoever wires a cell and sets up its robot or PLC, from the rig file."""

import shutil
import sys

import click

from gateway import defaults
from gateway.cli.command_line.completion_words import complete_rigs
from gateway.cli.errors import CliError

EXAMPLES = ("wiring demo", "wiring irc5-cell --format markdown")


@click.command()
@click.argument("rig_name", metavar="RIG", default=defaults.RIG, shell_complete=complete_rigs)
@click.option("--format", "form", type=click.Choice(["text", "markdown", "json"]), default="text", show_default=True)
@click.option("--json", "as_json", is_flag=True, help="The same as --format json.")
def command(*, rig_name: str, form: str, as_json: bool) -> None:
    """Print the wiring page of a rig.

    Ports, pins and switches of its devices; what to set in an ABB IRC5, a Siemens S7, TwinCAT, CODESYS and a Universal Robot;
    mbpoll lines to try it. RIG is a shipped name or a file (default: demo). Opens no port.
    """
    from gateway.clients import MissingRegisterError
    from gateway.clients.wiring import TEXT_WIDTH, render_page, wiring_page
    from gateway.profiles import load_rig

    rig = load_rig(rig_name)
    try:
        title, sections = wiring_page(rig, rig_name)
    except MissingRegisterError as error:
        raise CliError(f"E185 {error}: masters need them; copy them from {defaults.REGISTER_MAP}") from None
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else TEXT_WIDTH
    click.echo(render_page(title, sections, "json" if as_json else form, width), nl=False)
