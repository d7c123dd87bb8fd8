"""The answer of `diagnose`: everything put into words, as files, in the terminal, and as a plant of the store.

What only some answers need (a report, a plan, a plant of the store, the loop on the twin) is loaded by those: it would take a
second of every diagnosis.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console

from gateway import defaults
from gateway.cli.diagnosis.inputs import Sources
from gateway.cli.diagnosis.terminal import render_diagnosis
from gateway.diagnosis import EFFECTS, Diagnosis
from gateway.diagnosis.notes import why_blind
from gateway.reports.diagnosis.document import diagnosis_document

if TYPE_CHECKING:
    from gateway.diagnosis.experiments.experiments import Plan
    from gateway.profiles import PlantProfile
    from gateway.service.closed_loop.study import ClosedLoopGain


@dataclass(frozen=True, slots=True)
class AnswerFiles:
    """The files that were asked for; None: not asked for. One of them may be `outputs.STDOUT`."""

    json: Path | None
    report: Path | None
    extend: Path | None
    plan: Path | None

    @property
    def given(self) -> list[Path]:
        """Those that were asked for."""
        return [file for file in (self.json, self.report, self.extend, self.plan) if file]


@dataclass(frozen=True, slots=True)
class Answer:
    """All that is told. gain: None where it was not asked for, a sentence where it could not be measured; plan: what to record
    next, None where it was not asked for or there is nothing to; run: how to run it."""

    diagnosis: Diagnosis
    sources: Sources
    runtime_s: float
    gain: "ClosedLoopGain | str | None"
    plan: "Plan | None" = None
    run: str = ""

    @property
    def loop_sentences(self) -> tuple[str, ...]:
        """The gain in commanded force in words; empty where it was not asked for."""
        if self.gain is None:
            return ()
        from gateway.cli.diagnosis import closed_loop

        return tuple(closed_loop.sentences(self.gain))


def add_plan(answer: Answer, file: Path | None) -> Answer:
    """Return the answer with what to record next; where that is nothing, say so: there will be no file."""
    if file is None:
        return answer
    from gateway.cli.diagnosis import next_plan

    plan = next_plan.next_plan(answer.diagnosis)
    if plan is None:
        click.echo(f"{next_plan.NOTHING}; {file} is not written", err=True)
        return answer
    return replace(answer, plan=plan, run=next_plan.sentence(plan, file))


def render_files(answer: Answer, files: AnswerFiles) -> dict[Path, str]:
    """Return what is to be written, by file."""
    texts: dict[Path, str] = {}
    if files.json:
        texts[files.json] = json.dumps(_compose_document(answer), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    if files.report:
        texts[files.report] = _render_report(answer)
    if files.extend and _can_extend(answer, files.extend):
        texts[files.extend] = _render_plant(answer, files.extend.stem)
    if answer.plan is not None and files.plan:
        from gateway.cli.diagnosis import next_plan

        texts[files.plan] = next_plan.text(answer.plan, answer.sources.name)
    return texts


def _compose_document(answer: Answer) -> dict[str, Any]:
    """The contract's fields; closed_loop besides, where it was asked for."""
    document = diagnosis_document(answer.diagnosis, answer.runtime_s)
    if answer.gain is not None:
        from gateway.cli.diagnosis import closed_loop

        document["closed_loop"] = closed_loop.document(answer.gain)
    return document


def _render_report(answer: Answer) -> str:
    from gateway.reports.diagnosis.page import ReportContext, diagnosis_page

    circumstances = ReportContext(
        rig=answer.sources.rig or "not named",
        plant=answer.sources.plant.name,
        made_utc=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        runtime_s=answer.runtime_s,
        about={effect.name: effect.what for effect in EFFECTS},
        notes=answer.sources.notes,
        loop=answer.loop_sentences,
        run=answer.run,
    )
    return diagnosis_page(answer.diagnosis, circumstances)


def _can_extend(answer: Answer, target: Path | str) -> bool:
    """Is there a plant to write? Where the force says nothing, or columns are wrong, what was refitted means nothing."""
    sure = [each.sentence for each in answer.diagnosis.suspects if each.is_sure]
    why = "; ".join(sure) or why_blind(answer.diagnosis)
    if why:
        click.echo(f"{target} is not written: {why}", err=True)
    return not why


def _render_plant(answer: Answer, name: str) -> str:
    from gateway.profiles.kinds.plant_writer import plant_text

    written_by = f"Written by force-gateway diagnose; verdict: {answer.diagnosis.verdict}"
    return plant_text(_extend_plant(answer, name), written_by)


def _extend_plant(answer: Answer, name: str) -> "PlantProfile":
    from gateway.reports.diagnosis.extended_plant import extended_plant

    sources = answer.sources
    profile = extended_plant(answer.diagnosis, sources.plant, sources.name, f"{datetime.now(UTC):%Y-%m-%d}")
    return replace(profile, name=name)


def save_plant(answer: Answer, state: Path | None, rig: str | None) -> int | None:
    """Keep the extended plant as the next number of the rig and return it; None, and say why, where there is none."""
    diagnosis, sources = answer.diagnosis, answer.sources
    if not diagnosis.causes:
        click.echo("no plant is kept: nothing was found", err=True)
        return None
    if not _can_extend(answer, "the plant"):
        return None
    from gateway.cli.options import state_directory
    from gateway.cli.plants.store_access import save_diagnosed

    directory = state_directory(state, rig or sources.rig or defaults.RIG)
    name = f"{sources.plant.name}-{'-'.join(cause.name for cause in diagnosis.causes[:2])}"
    return save_diagnosed(directory, diagnosis, sources, _extend_plant(answer, name))


def print_answer(answer: Answer, written: Iterable[Path]) -> None:
    """Print the answer for people, and which files were written."""
    console, sources = Console(), answer.sources
    rig = sources.rig or "not named"
    console.print(f"{sources.name} · rig {rig} · plant {sources.plant.name}", style="dim", highlight=False)
    for part in render_diagnosis(answer.diagnosis, sources.notes, answer.loop_sentences, answer.run):
        console.print(part, highlight=False)
    for path in written:
        click.echo(f"wrote {path}", err=True)
