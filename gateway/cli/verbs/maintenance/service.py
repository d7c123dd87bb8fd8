"""`service`: a gateway that systemd keeps: install, uninstall, status, logs."""

import json
import os
import shlex
from pathlib import Path
from typing import Any, Final

import click

from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.errors import CliError
from gateway.cli.options import json_option
from gateway.cli.subcommands import SubcommandGroup
from gateway.plain_file import is_directory
from gateway.processes import exit_codes


def _existing_root(context: click.Context, parameter: click.Parameter, value: Path) -> Path:
    """Refuse one that is not there: by a slip of the pen a tree of an image came to be beside the image."""
    if not is_directory(value):
        raise click.BadParameter(f"{value} is not there: mkdir -p makes a new one")
    return value


_ROOT = click.option(
    "--root",
    type=GivenPath(file_okay=False),
    callback=_existing_root,
    default=Path("/"),
    help="Write below this folder, and start nothing: for an image.",
)


EXAMPLES = (
    "service install irc5-cell --dry-run --command /opt/force-gateway/bin/force-gateway",
    "service install irc5-cell --dry-run --allow 192.168.125.0/24 --command /opt/force-gateway/bin/force-gateway",
)


@click.group(name="service", cls=SubcommandGroup)
def command() -> None:
    """Keep a gateway running by systemd."""


@command.command(name="install")
@click.argument("rig")
@click.option("--dry-run", is_flag=True, help="Print the files and commands, change nothing.")
@click.option(
    "--allow",
    "networks",
    multiple=True,
    metavar="NETWORK",
    help="Who may reach it besides this machine, such as 192.168.125.0/24; more than once  [default: as the rig says]",
)
@click.option("--command", "program", type=GivenPath(), help="The program  [default: this one]")
@_ROOT
def install_command(*, rig: str, dry_run: bool, networks: tuple[str, ...], program: Path | None, root: Path) -> None:
    """Write a hardened unit for RIG, the udev rule and the service's user, and start it.

    The rig is checked first. The unit is restarted when its control loop stands still, and not when its configuration is
    at fault (exit codes 2, 65, 77, 78). Recordings, calibrations and events are kept in /var/lib/force-gateway/RIG.
    """
    from gateway.cli.system_service.installation import install_service, plan_installation
    from gateway.profiles import load_rig
    from gateway.service.supervisor.run_options import stem_of

    plan = plan_installation(rig, load_rig(rig), networks=networks, command=program)
    if dry_run:
        click.echo("\n".join(f"# /{name}\n{text}" for name, text in plan.files.items()))
        click.echo("\n".join(" ".join(words) for words in plan.commands))
        return
    written, ran = install_service(plan, root)
    for path in written:
        click.echo(f"wrote {path}")
    for note in plan.notes:
        click.echo(note)
    if ran:
        click.echo(
            f"{plan.unit} ran already and goes on as it was: systemctl restart {plan.unit} takes what is new (the force is "
            "ramped to 0 first)"
        )
    elif root == Path("/"):
        click.echo(f"{plan.unit} runs; force-gateway service status, force-gateway service logs")
        click.echo(f"for other verbs: --state /var/lib/force-gateway/{stem_of(rig)}, as root")
    else:
        click.echo(f"not enabled yet: systemctl --root {shlex.quote(str(root.absolute()))} enable {plan.unit}")


@command.command(name="uninstall")
@click.argument("rig")
@_ROOT
def uninstall_command(*, rig: str, root: Path) -> None:
    """Stop the service of RIG and remove its unit; what it has recorded stays."""
    from gateway.cli.system_service.installation import uninstall_service
    from gateway.service.supervisor.run_options import stem_of

    try:
        click.echo(f"removed {uninstall_service(stem_of(rig), root)}; /var/lib/force-gateway/{stem_of(rig)} stays")
    except PermissionError as error:
        raise CliError(f"E107 {error.filename}: only root may remove it", exit_codes.PERMISSION) from None


@command.command(name="status")
@click.argument("rig", required=False)
@_ROOT
@json_option
def status_command(*, rig: str | None, root: Path, as_json: bool) -> None:
    """Show each service: whether it runs, since when, how often it was started again, what it says of itself.

    Exit code 1 when one of them does not run.
    """
    from gateway.cli.system_service.unit_status import read_status

    found = [read_status(unit) for unit in _units_of(rig, root)]
    if as_json:
        click.echo(json.dumps([one.facts for one in found], indent=2))
    else:
        click.echo("\n".join(one.sentence for one in found))
    if not all(one.is_running for one in found):
        raise click.exceptions.Exit(exit_codes.FAILED)


def _units_of(rig: str | None, root: Path) -> list[str]:
    """Return the unit of a rig, or all that are there. CliError E107 for none."""
    from gateway.cli.system_service.installation import installed_units
    from gateway.cli.system_service.unit_file import unit_name
    from gateway.service.supervisor.run_options import stem_of

    units = [unit_name(stem_of(rig))] if rig else installed_units(root)
    if not units:
        raise CliError("E107 no service is installed: force-gateway service install RIG", exit_codes.DATA)
    return units


_TO_JOURNALCTL: Final = {"ignore_unknown_options": True, "help_option_names": ["--help"]}
"""-h is an hour in `--since -1h`."""


@command.command(name="logs", context_settings=_TO_JOURNALCTL)
@click.argument("rig", required=False)
@click.argument("options", nargs=-1, type=click.UNPROCESSED)
def logs_command(*, rig: str | None, options: tuple[str, ...]) -> None:
    """Show the journal of RIG's service, or of all. OPTIONS go to journalctl: -f, --since -1h, FORCE_GATEWAY_CODE=A310.

    `force-gateway events` shows the same events from the state directory, without systemd.
    """
    if rig and (rig.startswith("-") or "=" in rig):  # an option of journalctl's: all services are meant
        options, rig = (rig, *options), None
    units = _units_of(rig, Path("/"))
    words: list[Any] = ["journalctl", *(word for unit in units for word in ("--unit", unit)), *options]
    try:
        os.execvp(words[0], words)
    except FileNotFoundError:
        raise CliError(
            "E108 journalctl is not on this machine; force-gateway events reads the gateway's own", exit_codes.DEVICE
        ) from None
