"""`restore`: a backup back into a state directory, wholly or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.rig_choice import rig_option
from gateway.cli.errors import CliError, already_exists
from gateway.cli.options import count_of, state_directory, state_option
from gateway.plain_file import is_directory
from gateway.processes import exit_codes, state_lock

EXAMPLES = ("restore kept.tar.gz --state elsewhere --dry-run", "restore kept.tar.gz --state copy")


@click.command()
@click.argument("file", type=GivenPath(dir_okay=False, exists=True))
@click.option("--force", is_flag=True, help="Also into a directory that is not empty; its content is kept beside it.")
@click.option("--dry-run", is_flag=True, help="Check FILE and say what would be restored.")
@rig_option("The rig that is meant  [default: the one that was packed]", checks=False)
@state_option("State directory of the gateway  [default: the rig's]", makes=True)
def command(*, file: Path, force: bool, dry_run: bool, state: Path | None, rig: str | None) -> None:
    """Unpack a backup into a state directory.

    Wholly or not at all. The gateway must not be running.
    """
    from gateway.cli.state_archive import ArchiveError, names_in, unpack_state
    from gateway.processes.state_directory import put_back

    try:
        names = names_in(file)
        directory = state or _place_of(file, rig)
        if not dry_run and (said := put_back(directory)):
            click.echo(said, err=True)
        if is_directory(directory) and any(directory.iterdir()) and not force:
            raise already_exists(directory, "--force replaces it and keeps the old one")
        if dry_run:
            click.echo("\n".join([*names, f"{count_of(names, 'file')} would be restored to {directory}"]))
            return
        with _not_running(directory):
            previous = unpack_state(file, directory)
    except ArchiveError as error:
        raise CliError(f"E404 {error}; nothing was changed", exit_codes.DATA) from None
    click.echo(
        f"restored {count_of(names, 'file')} to {directory}"
        + (f"; what was there is in {previous}" if previous else "")
    )


def _place_of(file: Path, rig: str | None) -> Path:
    """Return where the rig keeps its state. Of a rig that this machine does not know yet the backup is what there is: without
    --rig it went to demo's."""
    from gateway.cli.command_line.known_rigs import choose_rig
    from gateway.cli.state_archive import rig_in
    from gateway.service.supervisor.run_options import default_state_root

    packed = rig_in(file)
    if packed and rig in (None, packed):
        return default_state_root() / packed
    return state_directory(None, choose_rig(rig, None))


@contextmanager
def _not_running(directory: Path) -> Iterator[None]:
    """Holds the lock that a running gateway holds; E104 when one does. Its file may have been deleted: not the directory's."""
    if not is_directory(directory) or not any(directory.iterdir()):
        yield
        return
    with state_lock.hold_state_lock(directory) as is_ours:
        if not is_ours:
            raise CliError(
                f"E104 a gateway runs on {directory}, or a command is changing it; stop it first", exit_codes.DEVICE
            )
        yield
