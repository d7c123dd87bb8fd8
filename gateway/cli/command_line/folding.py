"""Lines folded at the terminal's width, so that nothing is cut and what belongs together hangs together."""

import shutil
from collections.abc import Iterable
from textwrap import wrap
from typing import Final

from gateway.profiles.strict_yaml.faults import printable

_ENTRY: Final = " " * 6
_SPACE: Final = "\t\n\r "


def fold(line: str, indent: int, *, widest: int | None = None) -> list[str]:
    """Return the line in as many as the terminal's width asks for; the later ones hang behind `indent` spaces. widest: bound
    of characters also on a wider terminal. What a file names itself cannot write on the terminal otherwise (escape codes)."""
    width = shutil.get_terminal_size().columns - 1
    return wrap(
        "".join(sign if sign in _SPACE else printable(sign) for sign in line),
        min(width, widest or width),
        subsequent_indent=" " * indent,
        break_on_hyphens=False,
        break_long_words=False,
    )


def fold_entry(number: int | str, facts: Iterable[str], mark: str = " ") -> list[str]:
    """Return one entry of a numbered list: its number beside the first fact, the others below; empty ones are left out."""
    head, *rest = [fact for fact in facts if fact]
    lines = fold(f"{mark}{number:>3}  {head}", len(_ENTRY))
    for fact in rest:
        lines += fold(_ENTRY + fact, len(_ENTRY))
    return lines
