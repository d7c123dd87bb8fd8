"""A fit's document as a table and a few sentences for the terminal."""

from typing import Any, Final

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from gateway.reports.fit.headline import answer_sentence, policy
from gateway.reports.fit.names import describe_model, spell_groups, spell_model

_LEAST_WIDTH: Final = 90  # below it headings stand in two lines, and a held-out error below its RMS
_CLOSE_WIDTH: Final = 76  # below it cells stand close together, too
_COLUMNS: Final = ("order", "coeffs", "RMS N", "max N", "held-out RMS N")
_NARROW_COLUMNS: Final = ("order", "coeffs", "RMS\nN", "max\nN", "held-out\nRMS N")


def print_fit(document: dict[str, Any]) -> None:
    """Print the fits as a table, and sentences on them."""
    console = Console()
    console.print(fit_table(document, console.width))
    for line in summary(document):
        console.print(line, highlight=False, soft_wrap=True)


def fit_table(document: dict[str, Any], width: int = _LEAST_WIDTH) -> Table:
    """Return one row per model and order; the chosen one stands out, those that may not drive a plant step back. width: of the
    terminal, of which nothing may be beyond."""
    is_narrow = width < _LEAST_WIDTH
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, header_style="dim", caption_justify="left")
    if width < _CLOSE_WIDTH:
        table.padding = (0, 0)
    table.add_column("model", min_width=6)
    for name in _NARROW_COLUMNS if is_narrow else _COLUMNS:
        table.add_column(name, justify="right", min_width=max(map(len, name.split("\n"))), no_wrap="out" not in name)
    table.add_column("verdict", min_width=7)
    table.add_column("paper's\nnorm *", justify="right", style="dim", min_width=7)
    before = ""
    for fit in document["fits"]:
        if before and fit["model"] != before:
            table.add_section()
        before = fit["model"]
        table.add_row(*_cells(fit), style="bold green" if fit["chosen"] else None if fit["usable"] else "dim")
    return table


def _cells(fit: dict[str, Any]) -> list[str | Text]:
    error = f" ± {fit['heldout_error_n']:.3f}" if fit["heldout_error_n"] is not None else ""
    heldout = f"{fit['heldout_rms_n']:.3f}{error}" if fit["heldout_rms_n"] is not None else "-"
    return [
        f"{'▸ ' if fit['chosen'] else '  '}{fit['model'].upper()}",
        str(fit["order"]),
        str(fit["coefficients"]),
        f"{fit['rms_n']:.3f}",
        f"{fit['max_n']:.2f}",
        heldout,
        "chosen" if fit["chosen"] else _verdict(fit),
        f"{fit['paper_norm']:.4f}",
    ]


def _verdict(fit: dict[str, Any]) -> str:
    """Short words; the report has the sentences."""
    if fit["usable"]:
        return "ok"
    flaws = [] if fit["monotone"] else ["dips"]
    flaws += ["crosses"] if fit["crossing"] else []
    flaws += [] if fit["steep"] or not fit["monotone"] else ["flat"]
    return ", ".join(flaws)


def summary(document: dict[str, Any]) -> list[Text]:
    """Return what was fitted, what was chosen and why, what was noticed, and where the report is."""
    ladder, chosen, reversal = document["ladder"], document["chosen"], document["reversal"]
    low_v, high_v = ladder["voltage_v"]
    low_n, high_n = chosen["force_range_n"]
    rig = document["rig"] or "not named"
    lines = [
        Text(
            "RMS and max: of the stairs, each by its own branch; * the paper's normalised figure, no force; dips: a branch is "
            "not increasing; flat: below 0.5 N/V somewhere; crosses: the falling branch is below the rising one somewhere",
            style="dim",
        ),
        Text(),
        Text(
            f"{answer_sentence(document)}.", style="bold green" if not document["measured"]["rejected"] else "bold red"
        ),
        Text(),
        Text(
            f"ladder    {ladder['points']} stairs in {spell_groups(ladder['groups'])}, {low_v:g} .. {high_v:g} V, rig {rig}"
        ),
        Text(f"chosen    {spell_model(chosen['model'], chosen['order'])}, {low_n:.1f} .. {high_n:.1f} N", style="bold"),
        Text(f"          {describe_model(chosen['model'])}"),
        Text(f"error     {_describe_error(document['measured'])}", style="bold"),
        Text(f"          {_reason(chosen)}"),
        Text(f"reversal  {_reversal(reversal)}"),
    ]
    lines += [Text(f"note      {note}", style="yellow") for note in document["notes"]]
    if document.get("calibration"):
        lines.append(_describe_storing(document))
    if document.get("report"):
        lines.append(Text(f"report    {document['report']}"))
    return lines


def _describe_error(measured: dict[str, Any]) -> str:
    """Return the error on all that was measured, and what it is to be compared with."""
    words = (
        f"{measured['rms_n']:.3f} N RMS, {measured['max_n']:.2f} N max on all {measured['points']} measured points, "
        f"{'reversals included' if measured['reversals'] else 'no reversals measured'}"
    )
    if measured["allowed_rms_n"] is not None:
        words += f"; allowed {measured['allowed_rms_n']:.3f} N"
    if measured["compared_rms_n"] is not None:
        words += f"; {measured['compared_with']} has {measured['compared_rms_n']:.3f} N on them"
    return words


def _describe_storing(document: dict[str, Any]) -> Text:
    number, rejected = document["calibration"], document["measured"]["rejected"]
    named = f"calibration {number} ({document['name']})"
    if rejected:
        return Text(f"stored    {named} as rejected, not offered: {rejected}", style="red")
    return Text(f"stored    {named}; force-gateway calibration use {number}")


def _reason(chosen: dict[str, Any]) -> str:
    if chosen["constrained"]:
        return "the best that increases everywhere and does not cross; better free optima do not"
    return "fewest coefficients that are not certainly worse than the best held-out error that may drive a plant"


def _reversal(reversal: dict[str, Any]) -> str:
    if not reversal["identified"]:
        return f"{policy(reversal)}, assumed"
    other = (
        ""
        if reversal["slip_heldout_n"] is None
        else (
            f" (held out {reversal['slip_heldout_n']:.2f} N by slip stops, {reversal['blend_heldout_n']:.2f} N by the blend)"
        )
    )
    return (
        f"{policy(reversal)}: {reversal['rms_n']:.2f} N RMS on {reversal['points']} minor-loop points, "
        f"{reversal['switched_rms_n']:.2f} N if branches were switched{other}"
    )
