"""`explain`: what a code means, what it probably is, and what to do; needs no gateway and no network."""

import json
from dataclasses import asdict

import click

from gateway.cli.command_line.completion_words import complete_codes
from gateway.cli.command_line.folding import fold
from gateway.cli.command_line.known_codes import entries_of
from gateway.cli.options import json_option

EXAMPLES = ("explain W204", "explain over_force")


@click.command()
@click.argument("code", required=False, shell_complete=complete_codes)
@json_option
def command(*, code: str | None, as_json: bool) -> None:
    """Explain a code of a message, such as E110.

    A name in the registers, such as over_force, does too; without CODE all are listed.
    """
    from gateway.codes.all_codes import CATALOGUE

    if code is not None:
        _explain_code(code, as_json=as_json)
    elif as_json:
        click.echo(json.dumps([asdict(entry) for entry in CATALOGUE.values()], indent=2))
    else:
        for entry in CATALOGUE.values():
            click.echo(f"{entry.code}  {entry.title}" + (f"  ({entry.name})" if entry.name else ""))


def _explain_code(code: str, *, as_json: bool) -> None:
    """Print the entries of one code or name; UsageError where there is none."""
    entries = entries_of(code)
    if as_json:
        click.echo(json.dumps([asdict(entry) for entry in entries], indent=2))
        return
    for entry in entries:
        click.echo(f"{entry.code}  {entry.title}")
        for heading, text in (("seen", entry.seen), ("probably", entry.probably), ("do", entry.do)):
            for line in fold(f"  {heading:<10}{text}", 12, widest=100):
                click.echo(line)
