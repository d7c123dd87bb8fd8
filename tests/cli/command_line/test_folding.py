"""Folded lines say what they are given, and nothing that they are given writes on the terminal otherwise."""

from gateway.cli.command_line.folding import fold, fold_entry


def test_no_name_of_a_file_moves_the_cursor_or_turns_the_text_round() -> None:
    """A recording of another machine may be called anything: its escape codes cleared the screen that listed it."""
    (line,) = fold("a\x1b[2Jb\x07c\u202ed\x85e", 0)
    assert line == "a\\x1b[2Jb\\x07c\\u202ed\\x85e"
    assert all(part.isprintable() for part in fold_entry(1, ["x\x1b]0;y\x07", "one\ntwo"]))


def test_lines_of_a_note_are_joined_by_blanks() -> None:
    assert fold("new seals\ntomorrow", 0) == ["new seals tomorrow"]
