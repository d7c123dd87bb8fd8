"""`run`: the gateway itself. Hands over to the guardian, which is why nothing else may be imported here."""

from typing import Any

import click

from gateway import defaults
from gateway.cli.command_line.completion_words import complete_rigs
from gateway.cli.options import bind_endpoint, http_endpoint, serial_port, state_option

EXAMPLES = ("run demo --sim", "run irc5-cell --sim --bind 127.0.0.1:0 --record")


@click.command()
@click.argument("rig", default=defaults.RIG, shell_complete=complete_rigs)
@click.option("--sim", "simulate", is_flag=True, help="Simulate the rig's devices, whatever its file says.")
@click.option(
    "--bind",
    callback=bind_endpoint,
    metavar="HOST:PORT",
    help="Listen here instead of where the rig says; port 0: any free one.",
)
@click.option(
    "--rtu",
    is_flag=False,
    flag_value="",
    callback=serial_port,
    metavar="[PORT]",
    help="Serve Modbus RTU too, 19200 8E1, unit 1: on PORT, without it on a pseudo-terminal.",
)
@click.option(
    "--web",
    is_flag=False,
    flag_value="",
    callback=http_endpoint,
    metavar="[HOST:PORT]",
    help=f"Serve the page here; without HOST:PORT on {defaults.HOST}:{defaults.WEB_PORT}, or a free port where that is taken.",
)
@click.option(
    "--metrics",
    callback=http_endpoint,
    metavar="HOST:PORT",
    help="Serve figures for Prometheus here; port 0: any free one.",
)
@state_option("State directory (default: $XDG_STATE_HOME/force-gateway/RIG).", makes=True)
@click.option("--record", is_flag=True, help="Record from the start.")
@click.option("--realtime", is_flag=True, help="SCHED_FIFO and locked memory for the control process.")
@click.option("--json", is_flag=True, help="At READY, print one JSON line: ports, ptys and process ids.")
@click.pass_context
def command(context: click.Context, /, **options: Any) -> None:
    """Run the gateway on RIG (default: demo).

    RIG is a shipped name or a file. Ctrl-C ramps the force to 0 and stops; a second Ctrl-C skips the ramp.
    """
    from gateway.service.supervisor.guardian import run
    from gateway.service.supervisor.run_options import RunOptions

    context.exit(run(RunOptions(**options)))  # the options are the dataclass's fields, by name
