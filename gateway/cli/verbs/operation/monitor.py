"""`monitor`: what the gateway does, live in a terminal, by Modbus; or one frame as text or picture."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.numbers import Quantity
from gateway.cli.errors import CliError
from gateway.cli.options import gateway_options, state_option
from gateway.cli.terminal import can_write_over
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.cli.live_monitor.poll import Poller
    from gateway.cli.master.wires import Wire

_PICTURE_SIZE: Final = (112, 34)
_TEXT_SIZE: Final = (80, 24)


EXAMPLES = ("monitor", "monitor --svg monitor.svg --seconds 1")


@click.command()
@click.option("--once", is_flag=True, help="Print one frame and end.")
@click.option("--svg", type=GivenPath(dir_okay=False), help="Write one frame to FILE as a picture.")
@click.option("--seconds", type=Quantity(0.0), help="End after this time; with --once or --svg, watch first.")
@state_option("State directory, for last writers, where it is not the usual one.")
@gateway_options
def command(*, svg: Path | None, seconds: float | None, wire: "Wire", **options: Any) -> None:
    """Show a gateway live: state, force, alarms.

    q or Ctrl-C ends. Works against any gateway that speaks the register map, at 60x24 and larger. Who wrote each register
    last is shown where the gateway runs on this machine.
    """
    import sys

    from gateway.cli.live_monitor.poll import Poller, WriterSource
    from gateway.cli.master.client import GatewayClient
    from gateway.cli.master.refusal_text import explain_refusals
    from gateway.profiles import load_register_map

    register_map = load_register_map(options["map_name"])
    with GatewayClient(wire, options["unit"], register_map) as client:
        poller = Poller(client, WriterSource(lambda: _find_state(wire, options["state"])), time.monotonic)
        with explain_refusals(client):
            poller.poll()  # the first one fails loudly: a wrong address is no reason to wait
        if svg or options["once"] or not can_write_over(sys.stdout):
            _watch(poller, seconds or 0.0)
            _picture(poller, svg) if svg else _text(poller)
            if poller.trouble:  # it stands in the frame, too; who asks for one frame may look at the exit code alone
                raise CliError(poller.trouble, exit_codes.DEVICE)
        else:
            _live(poller, seconds)


def _find_state(wire: "Wire", given: Path | None) -> tuple[Path | None, str]:
    """Return the gateway's state directory; without one, why."""
    from gateway.cli.master.local_gateways import find_state_behind, usual_root

    return (given, "") if given else find_state_behind(wire, usual_root())


def _watch(poller: "Poller", seconds: float) -> None:
    from gateway.cli.live_monitor.poll import POLL_S

    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        time.sleep(POLL_S)
        poller.poll_or_note()


def _live(poller: "Poller", seconds: float | None) -> None:
    from rich.console import Console

    from gateway.cli.live_monitor.keyboard import is_quit_pressed, take_single_keys
    from gateway.cli.live_monitor.page import page
    from gateway.cli.live_monitor.poll import POLL_S
    from gateway.cli.live_monitor.screen import Screen

    console = Console()
    screen = Screen(console)
    end_s = time.monotonic() + seconds if seconds else float("inf")
    try:
        with take_single_keys() as has_keys, screen.open():
            hint = "q quits" if has_keys else "Ctrl-C quits"
            while time.monotonic() < end_s:
                size = (console.width, console.height)
                screen.show(page(poller.view(*size, hint)), size)
                if is_quit_pressed(POLL_S, has_keys=has_keys):
                    return
                poller.poll_or_note()
    except KeyboardInterrupt:
        pass


def _text(poller: "Poller") -> None:
    import sys

    from rich.console import Console
    from rich.text import Text

    from gateway.cli.live_monitor.page import page

    console = Console()
    size = console.size if sys.stdout.isatty() else _TEXT_SIZE
    Console(width=size[0]).print(Text("\n").join(page(poller.view(*size))))


def _picture(poller: "Poller", svg: Path) -> None:
    from gateway.cli.diagnosis.outputs import write_all
    from gateway.cli.live_monitor.svg_picture import svg_picture

    write_all({svg: svg_picture(poller.view(*_PICTURE_SIZE))})
    click.echo(f"wrote {svg}", err=True)
