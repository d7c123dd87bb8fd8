"""`init`: a commented rig file to start from. At a terminal it asks for the devices, and the devices; else it asks nothing.
Overwrites nothing."""

import errno
import os
import re
import sys
from pathlib import Path

import click

from gateway.cli.errors import already_exists
from gateway.plain_file import exists

EXAMPLES = ("init left-cell", "init right-cell --no-guided")


@click.command()
@click.argument("name", default="my-cell")
@click.option(
    "--guided/--no-guided",
    default=None,
    help="Ask for ports, devices and forces, and ask the devices which they are. Default: at a terminal.",
)
def command(*, name: str, guided: bool | None) -> None:
    """Write a commented rig file to start from.

    NAME.yaml, in the current directory (default: my-cell). At a terminal it asks first: which ports, which devices (they are
    asked, too, what changes nothing), which forces; the file is one that `check` accepts.
    """
    from gateway.cli.setup.starter_rig import starter_rig
    from gateway.processes.durable_file import create_text
    from gateway.profiles import list_shipped

    target = Path(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
    if target.name != str(target):
        raise click.UsageError(f"{target} is not in the current directory; give a name alone, such as my-cell")
    if not re.fullmatch(r"[a-z0-9][a-z0-9._-]{0,62}", target.stem):
        raise click.UsageError(f"{target.stem} is no name for a rig: small letters, digits, . _ -, such as my-cell")
    if target.stem in list_shipped("rig"):
        raise click.UsageError(f"{target.stem} is the name of a shipped rig; choose another")
    if exists(target):
        raise already_exists(target, "choose another name")
    if not os.access(".", os.W_OK):  # before anything is asked
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(target))
    is_guided = sys.stdin.isatty() and sys.stdout.isatty() if guided is None else guided
    text = _ask(target.stem) if is_guided else starter_rig(target.stem)
    try:
        create_text(target, text)
    except FileExistsError:
        raise already_exists(target, "choose another name") from None
    most = re.search(r"^  force_max_n: ([\d.]+)", text, re.MULTILINE)
    force = f"{min(12.0, float(most[1]) if most else 12.0):g}"
    click.echo(f"wrote {target}; next:")
    for line, why in (
        (f"run {target} --sim", "tries it without hardware"),
        ("ports", "lists what to put into the lines marked EDIT"),
        (f"check {target}", "tells every fault with its line"),
        (f"run {target}", "runs it"),
        (f"hold {force}", f"in another terminal: holds {force} N, with the heartbeat that the rig's lease wants"),
    ):
        click.echo(f"  force-gateway {line:<28} {why}")


def _ask(name: str) -> str:
    from gateway.cli.setup.guided_rig import ask_rig

    return ask_rig(name)
