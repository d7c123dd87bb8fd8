"""`version`: what runs here, for a report."""

import json
import platform
import sys

import click

from gateway import VERSION
from gateway.cli.options import json_option

EXAMPLES = ("version", "version --json")


@click.command()
@json_option
def command(*, as_json: bool) -> None:
    """Print versions, for a report."""
    facts = {
        "force-gateway": VERSION,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "executable": sys.executable,
    }
    if as_json:
        click.echo(json.dumps(facts))
        return
    for name, value in facts.items():
        click.echo(f"{name:<14} {value}")
