"""Draw mutants of a tree that mutmut has mutated, and tell what each changes."""

import io
import json
import random
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

KILLED: Final = (1, 3)
"""Exit codes of mutmut that mean seen: a failing test, an internal error of pytest."""
TIMED_OUT: Final = (24, 36, 152, 255, -24)
"""Exit codes of mutmut: more time than the tests may need."""
SEEN_BY_ALL: Final = 1001
"""No exit code: not seen by the tests that mutmut asked, but by others of the room."""
UNASKED: Final = 33
"""Exit code of mutmut: no test calls this function."""


class Mutant(NamedTuple):
    """name: mutmut's; change: the changed lines, `-` before and `+` after; is_wording: nothing but text in quotes changes."""

    name: str
    file: str
    change: str
    is_wording: bool


def list_names(tree: Path) -> dict[str, str]:
    """Return every mutant's name, and the file that it is in."""
    found = {}
    for meta in sorted((tree / "mutants" / "gateway").rglob("*.meta")):
        file = str(meta.relative_to(tree / "mutants")).removesuffix(".meta")
        found |= dict.fromkeys(json.loads(meta.read_text(encoding="utf-8"))["exit_code_by_key"], file)
    return found


def read_results(tree: Path) -> dict[str, int | None]:
    """Return the exit code of each mutant's tests, None where they have not run."""
    found: dict[str, int | None] = {}
    for meta in (tree / "mutants" / "gateway").rglob("*.meta"):
        found |= json.loads(meta.read_text(encoding="utf-8"))["exit_code_by_key"]
    return found


def draw(tree: Path, count: int, seed: int, *, wording: bool) -> list[Mutant]:
    """Return so many mutants by chance, all of them where there are no more. wording: also those that change text alone."""
    names = list_names(tree)
    order = sorted(names)
    random.Random(seed).shuffle(order)
    mutants = (describe(name, names[name]) for name in order)
    drawn = (one for one in mutants if wording or not one.is_wording)
    return [one for _, one in zip(range(count), drawn, strict=False)]


def describe(name: str, file: str) -> Mutant:
    """Return a mutant with what it changes. The working directory is the mutated tree."""
    from mutmut.mutation.diff_apply import get_diff_for_mutant

    lines = get_diff_for_mutant(name, path=file).split("\n")[2:]
    before, after = ("\n".join(line[1:] for line in lines if line[:1] == sign) for sign in "-+")
    kept = [line for line in lines if line[:1] in "-+" and "_mutmut_" not in line]
    return Mutant(name, file, "\n".join(kept), bool(before) and _without_text(before) == _without_text(after))


def _without_text(code: str) -> list[str]:
    return list(_tokens(code))


def _tokens(code: str) -> Iterator[str]:
    try:
        for token in tokenize.generate_tokens(io.StringIO(code.strip()).readline):
            yield "text" if token.type == tokenize.STRING else token.string
    except (tokenize.TokenError, IndentationError):
        return
