"""Questions that are answered by yes or no."""

import sys

import click

from gateway.cli.errors import CliError


def is_yes(question: str, *, default: bool = False, err: bool = False) -> bool:
    """Ask until the answer is yes or no, or nothing, which is the default; another answer is told what is allowed."""
    usual = "y" if default else "n"

    def read(answer: str) -> bool:
        word = answer.strip().lower()
        if word not in ("y", "yes", "n", "no"):
            raise click.UsageError(f"{answer} is neither y (yes) nor n (no); Enter alone means {usual}")
        return word.startswith("y")

    asked = f"{question} [{'Y/n' if default else 'y/N'}]"
    return bool(click.prompt(asked, default=usual, value_proc=read, err=err, show_default=False))


def is_confirmed(question: str) -> bool:
    """Ask on stderr what --yes answers. CliError where nobody is there, as in a script: it ended as if by Ctrl-C."""
    try:
        return is_yes(question, err=True)
    except click.Abort as abort:
        if not isinstance(abort.__context__, EOFError) or sys.stdin.isatty():
            raise
        raise CliError("\nnobody is here to answer, and nothing was done: --yes answers for you") from None
