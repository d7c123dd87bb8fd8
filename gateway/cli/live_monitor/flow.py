"""Words with their styles laid into lines of a width: nothing is cut, what does not fit goes to the next line."""

import textwrap
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from rich.text import Text


class StyledWords(NamedTuple):
    """Words and their style. is_sentence: it may go on in the next line; else it stays together where it can."""

    words: str
    style: str = ""
    is_sentence: bool = False


class TableCell(NamedTuple):
    """A cell of a row: its words, its width in columns, its style, and whether it ends at the right."""

    words: str
    width: int
    style: str = ""
    is_right: bool = False


def flow_lines(parts: Iterable[StyledWords], width: int) -> list[Text]:
    """Put parts one after the other, two spaces between them."""
    lines = [Text(no_wrap=True)]
    for part in parts:
        used = lines[-1].cell_len
        if used:
            lines[-1].append(" " * (2 - lines[-1].plain.endswith(" ")))
        first, *others = _break_after(lines[-1].cell_len, part, width)
        lines[-1].append(first, part.style)
        lines += [Text(piece, part.style, no_wrap=True) for piece in others]
    return lines


def _break_after(used: int, part: StyledWords, width: int) -> list[str]:
    """Return the pieces of a part; the first, which may be empty, stands behind what is in the line already."""
    if used + len(part.words) <= width:
        return [part.words]
    if not part.is_sentence:
        return ["", *wrap_words(part.words, width)] if used else wrap_words(part.words, width)
    pieces = textwrap.wrap(part.words, width, initial_indent=" " * used)
    return [pieces[0][used:] if len(pieces[0]) > used else "", *pieces[1:]]


def row_lines(cells: Sequence[TableCell]) -> list[Text]:
    """Put cells beside each other, a space between them; a cell that is too long goes on below itself."""
    wrapped = [wrap_words(cell.words, cell.width) for cell in cells]
    return [_row_line(cells, wrapped, at) for at in range(max(map(len, wrapped)))]


def _row_line(cells: Sequence[TableCell], wrapped: list[list[str]], at: int) -> Text:
    line = Text(no_wrap=True)
    for cell, pieces in zip(cells, wrapped, strict=True):
        words = pieces[at] if at < len(pieces) else ""
        line.append(words.rjust(cell.width) if cell.is_right else words.ljust(cell.width), cell.style).append(" ")
    line.right_crop(1)
    return line


def wrap_words(words: str, width: int) -> list[str]:
    """Split words into lines of a width at most; one line for what fits, spaces at its ends kept."""
    return [words] if len(words) <= width else textwrap.wrap(words, width) or [""]
