"""The gateways of this machine: whoever has reached one over Modbus may ask its control socket for what no register has."""

from pathlib import Path
from typing import Any

from gateway.cli import control_socket
from gateway.cli.errors import CliError, NoAnswerError
from gateway.cli.master.wires import TcpWire, Wire
from gateway.plain_file import is_file


def usual_root() -> Path | None:
    """Return where this user's gateways keep their state; None where he has no home, as in a container by a number alone: what
    goes by Modbus needs none."""
    from gateway.service.supervisor.run_options import default_state_root

    try:
        return default_state_root()
    except FileNotFoundError:
        return None


def sockets_near(wire: Wire, root: Path | None) -> list[Path]:
    """Find state directories below root with a control socket, none where the wire leads to another machine, or where another
    user keeps them to himself."""
    try:
        return sorted(path.parent for path in root.glob("*/control.sock")) if root and wire.is_near else []
    except PermissionError:
        return []


def running_behind(wire: Wire, root: Path | None) -> dict[str, Any] | None:
    """Return what the gateway behind this wire says of itself (`running`); None where it is elsewhere, nobody says, or two
    do."""
    directory, _ = find_state_behind(wire, root)
    return _ask_what_runs(directory) if directory else None


def tell_running(wire: Wire) -> str:
    """Return which gateways of this user run on other ports of this machine, for who found none behind this wire."""
    if not isinstance(wire, TcpWire):
        return ""
    running = [_ask_what_runs(directory) for directory in sockets_near(wire, usual_root())]
    told = [f"{one['rig']} on port {one['port']}" for one in running if one.get("rig") and one.get("port")]
    return f"; here run {', '.join(told)}" if len(told) > 1 else f"; here runs {told[0]}" if told else ""


def find_state_behind(wire: Wire, root: Path | None) -> tuple[Path | None, str]:
    """Return the state directory of the gateway behind this wire; where it is not known, why, in words."""
    if not wire.is_near:
        return None, "last writers: only where the gateway runs on this machine"
    found = [directory for directory in sockets_near(wire, root) if wire.is_served_by(_ask_what_runs(directory))]
    if len(found) == 1:
        return found[0], ""
    below = f"below {root}" if root else "(who has no home directory)"
    why = f"no gateway of this user {below} says that it serves {wire.where}" if not found else "two gateways say so"
    return None, f"last writers: {why}; --state DIR names its directory"


def _ask_what_runs(directory: Path) -> dict[str, Any]:
    try:
        return control_socket.ask(directory, {"do": "running"})
    except CliError:  # one that was killed, an older one, another user's
        return {}


def rig_running_on(directory: Path) -> str | None:
    """Return the rig whose gateway runs on this state directory now: the file of one that is not shipped, where that is here,
    else its name; None where nobody says."""
    from gateway.profiles import list_shipped

    said = _ask_what_runs(directory)
    name, file = said.get("rig"), str(said.get("file", ""))
    return file if name not in list_shipped("rig") and is_file(file) else name


def is_there(directory: Path) -> bool:
    """Decide whether a gateway of this user runs on this state directory now. One that stands still does: without it another
    one would be the only one, and a verb that names none would press there."""
    try:
        return bool(control_socket.ask(directory, {"do": "running"}))
    except NoAnswerError:
        return True
    except CliError:
        return False
