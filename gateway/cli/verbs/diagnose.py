"""`diagnose`: what the simulation gets wrong on a recording, why, by how much, and the cure.

Everything is read, computed and put into words before the first file is written.
"""

import json
import os
import time
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from gateway import defaults
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.cli.diagnosis.inputs import Sources
    from gateway.diagnosis.experiments.experiments import Plan
    from gateway.diagnosis.result import Diagnosis
    from gateway.profiles import PlantProfile
    from gateway.service.closed_loop.study import ClosedLoopGain

_STDOUT: Final = Path("-")
_FAILS: Final = {"partial": ("partial", "unknown"), "unknown": ("unknown",)}
_OF_A_DIAGNOSIS: Final = (
    "recordings",
    "against",
    "without",
    "noise_floor_n",
    "report",
    "extend",
    "plan_file",
    "fail_on",
    "closed_loop",
)
"""Options that a comparison of two runs has no use for."""
_OUTPUT: Final = click.Path(path_type=Path, dir_okay=False)


class _Finite(click.FloatRange):
    """NaN is in every range for click, and infinite is no noise."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = float(super().convert(value, param, ctx))
        return number if isfinite(number) else self.fail(f"{value} is no finite number.", param, ctx)


@dataclass(frozen=True, slots=True)
class Answer:
    """All that is told. gain: None where it was not asked for, a sentence where it could not be measured; plan: what to record
    next, None where it was not asked for or there is nothing to; run: how to run it."""

    diagnosis: "Diagnosis"
    sources: "Sources"
    runtime_s: float
    gain: "ClosedLoopGain | str | None"
    plan: "Plan | None" = None
    run: str = ""


@click.command()
@click.argument("recordings", metavar="RECORDING...", nargs=-1)
@click.option("--rig", metavar="R.yaml", help="The rig whose plant is the start; default the recording's own.")
@click.option("--without", metavar="EFFECT", help="Switch one effect of the base model off, to see it found again.")
@click.option(
    "--noise-floor-n",
    type=_Finite(min=0.0, min_open=True),
    metavar="X",
    help="RMS noise of the readings, N, if known.",
)
@click.option(
    "--json", "json_file", type=click.Path(path_type=Path, allow_dash=True), metavar="OUT", help="- is stdout."
)
@click.option("--report", type=_OUTPUT, metavar="OUT.html", help="Write the report with all plots.")
@click.option("--extend", type=_OUTPUT, metavar="PLANT.yaml", help="Write the extended plant.")
@click.option("--save", is_flag=True, help="Keep the extended plant as the rig's next number, for `plant use`.")
@click.option(
    "--plan", "plan_file", type=_OUTPUT, metavar="PLAN.yaml", help="Write what to record next, for calibrate --plan."
)
@click.option("--columns", metavar="MAP", help="time_s=1:ms,force_n=7:n for foreign tables, or a YAML file.")
@click.option("--fail-on", type=click.Choice(list(_FAILS)), help="Exit 1 on this verdict or a worse one.")
@click.option("--state", type=click.Path(path_type=Path, file_okay=False), help="State directory, for numbers.")
@click.option(
    "--against",
    metavar="OLD",
    multiple=True,
    help="What has changed since this recording of the same machine; again for more of them.",
)
@click.option("--before", metavar="A", help="With --after: what B gained in commanded force over A, two real runs.")
@click.option("--after", metavar="B", help="See --before.")
@click.option("--closed-loop", is_flag=True, help="Measure on the twin what the extension is worth in commanded force.")
def command(**options: Any) -> None:
    """Say what the simulation gets wrong on a recording, and why.

    RECORDING is a number of `recordings list`, a .fgr file, CSV or Parquet with time_s, force_n and command_v or
    pressure_kpa. Several are explained by one model.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only wait for each other
    if options["before"] or options["after"]:
        _show_before_after(options)
        return
    if not options["recordings"]:
        raise click.UsageError("Missing argument 'RECORDING...'.")
    from gateway.cli.diagnosis.inputs import read_sources
    from gateway.cli.diagnosis.outputs import check_targets, write_all
    from gateway.cli.diagnosis.progress_line import shown_progress
    from gateway.extras import require

    require("numba")
    _check_effect(options["without"])
    if options["against"] and options["without"]:
        raise click.UsageError("--against compares two recordings of one machine, without --without")
    with shown_progress("reading"):
        sources = read_sources(
            options["recordings"], rig=options["rig"], columns=options["columns"], state=options["state"]
        )
        old = _read_old(options)
    files = [
        file
        for file in (options["json_file"], options["report"], options["extend"], options["plan_file"])
        if file not in (None, _STDOUT)
    ]
    check_targets(files, (*sources.paths, *(old.paths if old else ())))
    diagnosis, runtime_s = _run_diagnosis(sources, old, options)
    gain = _measure_gain(diagnosis, sources) if options["closed_loop"] else None
    answer = _add_plan(Answer(diagnosis, sources, runtime_s, gain), options["plan_file"])
    texts = _render_files(answer, options)
    printed = texts.pop(_STDOUT, None)
    write_all(texts)
    saved = _save(answer, options) if options["save"] else None
    if printed is None:
        _show(answer, texts)
        if saved:
            click.echo(f"plant {saved}; force-gateway plant use {saved} compensates what can be of it")
    else:
        click.echo(printed, nl=False)
    if options["fail_on"] and diagnosis.verdict in _FAILS[options["fail_on"]]:
        raise click.exceptions.Exit(exit_codes.FAILED)


def _show_before_after(options: dict[str, Any]) -> None:
    """Compare two runs by the error of the commanded force; nothing is diagnosed."""
    given = [name for name in _OF_A_DIAGNOSIS if options[name]]
    if given:
        raise click.UsageError(f"--before A --after B compares two runs, without {', '.join(given)}")
    if not (options["before"] and options["after"]):
        raise click.UsageError("--before A and --after B go together: the run before a change and the one after it")
    from gateway.cli.diagnosis import before_after
    from gateway.cli.diagnosis.outputs import write_all

    found = before_after.run(options["before"], options["after"], options["columns"], options["rig"], options["state"])
    text = json.dumps(before_after.document(found), indent=2, allow_nan=False) + "\n"
    if options["json_file"] == _STDOUT:
        click.echo(text, nl=False)
        return
    click.echo("\n".join(before_after.sentences(found)))
    if options["json_file"]:
        write_all({options["json_file"]: text})


def _check_effect(name: str | None) -> None:
    from difflib import get_close_matches

    from gateway.diagnosis import EFFECTS

    names = [effect.name for effect in EFFECTS]
    if name is None or name in names:
        return
    near = get_close_matches(name, names, n=3, cutoff=0.5)
    meant = f"did you mean {' or '.join(near)}?" if near else "force-gateway effects lists them"
    raise click.UsageError(f"--without: {name} is no effect of the catalogue; {meant}")


def _read_old(options: dict[str, Any]) -> "Sources | None":
    """The recordings that the new ones are compared with; None where --against names none."""
    from gateway.cli.diagnosis.inputs import read_sources

    if not options["against"]:
        return None
    return read_sources(options["against"], rig=options["rig"], columns=options["columns"], state=options["state"])


def _run_diagnosis(sources: "Sources", old: "Sources | None", options: dict[str, Any]) -> "tuple[Diagnosis, float]":
    from gateway.cli.diagnosis.progress_line import shown_progress
    from gateway.diagnosis import Options, diagnose, find_changes
    from gateway.diagnosis.input_checks import name_options

    engine_options = Options(
        without=options["without"],
        noise_floor_n=options["noise_floor_n"],
        late_s=min(sources.late_s, old.late_s) if old else sources.late_s,
        quantum_n=sources.quantum_n,
        is_own=sources.is_own,
    )
    plant = sources.plant.plant
    began_s = time.perf_counter()
    with shown_progress("diagnosing"):
        if old:
            diagnosis = find_changes(sources.measurements, old.measurements, plant, engine_options)
        else:
            diagnosis = diagnose(sources.measurements, plant, engine_options)
    diagnosis = replace(diagnosis, suspects=name_options(diagnosis.suspects, options["columns"] or ""))
    return diagnosis, time.perf_counter() - began_s


def _measure_gain(diagnosis: "Diagnosis", sources: "Sources") -> "ClosedLoopGain | str":
    from gateway.cli.diagnosis.closed_loop import measured_gain
    from gateway.cli.diagnosis.progress_line import shown_progress

    with shown_progress("closing the loop on the twin"):
        return measured_gain(diagnosis, sources)


def _render_files(answer: Answer, options: dict[str, Any]) -> dict[Path, str]:
    """What is to be written, by file; `-` is for stdout."""
    texts: dict[Path, str] = {}
    if options["json_file"]:
        texts[options["json_file"]] = (
            json.dumps(_document(answer), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
        )
    if options["report"]:
        texts[options["report"]] = _report(answer)
    if options["extend"] and _extends(answer, options["extend"]):
        texts[options["extend"]] = _plant(answer.diagnosis, answer.sources, options["extend"].stem)
    if answer.plan is not None:
        from gateway.cli.diagnosis import next_plan

        texts[options["plan_file"]] = next_plan.text(answer.plan, answer.sources.name)
    return texts


def _extends(answer: Answer, file: Path | str) -> bool:
    """Is there a plant to write? Where the force says nothing, or columns are wrong, what was refitted means nothing."""
    from gateway.reports.diagnosis.wording import why_blind

    sure = [each.sentence for each in answer.diagnosis.suspects if each.is_sure]
    why = "; ".join(sure) or why_blind(answer.diagnosis)
    if why:
        click.echo(f"{file} is not written: {why}", err=True)
    return not why


def _add_plan(answer: Answer, file: Path | None) -> Answer:
    """The answer with what to record next; where that is nothing, it says so and there will be no file."""
    if file is None:
        return answer
    from gateway.cli.diagnosis import next_plan

    plan = next_plan.next_plan(answer.diagnosis)
    if plan is None:
        click.echo(f"{next_plan.NOTHING}; {file} is not written", err=True)
        return answer
    return replace(answer, plan=plan, run=next_plan.sentence(plan, file))


def _document(answer: Answer) -> dict[str, Any]:
    """The contract's fields; closed_loop besides, where it was asked for."""
    from gateway.reports.diagnosis.document import diagnosis_document

    document = diagnosis_document(answer.diagnosis, answer.runtime_s)
    if answer.gain is not None:
        from gateway.cli.diagnosis import closed_loop

        document["closed_loop"] = closed_loop.document(answer.gain)
    return document


def _loop_sentences(answer: Answer) -> tuple[str, ...]:
    if answer.gain is None:
        return ()
    from gateway.cli.diagnosis.closed_loop import sentences

    return tuple(sentences(answer.gain))


def _report(answer: Answer) -> str:
    from gateway.diagnosis import EFFECTS
    from gateway.reports.diagnosis.page import ReportContext, diagnosis_page

    circumstances = ReportContext(
        rig=answer.sources.rig or "not named",
        plant=answer.sources.plant.name,
        made_utc=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        runtime_s=answer.runtime_s,
        about={effect.name: effect.what for effect in EFFECTS},
        notes=answer.sources.notes,
        loop=_loop_sentences(answer),
        run=answer.run,
    )
    return diagnosis_page(answer.diagnosis, circumstances)


def _plant(diagnosis: "Diagnosis", sources: "Sources", name: str) -> str:
    from gateway.profiles.kinds.plant_writer import plant_text

    profile = _extended(diagnosis, sources, name)
    return plant_text(profile, f"Written by force-gateway diagnose; verdict: {diagnosis.verdict}")


def _extended(diagnosis: "Diagnosis", sources: "Sources", name: str) -> "PlantProfile":
    from gateway.reports.diagnosis.extended_plant import extended_plant

    profile = extended_plant(diagnosis, sources.plant, sources.name, f"{datetime.now(UTC):%Y-%m-%d}")
    return replace(profile, name=name)


def _save(answer: Answer, options: dict[str, Any]) -> int | None:
    """Keep the extended plant as the next number of the rig; None, and why, where there is none."""
    from gateway.cli.options import state_directory
    from gateway.cli.plants.store_access import save_diagnosed

    diagnosis, sources = answer.diagnosis, answer.sources
    if not diagnosis.causes:
        click.echo("no plant is kept: nothing was found", err=True)
        return None
    if not _extends(answer, "the plant"):
        return None
    directory = state_directory(options["state"], options["rig"] or sources.rig or defaults.RIG)
    name = f"{sources.plant.name}-{'-'.join(cause.name for cause in diagnosis.causes[:2])}"
    return save_diagnosed(directory, diagnosis, sources, _extended(diagnosis, sources, name))


def _show(answer: Answer, written: dict[Path, str]) -> None:
    from rich.console import Console

    from gateway.cli.diagnosis.terminal import render_diagnosis

    console, sources = Console(), answer.sources
    rig = sources.rig or "not named"
    console.print(f"{sources.name} · rig {rig} · plant {sources.plant.name}", style="dim", highlight=False)
    for part in render_diagnosis(answer.diagnosis, sources.notes, _loop_sentences(answer), answer.run):
        console.print(part, highlight=False)
    for path in written:
        click.echo(f"wrote {path}", err=True)
