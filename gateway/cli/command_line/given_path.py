"""Paths of the command line as people mean them, and words that mean nothing: an empty one, which a variable
of the shell leaves that is not set, and one that is longer than any path or number."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from stat import S_ISDIR
from typing import Any, Final

import click

from gateway.plain_file import exists, expand_home

EMPTY: Final = "an empty name: is a variable of the shell not set?"
_MAY_BE_EMPTY: Final = ("--name", "--note")  # words for people
_LONGEST: Final = 4096
"""Characters of one word: as many as a path of Linux has. Python reads no number of more than 4300 digits."""


class GivenPath(click.Path):
    """A path. `~` is the home directory also in `--state=~/cell`, where bash leaves it: a folder called ~ was made here. An
    empty name would be the folder that one stands in, for a state directory, or for a key. What may not be read is told by who
    opens it (E105, with its exit code)."""

    def __init__(self, **rules: Any) -> None:
        super().__init__(path_type=Path, **{"readable": False, **rules})

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path; BadParameter where it breaks a rule of click.Path, or names nothing."""
        if not os.fspath(value):
            self.fail(EMPTY, param, ctx)
        if (self.exists or not self.file_okay) and (target := lost_target(expand_home(value))):
            self.fail(f"{os.fspath(value)!r} is a link to {target}, and there is nothing", param, ctx)
        path = super().convert(expand_home(value), param, ctx)
        with suppress(OSError):  # not there yet, or not for us to look at; click refuses files alone, a device is none
            is_folder = S_ISDIR(Path(os.fsdecode(path)).stat().st_mode)
            if not (self.file_okay or is_folder):
                self.fail(f"{os.fspath(path)!r} is no directory", param, ctx)
        return path


def lost_target(path: Path) -> str:
    """Return where a link leads behind which nothing is, or a ring of links; empty for any other path."""
    with suppress(OSError, ValueError):
        if not exists(path):
            return str(path.readlink())
    return ""


def refuse_senseless_words(words: Sequence[str]) -> None:
    """Raise UsageError for a command line with an empty word in it (as a recording it was an internal error, and as --rig it
    was demo's), or with one that is too long for anything (as a register's number it was an internal error)."""
    for before, word in zip(("", *words), words, strict=False):
        option = before if before.startswith("-") else ""
        if len(word) > _LONGEST:
            start = f"{option} {word[:20]}".strip()
            raise click.UsageError(f"{start}...: {len(word)} characters in one word; allowed up to {_LONGEST}")
        if word.startswith("--") and word.endswith("="):
            option, word = word[:-1], ""
        if not word and option not in _MAY_BE_EMPTY:
            raise click.UsageError(f"{option}: {EMPTY}" if option else EMPTY)
