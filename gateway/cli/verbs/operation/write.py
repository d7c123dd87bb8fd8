"""`write`: registers by name, in engineering units, all of them in one request where Modbus allows."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.completion_words import complete_assignments
from gateway.cli.errors import CliError
from gateway.cli.options import gateway_options, json_option, state_option
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.cli.master.client import Assignment, Frame, GatewayClient
    from gateway.cli.master.wires import Wire
    from gateway.registers import RegisterMap


EXAMPLES = ("write force_setpoint=12 control_word=enable", "write mode=force --dry-run")


@click.command()
@click.argument("assignments", metavar="NAME=VALUE...", nargs=-1, required=True, shell_complete=complete_assignments)
@click.option("--dry-run", is_flag=True, help="Say what would be sent, and send nothing that writes.")
@state_option("State directory: tells why in numbers.")
@gateway_options
@json_option
def command(*, assignments: tuple[str, ...], dry_run: bool, wire: "Wire", as_json: bool, **options: Any) -> None:
    """Write registers by name, in engineering units.

    NAME=VALUE in the register's unit; modes and bits by name. Those of one block go out in one request. A request that the
    gateway refuses ends with exit code 1, what it refused, why, and what to do.
    """
    from gateway.cli.master.client import GatewayClient
    from gateway.cli.master.refusal_text import explain_refusals
    from gateway.profiles import load_register_map

    register_map = load_register_map(options["map_name"])
    writes = [_assignment(register_map, text) for text in assignments]
    _refuse_doubles(writes)
    with GatewayClient(wire, options["unit"], register_map) as client:
        with explain_refusals(client):
            if any(any(each.data) for each in writes):  # what takes something off is never kept back
                client.check_map()
            frames = client.frames(writes)
        sent: list[Frame] = []
        with _sent_told(client, frames, sent), explain_refusals(client, frames, options["state"]):
            for frame in [] if dry_run else frames:
                client.write(frame)
                sent.append(frame)
    _tell(frames, writes, dry_run=dry_run, as_json=as_json)


@contextmanager
def _sent_told(client: "GatewayClient", frames: "list[Frame]", sent: "list[Frame]") -> Iterator[None]:
    """Add to what is told of a failure which requests had gone out before: who reads of a refusal alone takes it for all. And
    which one has no answer: who reads of that alone takes it for not done."""
    try:
        yield
    except CliError as error:
        told = [f"sent before, and in effect: {_request(frame)}" for frame in sent]
        if client.is_unanswered and error.exit_code == exit_codes.DEVICE:
            told.append(f"sent without an answer, and perhaps in effect: {_request(frames[len(sent)])}")
        if not told:
            raise
        raise CliError("\n  ".join((error.format_message(), *told)), error.exit_code) from None


def _request(frame: "Frame") -> str:
    return f"FC16 address {frame.address}: {' '.join(f'{word:04X}' for word in frame.words)}"


def _assignment(register_map: "RegisterMap", text: str) -> "Assignment":
    from gateway.cli.master.client import Assignment
    from gateway.cli.master.value_text import parse_value
    from gateway.registers import UnknownRegister

    name, equals, value = text.partition("=")
    if not equals:
        raise click.UsageError(f"{text} is not NAME=VALUE, such as force_setpoint=12")
    try:
        register = register_map.find(name.strip())
        if not register.is_writable:
            raise click.UsageError(f"{name} is read only: {register.text}")
        return Assignment(register, parse_value(register, value))
    except UnknownRegister as error:
        raise click.UsageError(str(error)) from None
    except ValueError as error:
        raise click.UsageError(f"{name}: {error}") from None


def _refuse_doubles(assignments: "list[Assignment]") -> None:
    addresses = [assignment.register.address for assignment in assignments]
    for assignment in assignments:
        if addresses.count(assignment.register.address) > 1:
            raise click.UsageError(f"{assignment.register.name} is given twice")


def _tell(frames: "list[Frame]", assignments: "list[Assignment]", *, dry_run: bool, as_json: bool) -> None:
    if as_json:
        documents = [
            {"address": frame.address, "words": list(frame.words), "kept": list(frame.kept)} for frame in frames
        ]
        click.echo(json.dumps({"sent": not dry_run, "frames": documents}))
        return
    for assignment in assignments:
        click.echo(f"{assignment.register.name} = {_as_shown(assignment)}")
    for frame in frames:
        unchanged = f", {', '.join(frame.kept)} kept as read" if frame.kept else ""
        click.echo(f"{'would send' if dry_run else 'sent'} {_request(frame)}{unchanged}")


def _as_shown(assignment: "Assignment") -> str:
    from gateway.cli.master.client import RegisterReading
    from gateway.cli.master.value_text import format_value

    return format_value(RegisterReading(assignment.register, assignment.register.decode(assignment.data), ()))
