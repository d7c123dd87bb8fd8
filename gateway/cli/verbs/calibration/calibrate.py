"""`calibrate`: the guided ladder on the gateway that runs, from the questions to the number of a new calibration.

With an experiment as its plan (`diagnose --plan` writes them) it records what the plan puts out, and stores nothing.
"""

import json
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from gateway import defaults
from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.numbers import Quantity, Whole
from gateway.cli.command_line.questions import is_confirmed
from gateway.cli.errors import CliError
from gateway.cli.options import StateChoice, json_option, map_option, name_option, state_options, wire_options
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.cli.master.wires import Wire

_GO_ON: Final = "; force-gateway calibrate --resume goes on"
_STAIRS: Final = ("step_v", "v_max_v")  # what all groups of one ladder share


EXAMPLES = ("calibrate --quick --yes", 'calibrate --groups 3 --step 0.25 --name "new seals" --yes')


@click.command()
@click.option(
    "--groups",
    type=Whole(1, 100),
    help=f"How often the ladder is climbed  [default: {defaults.LADDER_GROUPS}]",
)
@click.option(
    "--step",
    "step_v",
    type=Quantity(0.01, unit="V"),
    help=f"Height of a stair in V  [default: {defaults.LADDER_STEP_V}]",
)
@click.option("--v-max", "v_max_v", type=Quantity(0.1, unit="V"), help="Top in V  [default: as the rig allows]")
@click.option(
    "--minor",
    "minor_points",
    type=Whole(0, 2000),
    help=f"Points of the reversal part  [default: {defaults.LADDER_MINOR_POINTS}]",
)
@click.option(
    "--response",
    "response_steps",
    type=Whole(0, 200),
    help=f"Large steps for dead time and lags  [default: {defaults.LADDER_RESPONSE_STEPS}]",
)
@click.option(
    "--quick",
    is_flag=True,
    help=f"{defaults.QUICK_LADDER_STEP_V} V stairs, one group, short reversal part, a few steps: about a minute.",
)
@click.option("--tare", is_flag=True, help="Take the force at rest as zero first (only with the tool unloaded).")
@click.option(
    "--plan",
    "plan_file",
    type=GivenPath(exists=True, dir_okay=False),
    help="Plan as YAML: a ladder's, or an experiment of diagnose --plan.",
)
@click.option("--resume", is_flag=True, help="Go on with the groups that the last stopped run did not climb.")
@name_option
@click.option("--yes", is_flag=True, help="Do not ask.")
@map_option
@wire_options(None, "By Modbus TCP (the rig's own plan), not on this machine.")
@state_options
@json_option
def command(*, state: StateChoice, wire: "Wire | None", yes: bool, as_json: bool, **plan_options: Any) -> None:
    """Calibrate by a measured ladder, or record an experiment.

    The calibration gets a number. An experiment is a --plan that `diagnose` wrote. Runs on the gateway of this
    machine. Ctrl-C takes the force to 0 and keeps the data. Nothing is activated: that is `calibration use N`.
    """
    from gateway.cli.calibration.follow import follow_run
    from gateway.cli.calibration.plans import is_experiment
    from gateway.cli.calibration.remote_run import RemoteRun
    from gateway.cli.calibration.runs import LocalRun

    resumes, there = True, [plan_options.pop(name) for name in ("unit", "map_name")]
    if wire:
        if any(plan_options.values()):
            raise click.UsageError(
                "by Modbus (--gateway, --rtu, --tls) the gateway runs its own plan: leave the plan's options out"
            )
        run: LocalRun | RemoteRun = RemoteRun(wire, *there)
    else:
        directory = state.directory
        run_request = _plan_wanted(directory, plan_options)
        if run_request.whole:
            _tell(_fit_stopped_run(run_request.whole, state.rig, directory), as_json, resumes=False)
            return
        run = LocalRun(directory, run_request.plan, run_request.earlier, run_request.name)
        resumes = not is_experiment(run_request.plan)
    preview = run.preview()
    if wire is None:
        _warn_of_another_rig(run_request, preview)
    _ask(preview, yes)
    with closing(run):
        end = follow_run(run)
    _tell(end, as_json, resumes=resumes)


@dataclass(frozen=True, slots=True)
class _WantedRun:
    """What to climb: the plan's fields, and the recordings that it goes on from. whole: the recording of a run that has
    everything, so that only the fit is left; fingerprint: of the rig that the earlier ones were made on."""

    plan: dict[str, Any]
    earlier: list[int] = field(default_factory=list)
    name: str = ""
    whole: Path | None = None
    fingerprint: str = ""


def _plan_wanted(directory: Path, plan_options: dict[str, Any]) -> _WantedRun:
    from gateway.control.runs.ladder_stairs import QUICK

    fields: dict[str, Any] = {}
    if plan_options["quick"]:
        fields |= {name: getattr(QUICK, name) for name in ("step_v", "groups", "minor_points", "response_steps")}
    if plan_options["plan_file"]:
        fields |= _from_file(plan_options["plan_file"], plan_options)
    names = ("groups", "step_v", "v_max_v", "minor_points", "response_steps")
    fields |= {name: plan_options[name] for name in names if plan_options[name] is not None}
    if plan_options["tare"]:
        fields["tare"] = True
    if plan_options["resume"]:
        return _resume(directory, fields, plan_options["name"] or "")
    return _WantedRun(fields, name=plan_options["name"] or "")


def _resume(directory: Path, fields: dict[str, Any], name: str) -> _WantedRun:
    """Return the rest of the last run; fields: what is asked for otherwise now, which may be more groups, but no other
    stairs."""
    from gateway.cli.calibration.resume import find_rest_of_ladder

    rest = find_rest_of_ladder(directory)
    changed = [f"{key} {value:g}" for key, value in fields.items() if key in _STAIRS and value != rest.plan[key]]
    if changed:
        stairs = ", ".join(f"{key} {rest.plan[key]:g}" for key in _STAIRS)
        raise CliError(
            f"E437 --resume goes on with the ladder of {rest.last} ({stairs}), not with {', '.join(changed)}: leave that out, "
            "or leave --resume out to begin anew",
            exit_codes.USAGE,
        )
    plan = rest.plan_with(fields)
    whole = rest.last if rest.is_whole(plan) else None
    return _WantedRun(plan, rest.earlier, name or rest.name, whole, rest.fingerprint)


def _fit_stopped_run(recording: Path, rig: str, directory: Path) -> dict[str, Any]:
    """Return the end of a run that has everything but its fit: as `follow` answers."""
    from gateway.cli.calibration.resume import rig_of
    from gateway.service.fitting.fit_process import fit_and_store

    result = fit_and_store(recording, rig_of(recording, rig), directory)
    phase = "stored" if "stored" in result else "refused"
    sentence = result.pop("refused", "") or "the run is whole: nothing was climbed again"
    click.echo(f"{recording} has every stair of its plan: nothing is climbed again", err=True)
    return {"phase": phase, "recording": str(recording), "sentence": sentence} | result


def _warn_of_another_rig(run_request: _WantedRun, preview: dict[str, Any]) -> None:
    if run_request.fingerprint and run_request.fingerprint != preview["rig_fingerprint"]:
        click.echo(
            f"the files of rig {preview['rig']} have changed since the first part was recorded: if cell, cylinder or regulator "
            "are others now, begin anew without --resume",
            err=True,
        )


def _from_file(path: Path, plan_options: dict[str, Any]) -> dict[str, Any]:
    """Return the plan's fields; UsageError where options of a ladder stand beside an experiment."""
    from gateway.cli.calibration.plans import fields_of, is_experiment

    fields = fields_of(path)
    options = ("groups", "step_v", "v_max_v", "minor_points", "response_steps", "quick", "resume", "name")
    if is_experiment(fields) and any(plan_options[name] for name in options):
        raise click.UsageError(
            f"{path} is an experiment: --groups, --step, --v-max, --minor, --response, --quick, --resume, --name are a ladder's"
        )
    return fields


def _ask(preview: dict[str, Any], yes: bool) -> None:
    """What will happen and how long it takes; then the preconditions, each of which may end it here."""
    if preview:
        top = f"{preview['v_max_v']:.1f} V (about {preview['force_max_n']:.0f} N)"
        where = ", on a simulated rig" if preview["simulated"] else ""
        what = preview["experiment"] or f"{preview['stairs']} stairs"
        click.echo(f"{preview['rig']}: {what} up to {top}, about {_minutes(preview['eta_s'])}{where}", err=True)
        for note in preview["notes"]:
            click.echo(f"  {note}", err=True)
    if yes:
        return
    from gateway.control.runs.preconditions import preconditions

    force_n, top_v = preview.get("force_max_n"), preview.get("v_max_v")
    asked = preconditions(force_n, top_v, has_check=preview.get("check", True))
    for words in (*asked, *preview.get("questions", ())):
        if not is_confirmed(words):
            raise CliError("not begun: nothing has moved")


def _minutes(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.1f} min"


def _tell(end: dict[str, Any], as_json: bool, *, resumes: bool) -> None:
    """The table and the number, or why there is none."""
    from gateway.cli.calibration.fit_table import print_fit

    document, code = _document(end), end.pop("exit_code", exit_codes.FAILED)
    if as_json:
        click.echo(json.dumps(end | {"fit": document}))
    elif document:
        print_fit(document)
    elif end["phase"] == "stored":
        click.echo(
            f"calibration {end['stored']} is stored, not active; force-gateway calibration use {end['stored']} there"
        )
    elif end["phase"] == "recorded":
        path = Path(end["recording"])
        number = f"{int(path.stem)}" if path.stem.isdecimal() else str(path)
        click.echo(f"recorded in {path}; force-gateway diagnose {number} takes it")
    if end.get("unreported"):
        click.echo(end["unreported"], err=True)
    if end["phase"] in ("stored", "recorded"):
        return
    kept = f"\nthe data are kept in {end['recording']}{_GO_ON if resumes else ''}" if end.get("recording") else ""
    if end["phase"] == "refused":  # by the data, or by the verdict on a fit that is kept
        raise CliError(str(end.get("sentence") or "the fit was refused: see the gateway's log"), exit_codes.DATA)
    raise CliError(f"{str(end.get('sentence') or 'calibration stopped').removeprefix('info ')}{kept}", code)


def _document(end: dict[str, Any]) -> dict[str, Any]:
    if not end.get("document"):
        return {}
    document: dict[str, Any] = json.loads(Path(end["document"]).read_text(encoding="utf-8"))
    return document
