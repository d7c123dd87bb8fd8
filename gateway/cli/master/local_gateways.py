"""The gateways of this machine: whoever has reached one over Modbus may ask its control socket for what no register has."""

from ipaddress import ip_address
from pathlib import Path
from typing import Any, Final

from gateway.cli import control_socket
from gateway.cli.errors import CliError

_LOCAL: Final = "localhost"


def sockets_near(host: str, root: Path) -> list[Path]:
    """Find state directories below root with a control socket, none where host is another machine."""
    try:
        is_here = host == _LOCAL or ip_address(host.strip("[]")).is_loopback
    except ValueError:
        is_here = False
    return sorted(path.parent for path in root.glob("*/control.sock")) if is_here else []


def running_at(host: str, port: int, root: Path) -> dict[str, Any] | None:
    """Return what the gateway that serves this port says of itself (`running`); None where it is elsewhere, nobody
    says, or two do."""
    answer = [one for directory in sockets_near(host, root) if (one := _ask_what_runs(directory)).get("port") == port]
    return answer[0] if len(answer) == 1 else None


def _ask_what_runs(directory: Path) -> dict[str, Any]:
    try:
        return control_socket.ask(directory, {"do": "running"})
    except CliError:  # one that was killed, an older one, another user's
        return {}
