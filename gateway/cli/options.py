"""Options that several verbs share: where the gateway is, where its state is, JSON."""

from collections.abc import Callable, Sized
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, Final, TypeVar

import click

from gateway import defaults

Function = TypeVar("Function", bound=Callable[..., Any])
Endpoint = tuple[str, int]
_LONGEST_NAME: Final = 60
DEFAULT_ENDPOINT: Final = f"{defaults.HOST}:{defaults.MODBUS_PORT}"


def endpoint(context: click.Context, parameter: click.Parameter, value: str | None) -> Endpoint | None:
    """Return HOST:PORT, HOST, :PORT or [IPV6]:PORT as (host, port), for an option's callback."""
    if value is None:
        return None
    host, port = _split(value)
    port = port or str(defaults.MODBUS_PORT)
    if not port.isdecimal() or int(port) > 65535:
        raise click.BadParameter(f"{value} is not HOST:PORT such as {DEFAULT_ENDPOINT} (port 0..65535)")
    return host or defaults.HOST, int(port)


def _split(text: str) -> tuple[str, str]:
    """Return host and port, either may be empty; brackets hold an IPv6 address, and one without brackets has no port."""
    if text.startswith("["):
        host, _, rest = text[1:].partition("]")
        return host, rest.removeprefix(":")
    if text.count(":") > 1:
        return text, ""
    host, _, port = text.partition(":")
    return host, port


def gateway_options(function: Function) -> Function:
    """Add --gateway, --unit and --map: which server to speak to, and by which names."""
    for option in (
        click.option(
            "--map", "map_name", default=defaults.REGISTER_MAP, metavar="NAME", help="Register map (name or file)."
        ),
        click.option(
            "--unit", type=click.IntRange(0, 255), default=defaults.UNIT_ID, show_default=True, help="Modbus unit id."
        ),
        click.option(
            "--gateway",
            "endpoint",
            callback=endpoint,
            metavar="HOST:PORT",
            default=DEFAULT_ENDPOINT,
            show_default=True,
            help="Where the gateway's Modbus TCP is.",
        ),
    ):
        function = option(function)
    return function


@dataclass(frozen=True, slots=True)
class StateChoice:
    """--state and --rig as given: which state directory is meant. path None: the rig's own."""

    path: Path | None
    rig: str

    @property
    def directory(self) -> Path:
        """The directory that `run` would use."""
        return state_directory(self.path, self.rig)


def state_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add --state and --rig; the function receives both as one argument, `state`, a StateChoice."""

    @wraps(function)
    def with_choice(*, state: Path | None, rig: str, **options: Any) -> Any:
        return function(state=StateChoice(state, rig), **options)

    for option in (
        click.option(
            "--rig", default=defaults.RIG, show_default=True, help="The rig whose default state directory is meant."
        ),
        click.option(
            "--state", type=click.Path(path_type=Path, file_okay=False), help="State directory of the gateway."
        ),
    ):
        option(with_choice)
    return with_choice


def calibration_name(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Return a name that stands on one line and is no number, for an option's callback."""
    if value is None:
        return None
    name = " ".join(value.split())
    if not name or not name.isprintable() or name.isdecimal() or len(name) > _LONGEST_NAME:
        raise click.BadParameter(f"{value!r} is no name: 1 to {_LONGEST_NAME} printable characters, not a number alone")
    return name


def name_option(function: Function) -> Function:
    """Add --name: what the user calls the calibration."""
    return click.option("--name", callback=calibration_name, help="What the calibration is called.")(function)


def json_option(function: Function) -> Function:
    """Add --json; the function receives it as `as_json`."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON.")(function)


def count_of(things: Sized, noun: str) -> str:
    """Return `1 file`, `3 files`."""
    return f"{len(things)} {noun}{'' if len(things) == 1 else 's'}"


def state_directory(state: Path | None, rig: str) -> Path:
    """Return the directory that `run` would use."""
    from gateway.service.supervisor.run_options import RunOptions

    return RunOptions(rig=rig, state=state).state_directory
