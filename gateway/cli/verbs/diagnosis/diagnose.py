"""`diagnose`: what the simulation gets wrong on a recording, why, by how much, and the cure.

Everything is read, computed and put into words before the first file is written.
"""

import json
import os
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from gateway.cli.command_line.completion_words import complete_calibrations, complete_effects, complete_recordings
from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.numbers import Quantity
from gateway.cli.command_line.rig_choice import rig_option
from gateway.cli.command_line.table_options import table_options
from gateway.cli.options import check_state, state_directory, state_option
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.cli.diagnosis.answer import Answer, AnswerFiles
    from gateway.cli.diagnosis.inputs import Sources
    from gateway.diagnosis.result import Diagnosis
    from gateway.service.closed_loop.study import ClosedLoopGain

_FAILS: Final = {"partial": ("partial", "unknown"), "unknown": ("unknown",)}
_OF_A_DIAGNOSIS: Final = (
    "recordings",
    "against",
    "without",
    "calibration",
    "noise_floor_n",
    "extend",
    "plan_file",
    "fail_on",
    "closed_loop",
)
"""Options that a comparison of two runs has no use for."""
_OUTPUT: Final = GivenPath(dir_okay=False)


EXAMPLES = ("diagnose press.csv --report why.html", "diagnose press.csv --rig demo --extend creeping.yaml")


def _not_an_option(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
    """Of every other verb --json is a flag: `--json --state DIR` took --state for its file, and DIR for a recording."""
    if value is not None and value.name.startswith("--"):
        raise click.BadParameter(f"{value} is no file: OUT is missing; - is stdout")
    return value


@click.command()
@click.argument("recordings", metavar="RECORDING...", nargs=-1, shell_complete=complete_recordings)
@rig_option("The rig whose plant is the start  [default: the recording's own]")
@click.option(
    "--calibration",
    metavar="N",
    shell_complete=complete_calibrations,
    help="The calibration that tells the cell's noise: number, name or file; default the recording's own.",
)
@click.option(
    "--without",
    metavar="EFFECT",
    shell_complete=complete_effects,
    help="Switch one effect of the base model off, to see it found again.",
)
@click.option(
    "--noise-floor-n",
    type=Quantity(0.0, above=True),
    metavar="X",
    help="RMS noise of the readings, N, if known.",
)
@click.option(
    "--json",
    "json_file",
    type=GivenPath(allow_dash=True),
    callback=_not_an_option,
    metavar="OUT",
    help="- is stdout.",
)
@click.option("--report", type=_OUTPUT, metavar="OUT.html", help="Write the report with all plots.")
@click.option("--extend", type=_OUTPUT, metavar="PLANT.yaml", help="Write the extended plant.")
@click.option("--save", is_flag=True, help="Keep the extended plant as the rig's next number, for `plant use`.")
@click.option(
    "--plan", "plan_file", type=_OUTPUT, metavar="PLAN.yaml", help="Write what to record next, for calibrate --plan."
)
@table_options
@click.option("--fail-on", type=click.Choice(list(_FAILS)), help="Exit 1 on this verdict or a worse one.")
@state_option("State directory, for numbers.", makes=True)
@click.option(
    "--against",
    metavar="OLD",
    multiple=True,
    shell_complete=complete_recordings,
    help="What has changed since this recording of the same machine, or since its `reference`; again for more of them.",
)
@click.option(
    "--before",
    metavar="A",
    shell_complete=complete_recordings,
    help="With --after: what B gained in commanded force over A, two real runs.",
)
@click.option("--after", metavar="B", shell_complete=complete_recordings, help="See --before.")
@click.option("--closed-loop", is_flag=True, help="Measure on the twin what the extension is worth in commanded force.")
def command(**options: Any) -> None:
    """Say what the simulation gets wrong on a recording, and why.

    RECORDING is a number of `recordings list`, `last`, a .fgr file, CSV or Parquet with time_s, force_n and command_v or
    pressure_kpa. Several are explained by one model.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only wait for each other
    if not options["save"]:
        check_state(options["state"])
    if options["before"] or options["after"]:
        _show_before_after(options)
        return
    if not options["recordings"]:
        raise click.UsageError("Missing argument 'RECORDING...'.")
    from gateway.extras import require

    require("numba")
    _check_effect(options["without"])
    if options["against"] and options["without"]:
        raise click.UsageError("--against compares two recordings of one machine, without --without")
    from gateway.cli.garbage_collection import pause_garbage_collection

    with pause_garbage_collection():
        _answer(options)


def _answer(options: dict[str, Any]) -> None:
    """Diagnose, write and print; exit 1 where --fail-on asks for it."""
    from gateway.cli.diagnosis.answer import AnswerFiles, print_answer, render_files, save_plant
    from gateway.cli.diagnosis.outputs import STDOUT, write_all

    files = AnswerFiles(*(options[name] for name in ("json_file", "report", "extend", "plan_file")))
    answer = _compute_answer(options, files)
    texts = render_files(answer, files)
    printed = texts.pop(STDOUT, None)
    write_all(texts)
    saved = save_plant(answer, options["state"], options["rig"]) if options["save"] else None
    if printed is None:
        print_answer(answer, texts)
    else:
        click.echo(printed, nl=False)
    if saved:
        told = f"plant {saved}; force-gateway plant use {saved} compensates what can be of it"
        click.echo(told, err=printed is not None)
    if options["fail_on"] and answer.diagnosis.verdict in _FAILS[options["fail_on"]]:
        raise click.exceptions.Exit(exit_codes.FAILED)


def _compute_answer(options: dict[str, Any], files: "AnswerFiles") -> "Answer":
    """Read the recordings, check that the files can be written, and diagnose."""
    from gateway.cli.diagnosis.answer import Answer, add_plan
    from gateway.cli.diagnosis.inputs import read_sources, refuse_twice
    from gateway.cli.diagnosis.outputs import check_targets
    from gateway.cli.diagnosis.progress_line import show_progress

    with show_progress("reading"):
        sources = read_sources(
            options["recordings"],
            rig=options["rig"],
            columns=options["columns"],
            state=options["state"],
            calibration=options["calibration"],
        )
        old = _read_old(options, sources.rig)
        if old:
            refuse_twice((*sources.paths, *old.paths))
    named = (Path(options[name]) for name in ("rig", "columns", "calibration") if options[name])
    check_targets(files.given, (*sources.paths, *(old.paths if old else ()), *named))
    diagnosis, runtime_s = _run_diagnosis(sources, old, options)
    gain = _measure_gain(diagnosis, sources) if options["closed_loop"] else None
    return add_plan(Answer(diagnosis, sources, runtime_s, gain), files.plan)


def _show_before_after(options: dict[str, Any]) -> None:
    """Compare two runs by the error of the commanded force; nothing is diagnosed."""
    given = [name for name in _OF_A_DIAGNOSIS if options[name]]
    if given:
        raise click.UsageError(f"--before A --after B compares two runs, without {', '.join(given)}")
    if not (options["before"] and options["after"]):
        raise click.UsageError("--before A and --after B go together: the run before a change and the one after it")
    from gateway.cli.diagnosis import before_after
    from gateway.cli.diagnosis.outputs import STDOUT, check_targets, write_all
    from gateway.cli.recordings.named_recording import recording_path

    runs = [recording_path(options[name], options["rig"], options["state"]) for name in ("before", "after")]
    named = [Path(options[name]) for name in ("rig", "columns") if options[name]]
    targets = [file for file in (options["json_file"], options["report"]) if file]
    check_targets(targets, [*runs, *named])
    found = before_after.run(options["before"], options["after"], options["columns"], options["rig"], options["state"])
    texts = {options["json_file"]: json.dumps(before_after.document(found), indent=2, allow_nan=False) + "\n"}
    if options["report"]:
        from gateway.cli.diagnosis.before_after_page import before_after_page

        texts[options["report"]] = before_after_page(found)
    printed = texts.pop(STDOUT, None)
    write_all({file: text for file, text in texts.items() if file})
    click.echo("\n".join(before_after.sentences(found)) if printed is None else printed, nl=printed is None)


def _check_effect(name: str | None) -> None:
    from difflib import get_close_matches

    from gateway.diagnosis import EFFECTS

    names = [effect.name for effect in EFFECTS]
    if name is None or name in names:
        return
    near = get_close_matches(name, names, n=3, cutoff=0.5)
    meant = f"did you mean {' or '.join(near)}?" if near else "force-gateway effects lists them"
    raise click.UsageError(f"--without: {name} is no effect of the catalogue; {meant}")


def _read_old(options: dict[str, Any], rig: str) -> "Sources | None":
    """The recordings that the new ones are compared with; None where --against names none. rig: of the new ones, whose
    reference is meant."""
    from gateway.cli.diagnosis.inputs import read_sources, refuse_still
    from gateway.cli.recordings.named_recording import REFERENCE, reference_file

    if not options["against"]:
        return None
    directory = state_directory(options["state"], options["rig"] or rig or None)
    names = [str(reference_file(directory)) if each == REFERENCE else each for each in options["against"]]
    old = read_sources(names, rig=options["rig"], columns=options["columns"], state=options["state"])
    refuse_still(old)
    return old


def _run_diagnosis(sources: "Sources", old: "Sources | None", options: dict[str, Any]) -> "tuple[Diagnosis, float]":
    from gateway.cli.diagnosis.progress_line import show_progress
    from gateway.diagnosis import Options, diagnose, find_changes
    from gateway.diagnosis.columns_option import name_options
    from gateway.recording.tables.mapping_file import spell_mapping

    engine_options = Options(
        without=options["without"],
        noise_floor_n=options["noise_floor_n"],
        calibration_noise_n=sources.calibration_noise_n,
        late_s=min(sources.late_s, old.late_s) if old else sources.late_s,
        quantum_n=sources.quantum_n,
        is_own=sources.is_own,
    )
    plant = sources.plant.plant
    began_s = time.perf_counter()
    with show_progress("diagnosing"):
        if old:
            diagnosis = find_changes(sources.measurements, old.measurements, plant, engine_options)
        else:
            diagnosis = diagnose(sources.measurements, plant, engine_options)
    factors = {**(old.factors if old else {}), **sources.factors}
    suspects = name_options(diagnosis.suspects, spell_mapping(options["columns"]), factors)
    return replace(diagnosis, suspects=suspects), time.perf_counter() - began_s


def _measure_gain(diagnosis: "Diagnosis", sources: "Sources") -> "ClosedLoopGain | str":
    from gateway.cli.diagnosis.closed_loop import measure_gain
    from gateway.cli.diagnosis.progress_line import show_progress

    with show_progress("closing the loop on the twin"):
        return measure_gain(diagnosis, sources)
