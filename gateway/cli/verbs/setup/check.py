"""`check`: is this file right? Every fault at once, as file:line:column, before anything moves. Any kind of profile, told
by its keys."""

import json
from typing import TYPE_CHECKING, Any

import click

from gateway import defaults
from gateway.cli.command_line.completion_words import complete_profiles
from gateway.cli.errors import CliError
from gateway.cli.options import count_of, json_option
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gateway.profiles import Checked, ProfileFault, Rig


EXAMPLES = ("check demo", "check irc5-cell --json")


@click.command()
@click.argument("file", metavar="RIG", default=defaults.RIG, shell_complete=complete_profiles)
@click.option(
    "--probe", is_flag=True, help="Ask the devices too: which answers, at which speed, how fast. Moves nothing."
)
@click.option("--port", metavar="PORT", help="With --probe and a device's file: the port that it is behind.")
@json_option
@click.pass_context
def command(context: click.Context, *, file: str, probe: bool, port: str | None, as_json: bool) -> None:
    """Check a rig and every profile that it names.

    RIG is a shipped name or a file (default: demo). A device, plant, calibration, map or plan of its own is checked as what
    it is. Opens no port, but with --probe: then each device is asked what changes nothing, in its own words at its own speed,
    then at others, then in the words of every shipped profile; no voltage is written.
    """
    from gateway.profiles import check_file

    if port and not probe:
        raise click.UsageError("--port goes with --probe: nothing is asked without it")
    checked = check_file(file)
    document = _document(checked)
    if not as_json:
        _print(file, checked)
    failed = exit_codes.OK
    if probe and not checked.faults:
        from gateway.cli.diagnosis.progress_line import show_progress

        with show_progress("probing"):
            failed, document["probe"] = _probe(checked, port, is_quiet=as_json)
    if as_json:
        click.echo(json.dumps(document, indent=2))
    context.exit(exit_codes.CONFIGURATION if checked.faults else failed)


def _probe(checked: "Checked", port: str | None, *, is_quiet: bool) -> tuple[int, dict[str, Any]]:
    """Ask what is behind the ports; the exit code, OK where each device is the one that was named, and the probes as JSON."""
    from gateway.cli.setup import port_probing as probing

    if checked.kind != ("device" if port else "rig"):
        raise CliError(
            "E114 --probe asks the devices of a rig, at the ports that it names; of a device's own file the one at --port PORT",
            exit_codes.USAGE,
        )
    if not is_quiet:
        click.echo(f"{'probe':<12} {probing.HARMLESS}")
    code, found = exit_codes.OK, {}
    lines = [("device", None)] if port else list(probing.lines_to_probe(checked.value))
    for name, line in lines:
        others = [other for _, other in lines if other and other is not line]
        try:
            report = (
                probing.probe_line(line, others)
                if line
                else probing.probe_path(str(port), [checked.value], probing.PATIENCE_S)
            )
        except CliError as error:  # the other ports are asked all the same
            _tell(name, iter([error.message]), is_quiet=is_quiet)
            found[name] = {"port": line.port if line else port, "error": error.message}
            code = code or error.exit_code
            continue
        _tell(name, probing.tell_report(report, line, is_own_file=line is None), is_quiet=is_quiet)
        found[name] = probing.report_fields(report)
        if not (probing.is_as_named(line, report) if line else report.answers):
            code = code or exit_codes.DEVICE
    return code, found


def _tell(name: str, lines: "Iterator[str]", *, is_quiet: bool) -> None:
    for index, line in enumerate(() if is_quiet else lines):
        click.echo(f"{'' if index else name:<12} {line}")


def _print(file: str, checked: "Checked") -> None:
    """Faults and warnings as compilers print theirs, on stderr; what was read, on stdout."""
    from gateway.cli.setup.profile_facts import facts
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
    return [*rig.notes, *([rig.why_unwatched] if rig.why_unwatched else []), *_missing_extras(rig)]


def _missing_extras(rig: "Rig") -> "Iterator[str]":
    """Yield what the rig asks for and this machine cannot do for want of a library: the gateway runs without it."""
    from gateway.extras import is_installed, missing_note

    for section, library in (("metrics", "prometheus_client"), ("mqtt", "aiomqtt"), ("opcua", "asyncua")):
        if getattr(rig, section) is not None and not is_installed(library):
            yield missing_note(library, section)


def _document(checked: "Checked") -> dict[str, Any]:
    """Of a rig: its facts under `rig`; of anything else: one sentence under its kind."""
    from gateway.cli.setup.profile_facts import facts

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
