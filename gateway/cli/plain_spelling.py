"""What is printed for a character that the terminal's encoding does not have: one that looks like it, else `?`. A minus that
was a question mark left a number without its sign, and the digits of `monitor` could not be read at all."""

import codecs
from typing import Final

ERRORS: Final = "spelled_plainly"
"""The name for `errors=` of a stream, once `register` was called."""
_PLAIN: Final = str.maketrans(
    {
        **dict.fromkeys("−–—─━╴╶▬", "-"),
        **dict.fromkeys("╭╮╰╯┌┐└┘├┤┬┴┼", "+"),
        **dict.fromkeys("│┃", "|"),
        **dict.fromkeys("█▇▆▅▄", "#"),
        **dict.fromkeys("▃▂▁", "_"),
        "▀": '"',
        "×": "x",
        "·": ".",
        "•": "*",
        "●": "*",
        "▸": ">",
        "→": "->",
        "±": "+-",
        "…": "...",
        "µ": "u",
    }
)


def register() -> None:
    """Make the name known to the codecs."""
    codecs.register_error(ERRORS, _spell)


def _spell(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    words = error.object[error.start : error.end].translate(_PLAIN)
    return "".join(letter if letter.isascii() else "?" for letter in words), error.end
