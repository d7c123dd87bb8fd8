"""`report`: what somebody who helps from afar needs, in one file without secrets."""

import shlex
from pathlib import Path

import click

from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.errors import already_exists
from gateway.cli.options import StateChoice, state_options
from gateway.plain_file import exists

EXAMPLES = ("report for-support.tar.gz", "report --show")


@click.command()
@click.argument("file", type=GivenPath(dir_okay=False), default=Path("force-gateway-report.tar.gz"))
@click.option("--force", is_flag=True, help="Overwrite FILE.")
@click.option("--show", is_flag=True, help="Print what would go in instead.")
@state_options
def command(*, file: Path, force: bool, show: bool, state: StateChoice) -> None:
    """Pack a support bundle without secrets into FILE (tar.gz).

    Versions, rig, events, live state, lists of files. No keys, passwords, tokens or recordings; addresses of masters
    become master-1, master-2 ... Look at it before you send it: --show prints all of it. The gateway may be running
    or not.
    """
    from gateway.cli.support_bundle import collect_parts, pack_bundle, parts_missing
    from gateway.profiles import read_rig

    if exists(file) and not (force or show):
        raise already_exists(file)
    parts = collect_parts(state.directory, lambda: read_rig(state.rig).texts.items())
    if show:
        click.echo("\n".join(f"== {name}\n{text}" for name, text in parts.items()))
        return
    pack_bundle(parts, file)
    size, missing = f"{file.stat().st_size / 1e3:.1f} kB", parts_missing(parts)
    packed = ", ".join(name for name in parts if name not in missing)
    click.echo(f"packed {packed} into {file}, {size}; `tar -xzOf {shlex.quote(str(file))}` prints what is in it")
    for name in missing:
        click.echo(f"{name} {parts[name].splitlines()[0]}", err=True)
