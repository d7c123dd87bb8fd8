"""The style of all reports, from `style.css` beside it: each report carries it within itself; the page serves the same file."""

import re
from functools import cache
from importlib.resources import files
from typing import Final

FILE_NAME: Final = "style.css"
_COMMENTS: Final = re.compile(r"/\*.*?\*/", re.DOTALL)
_SPACES: Final = re.compile(r"\s+")
_AROUND_SIGNS: Final = re.compile(r" ?([{};,>]) ?")


def read_style() -> str:
    """Return the style sheet as it is written."""
    return files(__package__).joinpath(FILE_NAME).read_text(encoding="utf-8")


@cache
def inline_style() -> str:
    """Return the style sheet for a page that carries it: without comments and spare spaces."""
    return _AROUND_SIGNS.sub(r"\1", _SPACES.sub(" ", _COMMENTS.sub("", read_style()))).strip()
