"""`backup`: the state directory in one file."""

from pathlib import Path

import click

from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.errors import already_exists, no_state_directory
from gateway.cli.options import StateChoice, count_of, state_options
from gateway.plain_file import exists, is_directory

EXAMPLES = ("backup cell.tar.gz", "backup today.tar.gz --rig demo")


@click.command()
@click.argument("file", type=GivenPath(dir_okay=False))
@click.option("--force", is_flag=True, help="Overwrite FILE.")
@state_options
def command(*, file: Path, force: bool, state: StateChoice) -> None:
    """Pack a state directory into FILE (tar.gz).

    Calibrations, recordings, events. The gateway may be running.
    """
    from gateway.cli.state_archive import links_in, pack_state

    directory = state.directory
    if not is_directory(directory):
        raise no_state_directory(directory)
    if file.absolute().parent.resolve().is_relative_to(directory.resolve()):
        raise click.UsageError(
            f"{file} is in {directory} itself: each backup would pack those before it; name a file elsewhere"
        )
    if exists(file) and not force:
        raise already_exists(file)
    links, names = links_in(directory), pack_state(directory, file)
    click.echo(f"packed {count_of(names, 'file')} of {directory} into {file}, {file.stat().st_size / 1e3:.1f} kB")
    if links:
        click.echo(
            f"left out, for a backup holds no links: {', '.join(links)}; copy what they lead to as well", err=True
        )
