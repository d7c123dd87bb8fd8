"""`ports`: which serial ports this machine has, by the names that survive a replug."""

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Final

import click

from gateway.cli.options import json_option

if TYPE_CHECKING:
    from gateway.ports import PortInfo

_SLOW_LATENCY_MS: Final = 16  # what FTDI adapters start with: at 9600 baud it costs half of the cycle


@click.command()
@json_option
def command(*, as_json: bool) -> None:
    """List serial ports, by id as rig files want them."""
    from gateway.ports import list_ports

    ports = list_ports()
    if as_json:
        click.echo(json.dumps([{"path": port.path} | asdict(port) for port in ports], indent=2))
        return
    if not ports:
        click.echo("no serial port of a device found; plug the adapter in (dmesg | tail shows whether it is seen)")
    for port in ports:
        click.echo(port.path)
        click.echo(f"  {_line(port)}")


def _line(port: "PortInfo") -> str:
    facts = [port.device if port.by_id else "no by-id name: another adapter may get this name after a replug"]
    facts += [port.description] if port.description else []
    facts += [f"driver {port.driver}"] if port.driver else []
    if port.latency_ms is not None:
        slow = " (slow: the gateway sets 1 ms where it may)" if port.latency_ms >= _SLOW_LATENCY_MS else ""
        facts.append(f"latency timer {port.latency_ms} ms{slow}")
    facts += [f"in use by {port.holder}"] if port.holder else []
    return ", ".join(facts)
