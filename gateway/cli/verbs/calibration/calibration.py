"""`calibration`: the numbered calibrations of a rig: list, show, use, go back, compare, take along.

A running gateway is asked through its control socket, so that the change makes no bump; without one the store is changed
under the lock that a gateway would hold.
"""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.completion_words import complete_calibration_numbers, complete_calibrations
from gateway.cli.command_line.folding import fold_entry
from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.known_rigs import tell_rig_fault
from gateway.cli.command_line.listed_number import ListedNumber
from gateway.cli.errors import CliError, already_exists
from gateway.cli.options import StateChoice, json_option, state_options
from gateway.cli.subcommands import SubcommandGroup
from gateway.plain_file import exists
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.bsfm import Calibration
    from gateway.numbered_documents.store import SelectedDocument, StoredDocument


EXAMPLES = ("calibration list", "calibration compare 1 demo --plot loops.html")


@click.group(name="calibration", cls=SubcommandGroup)
def command() -> None:
    """List, show, use, compare and export calibrations."""


@command.command(name="list")
@state_options
@json_option
def list_command(*, state: StateChoice, as_json: bool) -> None:
    """List the calibrations of a state directory; * is in use, x was rejected."""
    from gateway.cli.calibration.listing import describe_calibration
    from gateway.cli.calibration.store_access import open_store
    from gateway.numbered_documents.selection import OWN

    store = open_store(state.directory, state.rig)
    selected, entries = store.find_selected(), store.list()
    notes = [*selected.notes, *_tell_hidden(store.built_in, selected, state.rig)]
    if as_json:
        facts = {
            "active": _number(selected),
            "notes": notes,
            "built_in": _built_in_facts(store.built_in, selected),
            "calibrations": [_facts(entry, selected) for entry in entries],
        }
        click.echo(json.dumps(facts, indent=2))
        return
    for note in notes:
        click.echo(note, err=True)
    lines = []
    if store.built_in:
        mark = "*" if selected.selection.number is None else " "
        description = describe_calibration(store.built_in, _slots(selected, OWN), is_own=True)
        lines += fold_entry(store.built_in.number, description, mark)
    for entry in entries:
        is_rejected = entry.document is not None and bool(entry.document.rejected)
        mark = "*" if selected.selection.number == entry.number else "x" if is_rejected else " "
        slots, unusable = _slots(selected, entry.number), [f"unusable: {entry.fault}"]
        lines += fold_entry(
            entry.number, describe_calibration(entry.document, slots) if entry.document else unusable, mark
        )
    click.echo("\n".join(lines), nl=bool(lines))


@command.command(name="show")
@click.argument("which", metavar="[N]", required=False, shell_complete=complete_calibrations)
@state_options
@json_option
def show_command(*, which: str | None, state: StateChoice, as_json: bool) -> None:
    """Show calibration N (default: the one in use) with all its numbers."""
    from gateway.calibrations.store import as_text
    from gateway.cli.calibration.store_access import find_calibration, in_use, open_store

    store = open_store(state.directory, state.rig)
    calibration = find_calibration(store, which) if which else in_use(store, state.rig)
    click.echo(json.dumps(asdict(calibration), indent=2) if as_json else as_text(calibration), nl=as_json)


@command.command(name="use")
@click.argument("number", metavar="N", type=ListedNumber("calibration"), shell_complete=complete_calibration_numbers)
@click.option("--force", is_flag=True, help="Also one whose fit was rejected.")
@state_options
@json_option
def use_command(*, number: int, force: bool, state: StateChoice, as_json: bool) -> None:
    """Use calibration N from now on.

    A running gateway swaps it without a bump. `calibration rollback` goes back.
    """
    from gateway.cli.calibration.store_access import change_calibration

    _tell_change(change_calibration(state.directory, state.rig, {"use": number, "force": force}), as_json=as_json)


@command.command(name="rollback")
@state_options
@json_option
def rollback_command(*, state: StateChoice, as_json: bool) -> None:
    """Use again what was in use before the last change."""
    from gateway.cli.calibration.store_access import change_calibration

    _tell_change(change_calibration(state.directory, state.rig, {"rollback": True}), as_json=as_json)


@command.command(name="compare")
@click.argument("a", metavar="A", shell_complete=complete_calibrations)
@click.argument("b", metavar="B", shell_complete=complete_calibrations)
@click.option("--plot", type=GivenPath(dir_okay=False), help="Draw both loops into this HTML file.")
@state_options
@json_option
def compare_command(*, a: str, b: str, plot: Path | None, state: StateChoice, as_json: bool) -> None:
    """Compare calibrations A and B over the voltages that both cover.

    Numbers of the store, shipped names or files. Differences are B minus A.
    """
    from gateway.cli.calibration.comparison import compare_calibrations, table
    from gateway.cli.calibration.store_access import find_calibration, open_store

    store = open_store(state.directory, state.rig)
    if plot:
        from gateway.cli.diagnosis.outputs import check_page

        check_page(plot, [Path(a), Path(b)])
    first, second = find_calibration(store, a), find_calibration(store, b)
    try:
        comparison = compare_calibrations(first, second)
    except ValueError as error:
        raise CliError(f"E433 {error}", exit_codes.DATA) from None
    if plot:
        from gateway.cli.calibration.comparison_page import comparison_page
        from gateway.cli.calibration.measured_points import measured_points

        points = {name: measured_points(each, state.directory) for name, each in (("A", first), ("B", second))}
        from gateway.cli.diagnosis.outputs import write_all

        write_all({plot: comparison_page(comparison, points)})
    click.echo(json.dumps(comparison.facts(), indent=2) if as_json else table(comparison))


@command.command(name="export")
@click.argument("which", metavar="N", shell_complete=complete_calibrations)
@click.option("--yaml", "yaml_file", type=GivenPath(allow_dash=True), help="YAML; - is stdout.")
@click.option("--c", "c_directory", type=GivenPath(file_okay=False), help="C header and source.")
@click.option("--force", is_flag=True, help="Overwrite.")
@state_options
def export_command(
    *, which: str, yaml_file: Path | None, c_directory: Path | None, force: bool, state: StateChoice
) -> None:
    """Take calibration N along, as YAML (default) or as C."""
    from gateway.calibrations.store import as_text
    from gateway.cli.calibration.store_access import find_calibration, open_store

    if yaml_file and c_directory:
        raise click.UsageError("--yaml or --c, not both")
    calibration = find_calibration(open_store(state.directory, state.rig), which)
    if c_directory:
        _write({c_directory / name: text for name, text in _c_source(calibration).items()}, force=force)
    elif yaml_file and yaml_file != Path("-"):
        _write({yaml_file: as_text(calibration)}, force=force)
    else:
        click.echo(as_text(calibration), nl=False)


def _c_source(calibration: "Calibration") -> dict[str, str]:
    from gateway.bsfm.c_export.code import c_source

    try:
        return c_source(calibration)
    except ValueError as error:
        raise CliError(f"E433 {error}", exit_codes.DATA) from None


def _write(texts: dict[Path, str], *, force: bool) -> None:
    """All or, where one is there already, none."""
    from gateway.cli.diagnosis.outputs import write_all

    for path in texts:
        if exists(path) and not force:
            raise already_exists(path)
        path.parent.mkdir(parents=True, exist_ok=True)
    write_all(texts)
    for path in texts:
        click.echo(f"wrote {path}", err=True)


def _number(selected: "SelectedDocument[Calibration]") -> int | None:
    return selected.document.number if selected.document else None


def _tell_hidden(own: "Calibration | None", selected: "SelectedDocument[Calibration]", rig: str) -> list[str]:
    """Return why the rig's own calibration is not listed; nothing where it is."""
    if own:
        return []
    is_used = ", in use," if selected.selection.number is None else ""
    why = tell_rig_fault(rig) or "give the rig's file by --rig"
    return [f"the rig's own{is_used} is not shown: {why}"]


def _built_in_facts(own: "Calibration | None", selected: "SelectedDocument[Calibration]") -> dict[str, Any] | None:
    """Return the rig's own calibration, which is no file of the store."""
    from gateway.numbered_documents.selection import OWN
    from gateway.registers.upload.coefficients import model_hash

    if own is None:
        return None
    active, slots = selected.selection.number is None, _slots(selected, OWN)
    return {"number": own.number, "name": own.name, "active": active, "slots": slots, "model_hash": model_hash(own)}


def _facts(entry: "StoredDocument[Calibration]", selected: "SelectedDocument[Calibration]") -> dict[str, Any]:
    from gateway.registers.upload.coefficients import model_hash

    return {
        "number": entry.number,
        "active": selected.selection.number == entry.number,
        "slots": _slots(selected, entry.number),
        "model_hash": entry.document and model_hash(entry.document),
        "fault": entry.fault or None,
        "calibration": asdict(entry.document) if entry.document else None,
    }


def _slots(selected: "SelectedDocument[Calibration]", number: int) -> list[int]:
    """Return the slots that hold this calibration."""
    return [slot for slot, number_there in enumerate(selected.pointer.slots) if number_there == number]


def _tell_change(answer: dict[str, Any], *, as_json: bool) -> None:
    click.echo(json.dumps(answer) if as_json else answer["said"])
