"""`record`: start and stop a recording in the gateway that runs."""

import json
from typing import Any

import click

from gateway.cli.options import StateChoice, json_option, state_options

_ON = {"on": True, "off": False}


EXAMPLES = ("record on", "record off")


@click.command()
@click.argument("what", type=click.Choice(["on", "off", "status"]), default="status")
@state_options
@json_option
def command(*, what: str, state: StateChoice, as_json: bool) -> None:
    """Start or stop a recording in the running gateway."""
    from gateway.cli.control_socket import ask

    request: dict[str, Any] = {"do": "record"}
    if what in _ON:
        request["on"] = _ON[what]
    answer = ask(state.directory, request)
    click.echo(json.dumps(answer) if as_json else _sentence(answer))


def _sentence(answer: dict[str, Any]) -> str:
    if answer.get("recording"):
        return f"recording to {answer['recording']}, {answer.get('rows', 0)} rows so far"
    if answer.get("written"):
        return f"recorded {answer.get('rows', 0)} rows to {answer['written']}"
    return "not recording"
