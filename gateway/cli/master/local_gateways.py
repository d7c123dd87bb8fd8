"""The gateways of this machine: whoever has reached one over Modbus may ask its control socket for what no register has."""

from pathlib import Path
from typing import Any

from gateway.cli import control_socket
from gateway.cli.errors import CliError
from gateway.cli.master.wires import Wire


def sockets_near(wire: Wire, root: Path) -> list[Path]:
    """Find state directories below root with a control socket, none where the wire leads to another machine."""
    return sorted(path.parent for path in root.glob("*/control.sock")) if wire.is_near else []


def running_behind(wire: Wire, root: Path) -> dict[str, Any] | None:
    """Return what the gateway behind this wire says of itself (`running`); None where it is elsewhere, nobody says, or two
    do."""
    answer = [one for directory in sockets_near(wire, root) if wire.is_served_by(one := _ask_what_runs(directory))]
    return answer[0] if len(answer) == 1 else None


def _ask_what_runs(directory: Path) -> dict[str, Any]:
    try:
        return control_socket.ask(directory, {"do": "running"})
    except CliError:  # one that was killed, an older one, another user's
        return {}
