"""A diagnosis for a terminal: what is off, the ranked causes with their gains, what is left, what to record next."""

from collections.abc import Iterator
from dataclasses import dataclass

from rich import box
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from gateway.diagnosis.notes import why_blind
from gateway.diagnosis.result import Cause, Diagnosis, Verdict
from gateway.reports.diagnosis import headline
from gateway.reports.diagnosis import wording as words

_COLOUR = {
    Verdict.NOTHING_FOUND: "green",
    Verdict.CONFIRMED: "green",
    Verdict.PARTIAL: "yellow",
    Verdict.UNKNOWN: "red",
}
_LEAST_WIDTH = 90  # of the table of causes with a column for each figure
_MOST_REJECTED = 3
_MOST_PROPOSALS = 4
_MOST_NAMES = 4


def render_diagnosis(
    diagnosis: Diagnosis, notes: tuple[str, ...] = (), loop: tuple[str, ...] = (), run: str = ""
) -> Iterator[RenderableType]:
    """Yield the diagnosis in reading order, columns that are wrong before all else; every paragraph hangs behind its
    keyword, so that it wraps at any width.

    loop: sentences on the gain in commanded force; run: how to run what to record next, where a plan of it is written.
    """
    yield Text()
    for suspect in diagnosis.suspects:
        yield Text(suspect.sentence, style="bold red" if suspect.is_sure else "bold yellow")
    yield Text(headline.answer_sentence(diagnosis), style=f"bold {_colour(diagnosis)}")
    if lack := headline.lack_sentence(diagnosis):
        yield Text(lack)
    if refit := headline.refit_sentence(diagnosis):
        yield Text(refit)
    yield Text()
    yield _line("off by", _initial_error(diagnosis))
    if diagnosis.machine is not None:
        yield _line("before", words.machine_sentence(diagnosis))
    if diagnosis.causes:
        yield _line("left", _remaining_error(diagnosis))
    yield from _cause_table(diagnosis)
    for rest in diagnosis.leftover:
        yield _line("leftover", words.leftover(rest), "yellow")
        if rest.experiment:
            yield _line("", f"to show its nature: {rest.experiment}", "dim")
    yield from _rejected_line(diagnosis)
    for keyword, sentence in zip(("control", *[""] * len(loop)), loop, strict=False):
        yield _line(keyword, sentence)
    sentences = {suspect.sentence for suspect in diagnosis.suspects}
    for note in (note for note in words.all_notes(diagnosis, notes) if note not in sentences):
        yield _line("note", note, "dim")
    yield from _next_lines(diagnosis, run)


def _colour(diagnosis: Diagnosis) -> str:
    is_off = diagnosis.verdict is not Verdict.UNKNOWN and headline.is_plant_off(diagnosis)
    return "yellow" if why_blind(diagnosis) or is_off else _COLOUR[diagnosis.verdict]


def _line(keyword: str, text: str, style: str = "") -> RenderableType:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(min_width=8, no_wrap=True, style="dim")
    grid.add_column(overflow="fold")  # a path that is cut cannot be copied
    grid.add_row(keyword, Text(text, style=style))
    return grid


def _initial_error(diagnosis: Diagnosis) -> str:
    baseline = diagnosis.baseline
    readings = f"{baseline.samples:,}".replace(",", " ")
    model = "the base model refitted" if diagnosis.machine is None else "the machine as it was"
    return (
        f"{words.force(baseline.rms_n)} N RMS with {model}; noise floor "
        f"{words.force(baseline.noise_floor_n)} N, {words.floor_source(diagnosis)} "
        f"({readings} readings, {baseline.duration_s:.1f} s)"
    )


def _remaining_error(diagnosis: Diagnosis) -> str:
    reached = "at the noise floor" if diagnosis.extended.reaches_noise_floor else "above the noise floor"
    explained = words.percent(words.explained_share(diagnosis))
    return (
        f"{words.force(diagnosis.extended.held_out_rms_n)} N RMS held out with the causes, {reached}; "
        f"{explained} of the excess explained"
    )


def _cause_table(diagnosis: Diagnosis) -> Iterator[RenderableType]:
    if not diagnosis.causes:
        return
    yield Text()
    yield _CauseTable(diagnosis.causes)
    yield Text()
    for cause in diagnosis.causes:
        for name, estimate in cause.parameters.items():
            texts = f"{estimate.section}.{name} = {words.estimate(estimate)}{words.previous_value(diagnosis, name, estimate)}"
            yield Padding(Text(texts), (0, 0, 0, 2))
    yield Text()


@dataclass(frozen=True, slots=True)
class _CauseTable:
    """The causes with their gains: a column for each figure, on a narrow terminal one above the other."""

    causes: tuple[Cause, ...]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Yield the table that fits."""
        is_narrow = options.max_width < _LEAST_WIDTH
        table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, header_style="dim")
        table.add_column("cause", overflow="fold", min_width=0 if is_narrow else 23)
        for name in ("held out N RMS",) if is_narrow else ("confidence", "held out N RMS", "gain N [95 %]", "excess"):
            table.add_column(name, justify="left" if is_narrow else "right", no_wrap=True)
        for cause in self.causes:
            cells = _cells(cause)
            table.add_row(_name(cause), *((_stack(*cells),) if is_narrow else cells))
        yield table


def _name(cause: Cause) -> Text:
    group = words.others(cause)
    name = Text(cause.name, style="bold")
    if group:
        name.append(f"\nor {', or '.join(group)}", style="not bold yellow")
    return name


def _cells(cause: Cause) -> tuple[str, str, str, str]:
    """Confidence, held-out errors, gain with its interval, share of the excess."""
    gain = cause.gain
    won_n = gain.held_out_rms_before_n - gain.held_out_rms_after_n
    low_n, high_n = gain.ci95
    return (
        words.confidence(cause.confidence),
        words.gain_text(cause).removesuffix(" N"),
        f"{words.force(won_n)} [{words.force(low_n)}, {words.force(high_n)}]",
        words.percent(gain.share_of_excess),
    )


def _stack(confidence: str, held_out: str, gain: str, excess: str) -> str:
    return f"{held_out}\ngain {gain}\n{excess} of the excess\nconfidence {confidence}"


def _rejected_line(diagnosis: Diagnosis) -> Iterator[RenderableType]:
    ranked = sorted(diagnosis.rejected, key=lambda cause: -cause.gain)[:_MOST_REJECTED]
    if ranked:
        gains = ", ".join(f"{cause.name} ({words.force(cause.gain)} N)" for cause in ranked)
        yield _line("rejected", f"{gains}, nearest first")


def _next_lines(diagnosis: Diagnosis, run: str) -> Iterator[RenderableType]:
    proposals = words.next_recordings(diagnosis)
    if diagnosis.not_identifiable:
        count = len(diagnosis.not_identifiable)
        yield _line(
            "unseen", f"{count} effect{'s' * (count > 1)} that this recording cannot show: {_unseen_names(diagnosis)}"
        )
    for keyword, (proposal, names) in zip(("next", *[""] * len(proposals)), proposals[:_MOST_PROPOSALS], strict=False):
        yield _line(keyword, proposal + (f" (shows {_first_names(names)})" if names else ""), "bold" if keyword else "")
    if len(proposals) > _MOST_PROPOSALS:
        yield _line("", f"and {len(proposals) - _MOST_PROPOSALS} more in the report (--report FILE.html)", "dim")
    if run:
        yield _line("run", run, "bold")
    elif proposals:
        yield _line("", "--plan PLAN.yaml writes what the gateway can run of it, for calibrate --plan", "dim")


def _unseen_names(diagnosis: Diagnosis) -> str:
    return _first_names([item.name for item in diagnosis.not_identifiable])


def _first_names(names: tuple[str, ...] | list[str]) -> str:
    more = len(names) - _MOST_NAMES
    return words.join_words([*names[:_MOST_NAMES], f"{more} more"] if more > 1 else names)
