"""`plant`: the numbered plants of a rig: list, show, compare, add, use, go back.

What control compensates of a plant, and what it cannot and why, is said before it is used. A running gateway is asked
through its control socket; without one the store is changed under the lock that a gateway would hold.
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.completion_words import complete_plant_numbers, complete_recordings
from gateway.cli.command_line.folding import fold_entry
from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.known_rigs import tell_rig_fault
from gateway.cli.command_line.listed_number import ListedNumber
from gateway.cli.options import StateChoice, json_option, state_options
from gateway.cli.subcommands import SubcommandGroup

if TYPE_CHECKING:
    from gateway.cli.plants.comparison_page import SimulatedPair
    from gateway.numbered_documents.store import StoredDocument
    from gateway.plants.store import NumberedPlant
    from gateway.profiles import PlantProfile


EXAMPLES = ("plant list", "plant compare 0 paper-slide")


@click.group(name="plant", cls=SubcommandGroup)
def command() -> None:
    """List, show, compare, add and use plants."""


@command.command(name="list")
@state_options
@json_option
def list_command(*, state: StateChoice, as_json: bool) -> None:
    """List the plants of a state directory; * is in use, 0 the rig's own."""
    from gateway.cli.plants.store_access import open_store, plant_facts

    store = open_store(state.directory)
    selected, entries = store.find_selected(), store.list()
    active = selected.selection.number or 0
    if as_json:
        plants = [plant_facts(entry, is_active=entry.number == active) for entry in entries]
        click.echo(json.dumps({"active": active, "notes": selected.notes, "plants": plants}, indent=2))
        return
    for note in selected.notes:
        click.echo(note, err=True)
    for number, description in [(0, ["the rig's own"]), *((entry.number, _describe(entry)) for entry in entries)]:
        for line in fold_entry(number, description, "*" if number == active else " "):
            click.echo(line)


def _describe(entry: "StoredDocument[NumberedPlant]") -> list[str]:
    if entry.document is None:
        return [f"unusable: {entry.fault}"]
    provenance = entry.document.provenance
    causes = ", ".join(cause.name for cause in provenance.causes) or "no cause"
    source = provenance.file or ", ".join(each.name for each in provenance.recordings)
    return [f"{provenance.made_utc}  {provenance.verdict or 'added'}: {causes}", f"from {source}"]


@command.command(name="show")
@click.argument("number", metavar="N", type=ListedNumber("plant", least=0), shell_complete=complete_plant_numbers)
@state_options
@json_option
def show_command(*, number: int, state: StateChoice, as_json: bool) -> None:
    """Show plant N (0: the rig's own): where it comes from, what is compensated of it, and its file."""
    from gateway.cli.plants.descriptions import describe_compensation, describe_provenance
    from gateway.cli.plants.store_access import all_plant_facts, load_numbered, load_rig_or_none
    from gateway.plants.store import as_text
    from gateway.profiles.kinds.plant_writer import plant_text

    plant, rig = load_numbered(state, number), load_rig_or_none(state)
    if as_json:
        click.echo(json.dumps(all_plant_facts(plant, rig), indent=2))
        return
    text = as_text(plant) if number else plant_text(plant.profile)
    fault = "" if rig else tell_rig_fault(state.rig)
    for line in (*describe_provenance(plant), *describe_compensation(plant, rig, fault), "", text.rstrip()):
        click.echo(line)


@command.command(name="compare")
@click.argument("a", metavar="A", shell_complete=complete_plant_numbers)
@click.argument("b", metavar="B", shell_complete=complete_plant_numbers)
@click.option("--plot", type=GivenPath(dir_okay=False), help="Write what differs into this HTML file.")
@click.option(
    "--recording",
    metavar="RECORDING",
    shell_complete=complete_recordings,
    help="With --plot: run both over this recording.",
)
@state_options
@json_option
def compare_command(*, a: str, b: str, state: StateChoice, as_json: bool, **drawn: Any) -> None:
    """Compare plants A and B: every number that differs.

    Numbers of the store (0: the rig's own), shipped names or files.
    """
    from gateway.cli.plants.descriptions import describe_difference, differing_numbers
    from gateway.cli.plants.store_access import find_plant

    plot, recording = drawn["plot"], drawn["recording"]
    if plot:
        from gateway.cli.diagnosis.outputs import check_page

        check_page(plot, [Path(name) for name in (a, b, recording) if name])
    first, second = find_plant(state, a), find_plant(state, b)
    differing = differing_numbers(first, second)
    if plot:
        from gateway.cli.plants.comparison_page import plant_comparison_page

        pair = _simulate_both(recording, (first, second), state) if recording else None
        if pair and not as_json:
            click.echo(pair.sentence)
        from gateway.cli.diagnosis.outputs import write_all

        write_all({plot: plant_comparison_page(differing, (a, b), pair)})
    elif recording:
        raise click.UsageError("--recording is drawn into the file of --plot, which is missing")
    if as_json:
        click.echo(json.dumps({"a": a, "b": b, "differing": differing}, indent=2))
        return
    click.echo("\n".join(describe_difference(differing, a, b)))


def _simulate_both(recording: str, plants: "tuple[PlantProfile, PlantProfile]", state: StateChoice) -> "SimulatedPair":
    """Run both plants over a recording, a number of the state directory or a file."""
    from gateway.cli.diagnosis.inputs import read_sources
    from gateway.cli.plants.comparison_page import simulate_pair
    from gateway.extras import require

    require("numba")
    sources = read_sources([recording], rig=None, columns=None, state=state.directory)
    return simulate_pair(sources.measurements[0], plants)


@command.command(name="add")
@click.argument("file", metavar="FILE", type=GivenPath(dir_okay=False))
@state_options(makes=True)
@json_option
def add_command(*, file: Path, state: StateChoice, as_json: bool) -> None:
    """Add a plant file as the next number; `diagnose --save` adds what it has found by itself."""
    from gateway.cli.plants.store_access import add_file

    number = add_file(state, file)
    click.echo(
        json.dumps({"number": number}) if as_json else f"plant {number}; force-gateway plant use {number} uses it"
    )


@command.command(name="use")
@click.argument("number", metavar="N", type=ListedNumber("plant", least=0), shell_complete=complete_plant_numbers)
@click.option(
    "--before",
    metavar="RECORDING",
    shell_complete=complete_recordings,
    help="The run that the watch compares with; default the newest one before.",
)
@click.option("--dry-run", is_flag=True, help="Only say what would be compensated.")
@state_options
@json_option
def use_command(*, number: int, before: str | None, dry_run: bool, state: StateChoice, as_json: bool) -> None:
    """Compensate what plant N says from now on; 0: the rig's own plant.

    A running gateway takes it while its output is disabled. `plant rollback` goes back.
    """
    from gateway.cli.plants.descriptions import compensation_facts, describe_compensation
    from gateway.cli.plants.store_access import change_plant, load_rig_or_none, load_stored, open_store

    plant, rig = load_stored(open_store(state.directory), number) if number else None, load_rig_or_none(state)
    if not as_json and plant:
        click.echo("\n".join(describe_compensation(plant, rig)))
    answer: dict[str, Any] = {"number": number} | (compensation_facts(plant, rig) if plant else {})
    if not dry_run:
        answer |= change_plant(state, {"use": number}, before)
    click.echo(json.dumps(answer)) if as_json else _tell(answer)


@command.command(name="rollback")
@state_options
@json_option
def rollback_command(*, state: StateChoice, as_json: bool) -> None:
    """Use again what was in use before the last change."""
    from gateway.cli.plants.store_access import change_plant

    answer = change_plant(state, {"rollback": True}, None)
    click.echo(json.dumps(answer)) if as_json else _tell(answer)


def _tell(answer: dict[str, Any]) -> None:
    for name in ("said", "reference"):
        if answer.get(name):
            click.echo(answer[name])
