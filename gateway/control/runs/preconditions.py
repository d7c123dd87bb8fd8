"""What a person is asked before a run that moves the tool: in the terminal and on the page the same."""

from typing import Final

PRECONDITIONS: Final = (
    "Does the tool press on the workpiece, or on a stop, that takes {force:.0f} N?",
    "Are hands and people away, and does nothing else command this tool?",
    "Is the air on, with supply enough for {top:g} V?",
)
"""force: the largest that is planned, N; top: the highest voltage, V."""

WITHOUT_CHECK: Final = 2
"""How many of them count for a plan that leaves out the check of sign and scale."""


def preconditions(force_n: float, top_v: float, *, has_check: bool) -> tuple[str, ...]:
    """Return the questions of a run, with its numbers."""
    asked = PRECONDITIONS if has_check else PRECONDITIONS[:WITHOUT_CHECK]
    return tuple(text.format(force=force_n, top=top_v) for text in asked)
