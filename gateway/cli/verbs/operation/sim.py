"""`sim`: what a simulated rig is made to do while it runs: faults of its lines and its air, effects of the catalogue."""

import json
from collections.abc import Iterable
from typing import Any, Final

import click

from gateway.cli.command_line.completion_words import complete_setting_names, complete_settings
from gateway.cli.errors import CliError
from gateway.cli.options import StateChoice, json_option, state_options
from gateway.cli.subcommands import SubcommandGroup
from gateway.processes import exit_codes
from gateway.processes.state_directory import RIG_SOCKET

_COLUMN: Final = 32


EXAMPLES = ("sim set creep=on", "sim list")


@click.group(name="sim", cls=SubcommandGroup)
def command() -> None:
    """Set faults and effects on a simulated rig while it runs.

    A rehearsal at a desk: `run RIG --sim` in one terminal, `sim set cell.silent=true` in another. What is set holds until it is
    cleared or the gateway ends; each change is an event, and is audited.
    """


@command.command(name="set")
@click.argument("assignments", metavar="NAME=VALUE...", nargs=-1, required=True, shell_complete=complete_settings)
@json_option
@state_options
def set_command(*, assignments: tuple[str, ...], as_json: bool, state: StateChoice) -> None:
    """Set faults (cell.silent=true), numbers (cell.noise=0.5) and effects (creep=0.05, leak=on).

    An effect with a number gets it as its first parameter, with `on` the size of a demonstration; others by name
    (creep.creep_s=3). All of them are set, or none.
    """
    _tell(_ask(state, {"set": dict(_split(one) for one in assignments)}), as_json=as_json)


@command.command(name="clear")
@click.argument("names", metavar="[NAME...]", nargs=-1, shell_complete=complete_setting_names)
@json_option
@state_options
def clear_command(*, names: tuple[str, ...], as_json: bool, state: StateChoice) -> None:
    """Clear what is set: these names, or everything."""
    _tell(_ask(state, {"clear": list(names)} if names else {"clear_all": True}), as_json=as_json)


@command.command(name="list")
@click.option("--all", "with_parameters", is_flag=True, help="Every parameter of every effect, too.")
@json_option
@state_options
def list_command(*, with_parameters: bool, as_json: bool, state: StateChoice) -> None:
    """List what can be set, with its unit and bounds, and what is set now."""
    from gateway.service.simulation.setting_names import FAULTS, SURROUNDINGS, effect_settings

    answer = _ask(state, {})
    parameters = effect_settings()
    if as_json:
        names = [{"name": one.name, "unit": one.unit, "what": one.what, "allowed": one.allowed}
                 for one in (*FAULTS, *SURROUNDINGS, *parameters)]  # fmt: skip
        click.echo(json.dumps(answer | {"names": names}, indent=2))
        return
    _show_names("faults", FAULTS)
    _show_names("around the tool", SURROUNDINGS)
    if with_parameters:
        _show_names("effects", parameters)
    else:
        from gateway.catalogue.all_effects import EFFECTS

        click.echo(
            f"effects (NAME=on, or a number; --all for their parameters)\n  {', '.join(e.name for e in EFFECTS)}"
        )
    _tell(answer, as_json=False)


def _split(assignment: str) -> tuple[str, str]:
    name, equals, value = assignment.partition("=")
    if not equals or not name or not value:
        raise click.UsageError(f"{assignment} is not NAME=VALUE such as cell.silent=true")
    return name.strip(), value.strip()


def _ask(state: StateChoice, request: dict[str, Any]) -> dict[str, Any]:
    """Have control judge and audit it, then the simulated rig do it; return what is set."""
    from gateway.cli.control_socket import ask

    request = {"do": "sim"} | request
    ask(state.directory, request)
    try:
        return ask(state.directory, request, RIG_SOCKET)
    except CliError as error:
        if error.exit_code != exit_codes.DEVICE:
            raise
        raise CliError(
            "E135 the simulated rig's process does not answer: it may be starting again; wait a second and repeat",
            exit_codes.DEVICE,
        ) from None


def _tell(answer: dict[str, Any], *, as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps(answer))
        return
    click.echo(f"rig {answer['rig']}: {'set now' if answer['set'] else 'nothing is set'}")
    for name, value in answer["set"].items():
        click.echo(f"  {name}={'on' if value is True else format(value, 'g')} {_unit_of(name)}".rstrip())
    for note in answer["notes"]:
        click.echo(f"note: {note}")


def _unit_of(name: str) -> str:
    from gateway.service.simulation.setting_names import find_unit

    unit = find_unit(name)
    return "" if unit == "1" else unit


def _show_names(title: str, settings: Iterable[Any]) -> None:
    click.echo(title)
    for one in settings:
        click.echo(f"  {one.name:<{_COLUMN}} {one.what} ({one.allowed})")
