"""`fit`: which model describes a ladder, as a table and as a report with plots."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from gateway import defaults
from gateway.cli.command_line.completion_words import complete_recordings
from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.rig_choice import rig_option
from gateway.cli.command_line.table_options import table_options
from gateway.cli.errors import CliError
from gateway.cli.options import check_state, json_option, name_option, state_directory, state_option
from gateway.processes import exit_codes
from gateway.processes.state_directory import RECORDINGS

if TYPE_CHECKING:
    from gateway.recording import Recording
    from gateway.service.fitting.ladder_fit import LadderFit
    from gateway.service.fitting.ladder_source import RigContext

MODELS: Final = ("pfm", "psfm", "bfm", "bsfm")


def _models(context: click.Context, parameter: click.Parameter, value: str) -> tuple[str, ...]:
    names = tuple(name.strip().lower() for name in value.split(",") if name.strip())
    if not names or not set(names) <= set(MODELS):
        raise click.BadParameter(f"{value} is not a list of {', '.join(MODELS)}")
    return names


def _orders(context: click.Context, parameter: click.Parameter, value: str) -> tuple[int, ...]:
    """Return `1-5`, `2`, `1,3,5` as numbers."""
    from gateway.bsfm.curve import ORDER_MAX

    orders: set[int] = set()
    for part in value.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdecimal() or (dash and not last.isdecimal()):
            raise click.BadParameter(f"{value} is not a list of orders such as 1-5 or 2,3")
        if not (1 <= int(first) <= ORDER_MAX and int(last or first) <= ORDER_MAX):
            raise click.BadParameter(f"{value}: orders are 1 .. {ORDER_MAX}")
        if int(last or first) < int(first):
            raise click.BadParameter(f"{value} goes down: the smaller order stands first, {last}-{first}")
        orders |= set(range(int(first), int(last or first) + 1))
    return tuple(sorted(orders))


EXAMPLES = ("fit ladder.csv --models bsfm --orders 1-3", "fit ladder.csv --models psfm --orders 2 --no-report --json")


@click.command()
@click.argument("recording", metavar="RECORDING", shell_complete=complete_recordings)
@click.option("--models", callback=_models, default=",".join(MODELS), show_default=True, help="Which to compare.")
@click.option("--orders", callback=_orders, default="1-5", show_default=True, help="Orders, such as 1-5 or 2,3.")
@click.option(
    "--ties", type=click.Choice(["tied", "free"]), default="tied", show_default=True, help="Shared ends or not."
)
@click.option(
    "--outliers",
    type=click.Choice(["reject", "keep", "huber"]),
    default="reject",
    show_default=True,
    help="What to do.",
)
@table_options
@click.option("--force-unit", metavar="UNIT", help="What the force is in (N, kgf, gf, lbf), if the table does not say.")
@click.option("--report", type=GivenPath(dir_okay=False), help="HTML report; default beside the recording.")
@click.option("--no-report", is_flag=True, help="Write no report.")
@click.option("--store", is_flag=True, help="Store the chosen fit as a numbered calibration (it is not activated).")
@name_option
@state_option("State directory of the gateway.", makes=True)
@rig_option("The rig it must be from  [default: the recording's own]")
@json_option
def command(*, recording: str, as_json: bool, store: bool, **options: Any) -> None:
    """Fit the four models to a ladder, and say which to use.

    RECORDING is a number of `recordings list`, `last`, a .fgr file, or a CSV or Parquet table with time_s, command_v, force_n.
    """
    from gateway.cli.diagnosis.outputs import check_targets
    from gateway.cli.diagnosis.progress_line import show_progress
    from gateway.cli.recordings.named_recording import recording_path

    if options["report"] and options["no_report"]:
        raise click.UsageError("--report or --no-report, not both")
    if not store:
        check_state(options["state"])
    path = recording_path(recording, options["rig"], options["state"])
    target = None if options["no_report"] else options["report"] or _beside(path)
    named = [Path(options[name]) for name in ("rig", "columns") if options[name]]
    check_targets([target] if target else [], [path, *named])
    with show_progress("fitting"):
        fit = _fit(path, options, stores=store)
    if store:
        fit.document["calibration"] = _store(fit, options)
    if target:
        _write_report(fit, target)
    if as_json:
        click.echo(json.dumps(fit.document, indent=2))
    else:
        from gateway.cli.calibration.fit_table import print_fit

        print_fit(fit.document)
    if store and fit.verdict.rejected:
        from gateway.service.fitting.fit_process import rejected_sentence

        raise CliError(rejected_sentence(fit.document["calibration"], fit.verdict.rejected), exit_codes.DATA)


def _write_report(fit: "LadderFit", target: Path) -> None:
    """Write the report. CliError where the disk refuses; it tells the calibration that is stored all the same."""
    from gateway.plain_file import tell_refusal
    from gateway.service.fitting.ladder_fit import write_report

    try:
        write_report(fit, target)
    except OSError as error:
        number = fit.document.get("calibration")
        stored = f"; calibration {number} is stored, only its report is missing" if number else ""
        raise CliError(f"E106 {error.filename or target}: {tell_refusal(error)}{stored}") from None
    fit.document["report"] = str(target)


def _fit(path: Path, options: dict[str, Any], *, stores: bool) -> "LadderFit":
    """Return the fit; whatever is wrong with the data ends with exit code 65."""
    from gateway.bsfm.fit.evaluation import FitRequest
    from gateway.bsfm.fit.result import ModelName, Ties
    from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
    from gateway.progress import report
    from gateway.recording.tables.mapping_file import column_mapping
    from gateway.service.fitting.ladder_fit import fit_recording
    from gateway.service.fitting.ladder_source import read_source

    report("reading the recording")
    mapping = column_mapping(options["columns"])
    models = tuple(ModelName(model) for model in options["models"])
    question = FitRequest(
        models=models, orders=options["orders"], ties=Ties(options["ties"]), outliers=options["outliers"]
    )
    recording = read_source(path, mapping)
    if stores and not (options["rig"] or recording.header.get("rig")):
        options["rig"] = _rig_to_store_for(options["state"])
    background = _background(recording, options)
    report("checking the ladder")
    try:
        return fit_recording(recording, question, background, options["name"] or "")
    except LadderError as error:
        hint = f". {recording.suggestion}" if error.flaw is LadderFlaw.COLUMNS and recording.suggestion else ""
        raise CliError(f"E421 {path}: {error}{hint}", exit_codes.DATA) from None


def _background(recording: "Recording", options: dict[str, Any]) -> "RigContext":
    """Return by what it is judged: a gateway's recording by the calibration that is in use there, another table by the one
    in use where --state says, else by the rig's own."""
    from gateway.service.fitting.ladder_source import RigContext

    rig, state = options["rig"], options["state"]
    own = state_directory(state, rig)
    if state is None and recording.path.parent == own / RECORDINGS:
        rig, state = rig or str(recording.header.get("rig") or "") or None, own
    return RigContext(rig=rig, state=state, force_unit=options["force_unit"])


def _rig_to_store_for(state: Path | None) -> str:
    """Return the rig of a table that names none: as `calibration use` takes it, or its number would be another one there."""
    from gateway.cli.command_line.known_rigs import choose_rig
    from gateway.cli.command_line.rig_choice import tell_rig

    rig = choose_rig(None, state)
    tell_rig(rig, state_directory(state, rig))
    return rig


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.stem}.fit.html")


def _store(fit: "LadderFit", options: dict[str, Any]) -> int:
    from gateway.bsfm.ladder.ladder_error import LadderError
    from gateway.calibrations.store import CalibrationStore
    from gateway.profiles import read_rig
    from gateway.service.fitting.ladder_fit import calibration_of

    rig = read_rig(options["rig"] or fit.document["rig"] or defaults.RIG)
    state = state_directory(options["state"], rig.name)
    try:
        calibration = calibration_of(fit, rig.load_cell.range_n)
    except LadderError as error:
        raise CliError(f"E421 {fit.recording.path}: {error}", exit_codes.DATA) from None
    return CalibrationStore(state, rig.calibration).add(calibration)
