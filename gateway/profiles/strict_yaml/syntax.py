"""What a YAML parser's complaint means to somebody who edits a rig file.

libyaml and PyYAML's own parser word the same fault differently; the table knows both by a part of their sentence.
"""

from typing import Final

import yaml

_SENTENCES: Final = (
    ("levels deep", "nested deeper than any profile"),
    (
        "mapping values are not allowed",
        "a second `: ` in one line, a line above without its colon, or a wrong indent: mend it, or quote the text",
    ),
    ("could not find expected ':'", "a key without a colon: write `key: value`"),
    ("found unexpected end of stream", "a quote is opened and never closed"),
    ("expected ',' or ']'", "a list is opened with `[` and not closed, or a comma is missing"),
    ("expected ',' or '}'", "a mapping is opened with `{` and not closed, or a comma is missing"),
    ("did not find expected key", "this line does not fit the lines before it: check the spaces before the key"),
    ("expected <block end>", "this line does not fit the lines before it: check the spaces before the key"),
    ("did not find expected '-' indicator", "this line does not fit the list before it: check the spaces before `-`"),
    ("sequence entries are not allowed", "a list item `- ` cannot stand here: begin it on a line of its own"),
    ("unknown escape character", "an unknown `\\` escape within double quotes: use single quotes"),
    ("undefined tag handle", "tags (`!...`) are not used here"),
    ("control characters are not allowed", "a control character that no text editor shows: delete it"),
    ("special characters are not allowed", "a control character that no text editor shows: delete it"),
    ("that cannot start any token", "a value cannot begin with this character: quote the text"),
    ("<document start>", "nothing can follow here: check the spaces before the keys"),
)


def syntax_sentence(error: yaml.YAMLError, text: str) -> tuple[int, int, str]:
    """(line, column, sentence) of a parser's complaint; line and column count from 1."""
    problem = str(getattr(error, "problem", None) or getattr(error, "reason", None) or error)
    line, column = _place(error, text)
    lines = text.splitlines()
    indent = lines[line - 1][: max(column, 1)] if line <= len(lines) else ""
    if "\t" in indent and not indent.strip(" \t-"):
        return line, indent.index("\t") + 1, "a tab: YAML is indented with spaces"
    for part, sentence in _SENTENCES:
        if part in problem:
            return line, column, sentence
    return line, column, f"not YAML: {problem}"


def _place(error: yaml.YAMLError, text: str) -> tuple[int, int]:
    """Where the complaint points; an unclosed quote or bracket is placed where it was opened, not at the file's end."""
    mark = getattr(error, "problem_mark", None)
    opened = getattr(error, "context_mark", None)
    if opened is not None and (
        "end of stream" in str(getattr(error, "problem", "")) or "'," in str(getattr(error, "problem", ""))
    ):
        mark = opened
    if mark is not None:
        return mark.line + 1, mark.column + 1
    position = getattr(error, "position", None)  # a reader's error: a character that YAML does not allow
    if not isinstance(position, int):
        return 1, 1
    before = text[:position]
    return before.count("\n") + 1, len(before.rpartition("\n")[2]) + 1
