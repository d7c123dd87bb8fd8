"""The study as one self-contained HTML file, and its tables in the terminal."""

import base64
from collections.abc import Iterable, Sequence
from html import escape
from typing import Final

from rich.console import Console
from rich.table import Table

from gateway.reports.frame import Head, page, section, tiles
from paper.comparison import Interval
from paper.experiments import exercises, rigs
from paper.experiments.laws import FASTEST_N_PER_S, LEAD, RESPONSE_LAG_S, TRIM
from paper.experiments.trials import settled_s
from paper.figures.all_figures import FIGURES
from paper.goals import MET, MISSED, GoalResult, judge_goals, summary
from paper.study import Study
from paper.verdicts.all_verdicts import counts, numbers, verdicts
from paper.verdicts.verdict import NO, OUTSIDE, YES, Verdict

CLASS: Final = {YES: "yes", NO: "no", OUTSIDE: "out", MET: "yes", MISSED: "no", "": ""}
TABLE_HEAD: Final = ("where", "statement of the paper", "its value", "ours (twin)", "verdict", "why")
RATIO_HEAD: Final = (
    "measure",
    "paper's BSFM",
    "ours",
    "ratio [95 %]",
    "goal",
    "computed limit, as a share of the paper's",
    "why the goal is missed",
)
LIMIT_HEAD: Final = (
    "step to",
    "band",
    "enters at 10 V, at the earliest",
    "fastest that stays",
    "by",
    "paper's law",
    "ours",
)


def spread(value: Interval) -> str:
    """Return a ratio with its interval as text."""
    return f"{value.mean:.2f} [{value.low:.2f}, {value.high:.2f}]"


def verdict_cells(line: Verdict) -> tuple[str, ...]:
    """Return a verdict's cells of the table."""
    return (line.where, line.statement, line.paper, line.ours, line.verdict, line.why)


def ratio_cells(row: GoalResult) -> tuple[str, ...]:
    """Return a comparison's cells of the table."""
    comparison = row.comparison
    digits = 3 if comparison.unit == "s" else 2
    means = tuple(f"{comparison.means[law]:.{digits}f} {comparison.unit}" for law in ("bsfm", "ours"))
    goal = f" (≤ {comparison.goal:g})" if comparison.goal else ""
    return (
        comparison.name,
        *means,
        spread(comparison.ratios["ours"]),
        row.ours + (goal if row.ours else ""),
        row.bound,
        row.why,
    )


def limit_cells(study: Study) -> list[tuple[str, ...]]:
    """Return the rows of the table of limits: settling times beside the fastest that the regulator allows."""
    times_s = {
        band_n: {law: study.steps.score(settled_s(band_n), law)[0] for law in ("bsfm", "ours")} for band_n in (2.0, 1.0)
    }
    cases = list(dict.fromkeys(row.target_n for row in study.limits))
    rows = []
    for row in sorted(study.limits, key=lambda row: (-row.band_n, row.target_n)):
        laws = [times_s[row.band_n][law][cases.index(row.target_n)] for law in ("bsfm", "ours")]
        pulses = f"10 V for {row.up_ms} ms" + (f", 0 V for {row.down_ms} ms" if row.down_ms else "")
        times = (seconds(row.entered_s), seconds(row.settled_s), pulses, *map(seconds, laws))
        rows.append((f"{row.target_n:g} N", f"±{row.band_n:g} N", *times))
    return rows


def seconds(value_s: float) -> str:
    """Return a time as text."""
    return "never" if value_s != value_s else f"{value_s:.3f} s"


def assumptions(study: Study) -> list[str]:
    """Say what was run, and what is ours rather than the paper's."""
    return [*_rig(study), *_laws(), *_exercises(study.quick)]


def _rig(study: Study) -> list[str]:
    shares = ", ".join(f"{name} {share:.1%}" for (_, name), share in rigs.SPREAD.items())
    rig = f"""
        Rig: the twin of profiles/plants/paper-slide.yaml. Ladder 0-5-0 V by 0.1 V, {len(study.ladder)} points
        (Figs. 4-6). The ratios use {len(study.seeds)} copies; seed 0 is the rig itself. Spread of the others (assumed):
        {shares}."""
    norm = """
        The norm of Fig. 6 is the paper's own, not newtons of anything, and its formula is inferred. RMS and largest
        residual in N stand beside it."""
    return [rig, norm]


def _laws() -> list[str]:
    paper = """
        The paper's law: order-2 BSFM with shared ends, the branch chosen by the direction of the wanted force, open
        loop. PSFM: order 3, each direction its own ends."""
    ours = f"""
        Ours: gateway.control.Controller, reversals by slip stops fitted to ladder and minor loops, lead for two lags of
        {LEAD.lag_s:g} s, trim {TRIM.gain_v_per_n_s:g} V/Ns with a dead zone of {TRIM.dead_zone_n:g} N, response lag
        {RESPONSE_LAG_S:g} s. Force ramp {FASTEST_N_PER_S:g} N/s and no soft approach, because the paper's law has none;
        a rig's defaults (200 N/s, 2 N before contact) are gentler and slower."""
    return [paper, ours]


def _exercises(quick: bool) -> list[str]:
    ends = " and ".join(f"{low:g} .. {high:g} N" for low, high in exercises.RANGES_N)
    moving = f"""
        Reciprocating: {ends} at {exercises.PACE_N_PER_S:g} N/s (assumed). Partial reversals: {exercises.holds(quick)} random
        forces of 3 .. 37 N, {exercises.HOLD_S:g} s each, of which the last {exercises.SETTLED_S:g} s count. Months after
        the calibration (assumed): friction +25 %, pressure -1.5 %."""
    plate = f"""
        Steps of Fig. 8 and tracking start with the pad lifted by {1000 * rigs.LIFTED_M:g} mm. Tracking (assumed): plate
        bowed by {1000 * exercises.BOW_M:g} mm, robot path ±{1e6 * exercises.PATH_M:g} µm every
        {1000 * exercises.PATH_LENGTH_M:g} mm, milling marks ±{1e6 * exercises.MARKS_M:g} µm, spindle
        {exercises.UNBALANCE_N:g} N at 65 Hz. Errors are those of the true contact force; Fig. 9 shows the load cell's
        readings."""
    return [moving, plate]


# -- HTML


def html_table(head: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as HTML, which scrolls within itself."""
    titles = "".join(f"<th>{escape(title)}</th>" for title in head)
    body = "\n".join(f"<tr>{''.join(_cell(cell) for cell in row)}</tr>" for row in rows)
    whole = f"<table class='verdicts'><thead><tr>{titles}</tr></thead><tbody>\n{body}\n</tbody></table>"
    return f"<div class='wide' tabindex='0'>{whole}</div>"


def _cell(text: str) -> str:
    word = text.split(" (≤")[0]
    if word and word in CLASS:
        return f'<td class="verdict {CLASS[word]}">{escape(text)}</td>'
    return (
        f'<td class="number">{escape(text)}</td>'
        if text[:1].isdigit() and len(text) < 24
        else f"<td>{escape(text)}</td>"
    )


def html_figure(name: str, png: bytes) -> str:
    """Return a picture with its caption as HTML; on a narrow page it scrolls within itself."""
    caption, data = escape(FIGURES[name][0]), base64.b64encode(png).decode("ascii")
    image = f'<div class="picture" tabindex="0"><img alt="{caption}" src="data:image/png;base64,{data}"></div>'
    return f'<figure id="{name}" class="full">{image}<figcaption>{caption}</figcaption></figure>'


def html(study: Study, pictures: dict[str, bytes]) -> str:
    """Return the whole page. pictures: PNG bytes by short name."""
    lines = verdicts(study)
    shown = {name: html_figure(name, png) for name, png in pictures.items()}
    items = "".join(f"<li>{escape(text)}</li>" for text in assumptions(study))
    parts = [
        tiles(*((word, str(number), "statements of the paper") for word, number in numbers(lines).items())),
        section("Statement by statement", html_table(TABLE_HEAD, map(verdict_cells, lines))),
        section("Ours beside the paper's law", _ratios(study, shown["ratios"])),
        section("What the regulator's physics allows", _limits(study, shown["limit"])),
        section("The figures, redrawn", _paper_figures(shown)),
        section("What was run, and what is assumed", f"<ul>{items}</ul>"),
    ]
    mode = "quick run: few seeds and orders" if study.quick else f"{len(study.seeds)} seeds, all orders"
    head = Head(
        kind="The paper on the twin",
        answer=answer_sentence(lines),
        sentences=tuple(summary(study)),
        facts=("BSFM for a pneumatic constant-force device: each claim run again on a simulated copy of its rig", mode),
        title="The paper on the twin",
    )
    return page(head, parts, {"recording": "none: the twin of profiles/plants/paper-slide.yaml", "run": mode})


def answer_sentence(lines: Sequence[Verdict]) -> str:
    """Return how many of the paper's statements hold on the twin, as a sentence."""
    count = numbers(lines)
    return (
        f"{count[YES]} of {len(lines)} statements of the paper are reproduced on the twin, {count[NO]} are not, "
        f"{count[OUTSIDE]} lies outside software"
    )


def _ratios(study: Study, picture: str) -> str:
    text = f"""Ratios: geometric mean over {len(study.seeds)} copies of the rig, 95 % bootstrap interval. A goal is met when the
whole interval lies within it. Settling times: mean over the targets at which both settle; the paper's law never comes within
1 N at 5 N, ours does."""
    return f"{picture}{html_table(RATIO_HEAD, map(ratio_cells, judge_goals(study)))}<p>{text}</p>"


def _limits(study: Study, picture: str) -> str:
    text = """Dead time 80 ms, two lags of 72 ms, 0 .. 10 V in 10-bit steps, supply 0.85 MPa, pulses no shorter than a 9600-baud
command. The first bound holds for every command; the second is the best of all bang-bang commands on a grid."""
    return f"<p>{text}</p>{picture}{html_table(LIMIT_HEAD, limit_cells(study))}"


def _paper_figures(shown: dict[str, str]) -> str:
    figures = "\n".join(text for name, text in shown.items() if name.startswith("fig"))
    return (
        f"{figures}<p>Fig. 10 (surface, roughness) is a result of the process, outside what software can reproduce.</p>"
    )


# -- terminal


def print_tables(study: Study, console: Console) -> None:
    """Print the same tables as text."""
    lines = verdicts(study)
    _print(console, f"the paper on the twin: {counts(lines)}", TABLE_HEAD, map(verdict_cells, lines))
    _print(
        console,
        f"ours beside the paper's law, {len(study.seeds)} seeds",
        RATIO_HEAD,
        map(ratio_cells, judge_goals(study)),
    )
    for sentence in summary(study):
        console.print(sentence)


def _print(console: Console, title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    table = Table(title=title, title_justify="left", show_lines=False, expand=False)
    for name in head:
        table.add_column(name, overflow="fold")
    colours = {"yes": "green", "no": "red", "out": "yellow"}
    for row in rows:
        table.add_row(
            *(
                f"[{colours[CLASS[w]]}]{cell}[/]" if CLASS.get(w := cell.split(" (≤")[0]) else cell.replace("[", r"\[")
                for cell in row
            )
        )
    console.print(table)
