"""`check`: is this file right? Every fault at once, as file:line:column, before anything moves. Any kind of profile, told
by its keys."""

import json
from typing import TYPE_CHECKING, Any

import click

from gateway import defaults
from gateway.cli.options import count_of, json_option
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.profiles import Checked, ProfileFault, Rig


@click.command()
@click.argument("file", metavar="RIG", default=defaults.RIG)
@json_option
@click.pass_context
def command(context: click.Context, *, file: str, as_json: bool) -> None:
    """Check a rig and every profile that it names.

    RIG is a shipped name or a file (default: demo). A device, plant, calibration, map or plan of its own is checked as what
    it is. Opens no port.
    """
    from gateway.profiles import check_file

    checked = check_file(file)
    if as_json:
        click.echo(json.dumps(_document(checked), indent=2))
    else:
        _print(file, checked)
    context.exit(exit_codes.CONFIGURATION if checked.faults else exit_codes.OK)


def _print(file: str, checked: "Checked") -> None:
    """Faults and warnings as compilers print theirs, on stderr; what was read, on stdout."""
    from gateway.cli.profile_facts import facts
    from gateway.profiles import CALLED

    for fault in checked.faults:
        click.echo(str(fault), err=True)
    for warning in checked.warnings:
        click.echo(f"{warning} (warning)", err=True)
    is_rig = checked.kind == "rig"
    if not is_rig:
        click.echo(f"{file} is {CALLED[checked.kind]}; check takes it as one", err=bool(checked.faults))
    if checked.faults:
        outcome = "rig does not start" if is_rig else f"{CALLED[checked.kind].partition(' ')[2]} cannot be used"
        click.echo(f"{count_of(checked.faults, 'fault')}; this {outcome}", err=True)
        return
    for name, value in facts(checked).items():
        click.echo(f"{name:<12} {value}")
    for note in _notes(checked.value) if is_rig else ():
        click.echo(f"{'note':<12} {note}")
    warnings = f", {count_of(checked.warnings, 'warning')}" if checked.warnings else ""
    click.echo(f"{'ok':<12} no faults{warnings}")


def _notes(rig: "Rig") -> list[str]:
    return [*rig.notes, *([rig.why_unwatched] if rig.why_unwatched else [])]


def _document(checked: "Checked") -> dict[str, Any]:
    """Of a rig: its facts under `rig`; of anything else: one sentence under its kind."""
    from gateway.cli.profile_facts import facts

    documents: dict[str, Any] = {"kind": checked.kind, "rig": None}
    if not checked.faults:
        documents |= facts(checked) if checked.kind != "rig" else {"rig": facts(checked, whole=True)}
    return {
        "ok": not checked.faults,
        "faults": [_fault(fault) for fault in checked.faults],
        "warnings": [_fault(warning) for warning in checked.warnings],
        **documents,
    }


def _fault(fault: "ProfileFault") -> dict[str, str | int]:
    return {
        "file": fault.file,
        "line": fault.line,
        "column": fault.column,
        "path": fault.path,
        "message": fault.message,
    }
