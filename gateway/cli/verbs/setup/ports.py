"""`ports`: which serial ports this machine has, by the names that survive a replug; --listen: what comes through them."""

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.numbers import Quantity
from gateway.cli.errors import CliError
from gateway.cli.options import json_option
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.ports import PortInfo

EXAMPLES = ("ports", "ports --json")


@click.command()
@click.argument("paths", metavar="[PORT]...", nargs=-1)
@click.option("--listen", is_flag=True, help="Listen at each port, without sending a byte: what comes, at which speed.")
@click.option(
    "--seconds", type=Quantity(0.1, 60.0), default=0.5, show_default=True, help="Listen so long at each speed."
)
@json_option
@click.pass_context
def command(context: click.Context, *, paths: tuple[str, ...], listen: bool, seconds: float, as_json: bool) -> None:
    """List serial ports, by id as rig files want them.

    With --listen: what each device says by itself (or only those at the PORTs named), at 1200 to 115200 baud, and which
    shipped profile reads it. Nothing is sent. A device that waits to be asked stays silent: `check RIG --probe` asks.
    """
    from gateway.ports import list_ports

    if listen or paths:
        failed = _listen(paths or tuple(port.path for port in list_ports()), seconds, as_json=as_json)
        context.exit(failed if paths else exit_codes.OK)  # of all that there are, some may be in use
    ports = list_ports()
    if as_json:
        click.echo(json.dumps([{"path": port.path} | asdict(port) for port in ports], indent=2))
        return
    if not ports:
        click.echo("no serial port of a device found; plug the adapter in (dmesg | tail shows whether it is seen)")
    for port in ports:
        click.echo(port.path)
        click.echo(f"  {_line(port)}")


def _listen(paths: tuple[str, ...], seconds: float, *, as_json: bool) -> int:
    """Return the exit code: of the first port that did not open."""
    from gateway.cli.setup import port_probing as probing

    found, failed = list[dict[str, Any]](), exit_codes.OK
    for path in paths:
        if not as_json:
            click.echo(path)
        try:
            heard = probing.listen_at(path, seconds)
        except CliError as error:
            failed = failed or error.exit_code
            if as_json:
                found.append({"port": path, "error": error.message})
                continue
            click.echo(f"  {error.message}")
            continue
        found.append(heard.fields)
        for line in () if as_json else heard.lines:
            click.echo(f"  {line}")
    if as_json:
        click.echo(json.dumps(found, indent=2))
    elif not paths:
        click.echo("no serial port of a device found; name one: force-gateway ports --listen /dev/ttyUSB0")
    return failed


def _line(port: "PortInfo") -> str:
    from gateway.ports.latency import SLOW_MS

    facts = [port.device if port.by_id else "no by-id name: another adapter may get this name after a replug"]
    facts += [port.description] if port.description else []
    facts += [f"driver {port.driver}"] if port.driver else []
    if port.latency_ms is not None:
        slow = " (slow: the gateway sets 1 ms where it may)" if port.latency_ms >= SLOW_MS else ""
        facts.append(f"latency timer {port.latency_ms} ms{slow}")
    facts += [f"in use by {port.holder}"] if port.holder else []
    return ", ".join(facts)
