"""`schema`: the JSON Schema of a kind of profile, for editors that complete and check while one types."""

import json

import click

KINDS = ("rig", "device", "plant", "calibration", "registers", "plan")


EXAMPLES = ("schema rig", "schema plant")


@click.command()
@click.argument("kind", type=click.Choice(KINDS), default="rig")
def command(*, kind: str) -> None:
    """Print the JSON Schema of a kind of profile."""
    from gateway.profiles.schema import schema

    click.echo(json.dumps(schema(kind), indent=2))
