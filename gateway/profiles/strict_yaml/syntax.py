"""What a YAML parser's complaint means to somebody who edits a rig file.

libyaml and PyYAML's own parser word the same fault differently, and neither numbers its faults: a part of the sentence is all
there is to tell them by. That is done here, in one table, and nowhere else; what the table does not know is told as it came.
"""

import re
from typing import Final, NamedTuple

import yaml


class TooDeepError(yaml.MarkedYAMLError):
    """Our own complaint, of a document that a parser would take."""


class _Meaning(NamedTuple):
    """part: of the parser's sentence; is_where_opened: the fault is where a quote or bracket begins, not where it is missed."""

    part: str
    sentence: str
    is_where_opened: bool = False


_BLOCK: Final = "`>` and `|` begin text on the lines below them: quote the text that begins so"
_TAG: Final = "tags (`!...`) are not used here; quote the text"
_TOO_DEEP: Final = "nested deeper than any profile"
_MEANINGS: Final = tuple(
    _Meaning(*row)
    for row in (
        (
            "mapping values are not allowed",
            "a second `: ` in one line, a line above without its colon, or a wrong indent: fix it, or quote the text",
        ),
        ("could not find expected ':'", "a key without a colon: write `key: value`"),
        ("found unexpected end of stream", "a quote is opened and never closed", True),
        ("expected ',' or ']'", "a list is opened with `[` and not closed, or a comma is missing", True),
        ("expected ',' or '}'", "a mapping is opened with `{` and not closed, or a comma is missing", True),
        ("did not find expected key", "this line does not fit the lines before it: check the spaces before the key"),
        ("expected <block end>", "this line does not fit the lines before it: check the spaces before the key"),
        (
            "did not find expected '-' indicator",
            "this line does not fit the list before it: check the spaces before `-`",
        ),
        ("sequence entries are not allowed", "a list item `- ` cannot stand here: begin it on a line of its own"),
        ("unknown escape character", "an unknown `\\` escape within double quotes: use single quotes"),
        ("undefined tag handle", _TAG),
        ("control characters are not allowed", "a control character that no text editor shows: delete it"),
        ("special characters are not allowed", "a control character that no text editor shows: delete it"),
        ("expected alphabetic", "`*` and `&` name a value of YAML: quote the text that begins so", True),
        ("comment or line break", _BLOCK, True),
        ("comment or a line break", _BLOCK, True),
        ("indentation indicator", _BLOCK, True),
        ("expected whitespace or line break", _TAG, True),
        ("expected ' ', but found", _TAG, True),
        ("that cannot start any token", "a value cannot begin with this character: quote the text"),
        ("maximum nesting depth", _TOO_DEEP),  # a newer libyaml's, where brackets are read ahead of ours
        ("<document start>", "nothing can follow here: check the spaces before the keys"),
    )
)
_UNKNOWN: Final = _Meaning("", "")
_NO_BREAK_SPACE: Final = re.compile(r"^[ \t-]*(\u00a0)|^[^#'\"\n]*:(\u00a0)", re.MULTILINE)
"""Where YAML wants a space. It looks like one, and is none: web pages and word processors put it there."""
_BEHIND_A_BRACE: Final = "nothing but a comma stands behind `}`: quote the whole of a text that has braces in it"


def syntax_sentence(error: yaml.YAMLError, text: str) -> tuple[int, int, str]:
    """Return (line, column, sentence) of a parser's complaint; line and column count from 1."""
    problem = str(getattr(error, "problem", None) or getattr(error, "reason", None) or error)
    meaning = next((one for one in _MEANINGS if one.part in problem), _UNKNOWN)
    line, column = _place(error, text, meaning)
    lines = text.splitlines()
    indent = lines[line - 1][: max(column, 1)] if line <= len(lines) else ""
    if "\t" in indent and not indent.strip(" \t-"):
        return line, indent.index("\t") + 1, "a tab: YAML is indented with spaces"
    lines_before = "\n".join(lines[:line])
    if found := _NO_BREAK_SPACE.search(lines_before):
        before = lines_before[: found.end() - 1]
        column = len(before.rpartition("\n")[2]) + 1
        return before.count("\n") + 1, column, "a no-break space (U+00A0), as web pages have it: type a plain space"
    if isinstance(error, TooDeepError):
        return line, column, _TOO_DEEP
    mark = getattr(error, "problem_mark", None)
    if mark and mark.line < len(lines) and lines[mark.line][: mark.column].rstrip().endswith("}"):
        return mark.line + 1, mark.column + 1, _BEHIND_A_BRACE
    return line, column, meaning.sentence or f"not YAML: {problem}"


def _place(error: yaml.YAMLError, text: str, meaning: _Meaning) -> tuple[int, int]:
    """Return where the complaint points; an unclosed quote or bracket is placed where it was opened, not at the file's end."""
    opened = getattr(error, "context_mark", None) if meaning.is_where_opened else None
    mark = opened or getattr(error, "problem_mark", None)
    if mark is not None:
        return mark.line + 1, mark.column + 1
    position = getattr(error, "position", None)  # a reader's error: a character that YAML does not allow
    if not isinstance(position, int):
        return 1, 1
    before = text[:position]
    return before.count("\n") + 1, len(before.rpartition("\n")[2]) + 1
