"""A page as data: sections with sentences, tables and lines to type; rendered as plain text, Markdown or JSON."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from textwrap import wrap
from typing import Final

Row = tuple[str, ...]
FORMATS: Final = ("text", "markdown", "json")
TEXT_WIDTH: Final = 120
"""Characters of a line in plain text, at the most; a table's columns but the last are as wide as they need to be."""

_FOLD: Final = partial(wrap, break_on_hyphens=False, break_long_words=False)  # a path or a command stays in one piece


@dataclass(frozen=True)
class Section:
    """One heading and what is below it. rows: a table, its first row the headings; commands: lines to type as they stand."""

    title: str
    sentences: tuple[str, ...] = ()
    rows: tuple[Row, ...] = ()
    commands: tuple[str, ...] = ()


def render_page(title: str, sections: Sequence[Section], form: str, width: int = TEXT_WIDTH) -> str:
    """Return the page, ending with a newline. form: one of FORMATS, ValueError for another; width: characters of a line of
    plain text."""
    if form == "json":
        return json.dumps({"title": title, "sections": [asdict(each) for each in sections]}, indent=1) + "\n"
    if form not in FORMATS:
        raise ValueError(f"{form} is not one of {', '.join(FORMATS)}")
    draw = _markdown if form == "markdown" else partial(_text, width=min(width, TEXT_WIDTH))
    head = f"# {title}" if form == "markdown" else f"{title}\n{'=' * len(title)}"
    return "\n\n".join([head, *("\n".join(draw(each)).rstrip() for each in sections)]) + "\n"


def _markdown(section: Section) -> Iterator[str]:
    yield f"## {section.title}\n"
    for sentence in section.sentences:
        yield f"- {sentence}"
    if section.rows:
        head, *rest = section.rows
        yield ("\n" if section.sentences else "") + _bars(head)
        yield _bars(("---",) * len(head))
        yield from (_bars(row) for row in rest)
    if section.commands:
        yield "\n```"
        yield from section.commands
        yield "```"


def _bars(row: Row) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"


def _text(section: Section, width: int) -> Iterator[str]:
    yield section.title
    yield "-" * len(section.title)
    for sentence in section.sentences:
        yield from _wrap(sentence, width)
    if section.rows:
        if section.sentences:
            yield ""
        widths = [max(len(row[k]) for row in section.rows) for k in range(len(section.rows[0]))]
        for row in section.rows:
            yield from _row(row, widths, width)
    if section.commands:
        yield ""
        yield from (f"    {line}" for line in section.commands)


def _row(row: Row, widths: Sequence[int], width: int) -> Iterator[str]:
    """Yield one row of a table; a last cell that is too long goes on below itself."""
    start = "  " + "".join(cell.ljust(room) + "  " for cell, room in zip(row[:-1], widths, strict=False))
    for place, line in enumerate(_FOLD(row[-1], max(40, width - len(start))) or [""]):
        yield ((start if place == 0 else " " * len(start)) + line).rstrip()


def _wrap(sentence: str, width: int) -> Iterator[str]:
    """Yield a sentence in lines, the second and the next ones set in."""
    yield from _FOLD(sentence, width, initial_indent="  ", subsequent_indent="    ")
