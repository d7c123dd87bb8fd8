"""Questions of a verb that --yes answers."""

import sys

import click

from gateway.cli.errors import CliError


def is_confirmed(question: str) -> bool:
    """Ask on stderr. CliError where nobody is there to answer, as in a script: it ended as if somebody had pressed Ctrl-C."""
    try:
        return click.confirm(question, err=True)
    except click.Abort as abort:
        if not isinstance(abort.__context__, EOFError) or sys.stdin.isatty():
            raise
        raise CliError("\nnobody is here to answer, and nothing was done: --yes answers for you") from None
