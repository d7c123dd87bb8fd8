"""`check`: is this rig file, or plant file, right? Every fault at once, as file:line:column, before anything moves."""

import json
from typing import TYPE_CHECKING, Any

import click

from gateway.cli import exit_codes
from gateway.cli.options import count_of, json_option

if TYPE_CHECKING:
    from gateway.profiles import Fault, PlantProfile, Report, Rig


@click.command()
@click.argument("rig", default="demo")
@json_option
@click.pass_context
def command(context: click.Context, *, rig: str, as_json: bool) -> None:
    """Check a rig and every profile that it names.

    RIG is a shipped name or a file (default: demo), or a plant file, such as diagnose --extend writes. Opens no port.
    """
    from gateway.profiles import PlantProfile, Report, check_plant, check_report

    plant = check_plant(rig)
    if isinstance(plant, PlantProfile):
        _tell_plant(plant, as_json=as_json)
        return
    report = check_report(rig) if plant is None else Report(plant, (), None)
    if as_json:
        click.echo(json.dumps(_document(report), indent=2))
    else:
        _print(report, "rig does not start" if plant is None else "plant cannot be used")
    context.exit(exit_codes.CONFIGURATION if report.faults else exit_codes.OK)


def _tell_plant(plant: "PlantProfile", *, as_json: bool) -> None:
    facts = {"plant": f"{plant.name}: {plant.description}"}
    if as_json:
        click.echo(json.dumps({"ok": True, "faults": [], "warnings": [], "rig": None, **facts}, indent=2))
        return
    for name, value in [*facts.items(), ("ok", "no faults")]:
        click.echo(f"{name:<12} {value}")


def _print(report: "Report", outcome: str) -> None:
    """Faults and warnings as compilers print theirs, on stderr; what was read, on stdout. outcome: of any fault."""
    for fault in report.faults:
        click.echo(str(fault), err=True)
    for warning in report.warnings:
        click.echo(f"{warning} (warning)", err=True)
    if report.rig is None:
        click.echo(f"{count_of(report.faults, 'fault')}; this {outcome}", err=True)
        return
    for name, value in _facts(report.rig).items():
        click.echo(f"{name:<12} {value}")
    for note in report.rig.notes:
        click.echo(f"{'note':<12} {note}")
    warnings = f", {count_of(report.warnings, 'warning')}" if report.warnings else ""
    click.echo(f"{'ok':<12} no faults{warnings}")


def _facts(rig: "Rig") -> dict[str, str]:
    limits = rig.control.limits
    return {
        "rig": f"{rig.name}: {rig.description}" + (" (simulated)" if rig.simulated else ""),
        "output": f"{rig.output.device.name}, {rig.output.baud} baud, {rig.output.port or 'simulated'}",
        "load_cell": f"{rig.load_cell.device.name}, {rig.load_cell.baud} baud, {rig.load_cell.port or 'simulated'}",
        "calibration": f"{rig.calibration.name}, {rig.calibration.kind}",
        "limits": f"0 .. {limits.force_max_n:g} N, {limits.voltage_min_v:g} .. {limits.voltage_max_v:g} V",
        "modbus tcp": f"{rig.network.bind}:{rig.network.port}",
        "fingerprint": rig.fingerprint[:16],
    }


def _document(report: "Report") -> dict[str, Any]:
    facts = _facts(report.rig) | {"fingerprint": report.rig.fingerprint} if report.rig else None
    return {
        "ok": not report.faults,
        "faults": [_fault(fault) for fault in report.faults],
        "warnings": [_fault(warning) for warning in report.warnings],
        "rig": facts,
    }


def _fault(fault: "Fault") -> dict[str, str | int]:
    return {
        "file": fault.file,
        "line": fault.line,
        "column": fault.column,
        "path": fault.path,
        "message": fault.message,
    }
