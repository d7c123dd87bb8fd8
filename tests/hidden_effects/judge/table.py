"""Rates with Wilson 95 % intervals, and the rates that must hold beside them, as the Markdown of gateway/diagnosis/RATES.md."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from math import sqrt
from typing import Any

Row = dict[str, Any]
Z95 = 1.959964
HIDDEN = ("alone", "two", "three")


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a rate; (0, 1) of nothing."""
    if not count:
        return 0.0, 1.0
    rate, spread = hits / count, Z95**2 / count
    middle = (rate + spread / 2.0) / (1.0 + spread)
    half = Z95 / (1.0 + spread) * sqrt(rate * (1.0 - rate) / count + spread / (4.0 * count))
    return max(0.0, middle - half), min(1.0, middle + half)


def rate(rows: Sequence[Row], hit: Callable[[Row], bool]) -> str:
    hits = sum(map(hit, rows))
    if not rows:
        return "- | - | -"
    low, high = wilson(hits, len(rows))
    return f"{hits}/{len(rows)} | {100 * hits / len(rows):.1f} % | {100 * low:.1f} .. {100 * high:.1f} %"


def sized(rows: Iterable[Row], low: float, high: float) -> list[Row]:
    return [row for row in rows if low <= row["size"] < high]


def of_kind(rows: Iterable[Row], *kinds: str) -> list[Row]:
    return [row for row in rows if row["kind"] in kinds]


def lied(row: Row) -> bool:
    return row["verdict"] == "confirmed" and bool(row["causes"])


def is_silent(row: Row) -> bool:
    """Neither a cause nor a word that something is left."""
    return not row["causes"] and not row["described"]


def names_another(row: Row) -> bool:
    """Is a cause among those named, alone or beside the true one, whose group does not hold what is hidden?"""
    return any(not {cause["name"], *cause["group"]} & set(row["truth"]) for cause in row["causes"])


def table(rows: Sequence[Row]) -> str:
    """Rows that were skipped are left out. One that failed is neither right nor described, and no proof of honesty: the
    rates of lies and alarms leave it out."""
    judged = [with_failure(row) for row in rows if "skipped" not in row]
    answered = [row for row in judged if "failed" not in row]
    alone, several = of_kind(judged, "alone"), of_kind(judged, "two", "three")
    outside = of_kind(judged, "outside")
    seconds, processor = (sorted(row.get(key, 0.0) for row in alone) or [0.0] for key in ("seconds", "processor_s"))
    hidden = of_kind(answered, *HIDDEN)
    made = [
        *by_size(alone, 0.75, 9.0, ("0.75-2x", ">= 95 % at 1x")),
        *by_size(alone, 0.0, 0.75, ("0.3-0.75x", ">= 92 % at 0.5x")),
        ("... any group that holds it counts", "", rate(alone, lambda row: row["honest"])),
        ("... the very name first", "", rate(alone, lambda row: row["named"])),
        ("silent: no cause, and no word that something is left", "", rate(alone, is_silent)),
        ("another name, alone or beside the true one", "", rate(alone, names_another)),
        ("confidently wrong", "<= 1 %", rate(hidden, lambda row: row["wrong"])),
        ("... `confirmed` with a wrong name", "", rate(hidden, lambda row: lied(row) and names_another(row))),
        ("two or three, exact set", ">= 90 %", rate(several, lambda row: row["right"])),
        ("... any groups that hold it count", "", rate(several, lambda row: row["honest"])),
        ("false alarms", "<= 0.5 %", rate(of_kind(answered, "null"), lambda row: row["alarm"])),
        ("outside the catalogue: confirmed", "<= 3 %", rate(of_kind(answered, "outside"), lied)),
        ("outside the catalogue: described", ">= 90 %", rate(outside, lambda row: row["described"])),
    ]
    lines = ["| what | bar | hits | rate | 95 % interval |", "|---|---|---|---|---|"]
    lines += [f"| {what} | {bar} | {found} |" for what, bar, found in made]
    worst, middle, busy = seconds[-1], seconds[len(seconds) // 2], processor[len(processor) // 2]
    skipped, failed = sum("skipped" in row for row in rows), sum("failed" in row for row in rows)
    lines.append(f"\none effect: median {middle:.1f} s, worst {worst:.1f} s (bar 10 s), {busy:.1f} s of processor")
    return (
        "\n".join(lines) + f"; {len(judged)} recordings, {skipped} without the wanted size, {failed} without an answer"
    )


def by_size(alone: Sequence[Row], low: float, high: float, words: tuple[str, str]) -> Iterator[tuple[str, str, str]]:
    """Right names of these sizes, and of them those under white and under coloured noise. words: the sizes, the bar."""
    rows = sized(alone, low, high)
    yield f"right name or group, {words[0]}", words[1], rate(rows, lambda row: row["right"])
    for colour in ("white", "coloured"):
        some = [row for row in rows if (row.get("colour") == "white") == (colour == "white")]
        yield f"... under {colour} noise", "", rate(some, lambda row: row["right"])


def with_failure(row: Row) -> Row:
    """No answer is no answer."""
    nothing = dict.fromkeys(("right", "honest", "named", "wrong", "alarm", "described"), False)
    return nothing | {"verdict": "failed", "causes": [], "leftover": []} | row


def by_effect(rows: Sequence[Row]) -> str:
    """One line for each hidden effect that was asked alone or from outside."""
    judged = [with_failure(row) for row in rows if "skipped" not in row and len(row["truth"]) == 1]
    lines = ["| effect | right | honest | confidently wrong | named instead |", "|---|---|---|---|---|"]
    for name in sorted({row["truth"][0] for row in judged}):
        own = [row for row in judged if row["truth"][0] == name]
        others = sorted({cause["name"] for row in own for cause in row["causes"]} - {name})
        marks = [sum(row[mark] for row in own) for mark in ("right", "honest", "wrong")]
        if own[0]["kind"] == "outside":
            marks[:2] = [sum(row["described"] for row in own)] * 2
        counts = " | ".join(f"{mark}/{len(own)}" for mark in marks)
        lines.append(
            f"| {name}{' (outside: described)' * (own[0]['kind'] == 'outside')} | {counts} | {', '.join(others)} |"
        )
    return "\n".join(lines)
