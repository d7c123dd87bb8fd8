"""What a person is asked before a run that moves the tool: in the terminal and on the page the same."""

from typing import Final

PRECONDITIONS: Final = (
    "Does the tool press on the workpiece, or on a stop, that takes {force}?",
    "Are hands and people away, and does nothing else command this tool?",
    "Is the air on, with supply enough for {top}?",
)
"""force: the largest that is planned; top: the highest voltage."""

WITHOUT_CHECK: Final = 2
"""How many of them count for a plan that leaves out the check of sign and scale."""


def preconditions(force_n: float | None, top_v: float | None, *, has_check: bool) -> tuple[str, ...]:
    """Return the questions of a run, with its numbers. None: of a gateway elsewhere, which tells none beforehand."""
    asked = PRECONDITIONS if has_check else PRECONDITIONS[:WITHOUT_CHECK]
    force = "the largest force that its rig file allows (force_max_n)" if force_n is None else f"{force_n:.0f} N"
    top = "the highest voltage of that rig" if top_v is None else f"{top_v:g} V"
    return tuple(text.format(force=force, top=top) for text in asked)
