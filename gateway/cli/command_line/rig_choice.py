"""The option `--rig`, the same for every verb; and what is said where none was given.

On a terminal it is said which rig was taken, because nothing in the answer of, say, `calibration list` would show that it was
another.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from gateway.cli.command_line.completion_words import complete_rigs
from gateway.cli.command_line.known_rigs import check_rig, rigs_with_state

Function = TypeVar("Function", bound=Callable[..., Any])


def is_terminal() -> bool:
    """Tell whether somebody reads what is said beside the answer."""
    return sys.stderr.isatty()


def tell_rig(rig: str, directory: Path) -> None:
    """Say on a terminal which rig was taken where none was given, and that there are others."""
    if not is_terminal():
        return
    from gateway.service.supervisor.run_options import stem_of

    others = [name for name in rigs_with_state() if name != stem_of(rig)]
    more = f"; --rig takes another: {', '.join(others)}" if others else ""
    said = f"rig {rig}, state {directory}{more}"
    click.echo(said if os.environ.get("NO_COLOR") else click.style(said, dim=True), err=True)


def rig_option(help_text: str, *, checks: bool = True) -> Callable[[Function], Function]:
    """Return --rig as every verb has it. help_text: which rig it is where none is given; checks: whether an unknown one is
    refused here, or later by `choose_rig`, which knows of --state."""
    callback = _known_rig if checks else None
    return click.option("--rig", metavar="RIG", help=help_text, shell_complete=complete_rigs, callback=callback)


def _known_rig(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    if value is not None and not context.resilient_parsing:
        check_rig(value)
    return value
