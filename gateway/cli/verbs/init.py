"""`init`: a commented rig file to start from. Asks nothing and overwrites nothing."""

import re
from pathlib import Path

import click

from gateway.cli.errors import already_exists


@click.command()
@click.argument("name", default="my-cell")
def command(*, name: str) -> None:
    """Write a commented rig file to start from.

    NAME.yaml, in the current directory (default: my-cell).
    """
    from gateway.cli.starter_rig import starter_rig
    from gateway.profiles import list_shipped

    target = Path(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
    if target.name != str(target):
        raise click.UsageError(f"{target} is not in the current directory; give a name alone, such as my-cell")
    if not re.fullmatch(r"[a-z0-9][a-z0-9._-]{0,62}", target.stem):
        raise click.UsageError(f"{target.stem} is no name for a rig: small letters, digits, . _ -, such as my-cell")
    if target.stem in list_shipped("rig"):
        raise click.UsageError(f"{target.stem} is the name of a shipped rig; choose another")
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(starter_rig(target.stem))
    except FileExistsError:
        raise already_exists(target, "choose another name") from None
    click.echo(f"wrote {target}; next:")
    for line, why in (
        (f"run {target} --sim", "tries it without hardware"),
        ("ports", "lists what to put into the lines marked EDIT"),
        (f"check {target}", "tells every fault with its line"),
        (f"run {target}", "runs it"),
        ("hold 12", "in another terminal: holds 12 N, with the heartbeat that the rig's lease wants"),
    ):
        click.echo(f"  force-gateway {line:<28} {why}")
