"""Options that several verbs share: where the gateway is, where its state is, JSON."""

from collections.abc import Callable, Sized
from dataclasses import dataclass
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar, cast, get_args

import click

from gateway import defaults
from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.numbers import Whole
from gateway.plain_file import exists

if TYPE_CHECKING:
    from gateway.cli.master.wires import Wire

Function = TypeVar("Function", bound=Callable[..., Any])
Endpoint = tuple[str, int]
_LINE_OPTIONS: Final = ("baud", "parity", "stop_bits")
_TLS_OPTIONS: Final = ("tls", "cert", "key")
_FILE: Final = GivenPath(dir_okay=False)
_PARITIES: Final = ("none", "even", "odd")  # gateway.devices.line_settings.Parity, without its imports
DEFAULT_ENDPOINT: Final = f"{defaults.HOST}:{defaults.MODBUS_PORT}"


def endpoint(context: click.Context, parameter: click.Parameter, value: str | None) -> Endpoint | None:
    """Return HOST:PORT, HOST, :PORT or [IPV6]:PORT as (host, port), for an option's callback."""
    if value is None:
        return None
    host, port = _split(value)
    port = port or str(defaults.MODBUS_PORT)
    if not port.isdecimal() or int(port) > 65535 or "/" in host:
        raise click.BadParameter(f"{value} is not HOST:PORT such as {DEFAULT_ENDPOINT} (port 0..65535)")
    return host or defaults.HOST, int(port)


def bind_endpoint(context: click.Context, parameter: click.Parameter, value: str | None) -> Endpoint | None:
    """Return what `endpoint` does, of an address to listen on: a number, for a name may lead elsewhere tomorrow."""
    found = endpoint(context, parameter, value)
    return found and (_own_address(found[0]), found[1])


def _own_address(host: str) -> str:
    from ipaddress import ip_address

    try:
        return defaults.HOST if host == "localhost" else str(ip_address(host))
    except ValueError:
        sentence = f"{host} is no IP address of this machine such as {defaults.HOST} or 192.168.125.10"
        raise click.BadParameter(f"{sentence}; it is HOST:PORT, PORT alone is :PORT") from None


def http_endpoint(context: click.Context, parameter: click.Parameter, value: str | None) -> Endpoint | None:
    """Return HOST:PORT, :PORT or PORT as (host, port); an empty host for an option that stands alone."""
    if value is None:
        return None
    if not value:
        return "", 0
    host, port = ("", value) if value.isdecimal() else _split(value)
    if not port.isdecimal() or int(port) > 65535:
        hint = f"; RIG goes before --{parameter.name}" if context.info_name == "run" and not port else ""
        raise click.BadParameter(f"{value} is not HOST:PORT such as {defaults.HOST}:{defaults.WEB_PORT}{hint}")
    return _own_address(host or defaults.HOST), int(port)


def _split(text: str) -> tuple[str, str]:
    """Return host and port, either may be empty; brackets hold an IPv6 address, and one without brackets has no port."""
    if text.startswith("["):
        host, _, rest = text[1:].partition("]")
        return host, rest.removeprefix(":")
    if text.count(":") > 1:
        return text, ""
    host, _, port = text.partition(":")
    return host, port


def serial_port(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Return the path of a serial port, for an option's callback; empty where the option may stand alone."""
    if value and not value.startswith("/"):
        hint = "; RIG goes before --rtu" if context.info_name == "run" else ""
        raise click.BadParameter(f"{value} is not the path of a port such as /dev/serial/by-id/...{hint}")
    return value


_WIRE_OPTIONS: Final = (
    click.option("--unit", type=Whole(0, 255), default=defaults.UNIT_ID, show_default=True, help="Modbus unit id."),
    click.option("--stop-bits", type=click.Choice(["1", "2"]), help="Of the serial line  [default: 1]"),
    click.option(
        "--parity", type=click.Choice(_PARITIES), help=f"Of the serial line  [default: {defaults.RTU_PARITY}]"
    ),
    click.option("--baud", type=Whole(0), help=f"Of the serial line  [default: {defaults.RTU_BAUD}]"),
    click.option("--key", type=_FILE, help="Of the client's certificate, PEM."),
    click.option("--cert", type=_FILE, help="The client's certificate, PEM."),
    click.option("--tls", type=_FILE, metavar="CA", help="By TLS: the CA of the gateway's certificate, PEM."),
    click.option("--rtu", callback=serial_port, metavar="PORT", help="Modbus RTU on this serial port instead."),
)


def _gateway_option(default: str | None, gateway_help: str) -> Callable[[Any], Any]:
    return click.option(
        "--gateway",
        "endpoint",
        callback=endpoint,
        metavar="HOST:PORT",
        default=default,
        show_default=default is not None,
        help=gateway_help,
    )


def gateway_options(function: Function) -> Function:
    """Add --gateway, --rtu and what belongs to it, --unit and --map: which server to speak to, how, and by which names."""
    return map_option(wire_options(DEFAULT_ENDPOINT, "Where the gateway's Modbus TCP is.")(function))


def map_option(function: Function) -> Function:
    """Add --map; the function receives `map_name`."""
    from gateway.cli.command_line.completion_words import complete_maps

    option = click.option(
        "--map",
        "map_name",
        default=defaults.REGISTER_MAP,
        metavar="NAME",
        shell_complete=complete_maps,
        help="Register map (name or file).",
    )
    return option(function)


def wire_options(default: str | None, gateway_help: str) -> Callable[[Function], Function]:
    """Add --gateway, --rtu and its line, --tls and its files, --unit; the function receives `wire` and `unit`. default: of
    --gateway; None: without any of them `wire` is None."""
    options = (*_WIRE_OPTIONS, _gateway_option(default, gateway_help))

    def add(function: Function) -> Function:
        @wraps(function)
        def with_wire(*, endpoint: Endpoint | None, rtu: str | None, unit: int, **others: Any) -> Any:
            line = {name: others.pop(name) for name in _LINE_OPTIONS}
            files = {name: others.pop(name) for name in _TLS_OPTIONS}
            if any(files.values()):
                wire: Wire | None = _tls_wire(endpoint, files, {"rtu": rtu, **line})
            else:
                wire = _wire(endpoint, rtu, unit, line)
            return function(wire=wire, unit=unit, **others)

        for option in options:
            option(with_wire)
        return cast("Function", with_wire)

    return add


def _wire(endpoint: Endpoint | None, rtu: str | None, unit: int, line: dict[str, Any]) -> "Wire | None":
    """Return what the options lead to. UsageError where they do not fit together."""
    from gateway.cli.master.wires import TcpWire

    if rtu is None:
        if given := [name for name, value in line.items() if value is not None]:
            raise click.UsageError(f"--{given[0].replace('_', '-')} is of a serial line: give --rtu PORT too")
        return TcpWire(*endpoint) if endpoint else None
    if click.get_current_context().get_parameter_source("endpoint") is click.core.ParameterSource.COMMANDLINE:
        raise click.UsageError("--gateway and --rtu are two ways to one gateway: give one of them")
    return _rtu_wire(rtu, unit, line)


def _tls_wire(endpoint: Endpoint | None, files: dict[str, Any], serial: dict[str, Any]) -> "Wire":
    """Return Modbus/TCP Security; its port is 802 unless --gateway says another."""
    from gateway.cli.master.tls_wire import TlsFiles, TlsWire

    if missing := [name for name in _TLS_OPTIONS if files[name] is None]:
        raise click.UsageError(f"--{missing[0]} is missing: TLS needs --tls CA, --cert FILE and --key FILE together")
    if given := [name for name, value in serial.items() if value is not None]:
        raise click.UsageError(
            f"--{given[0].replace('_', '-')} is of a serial line, --tls of a network: give one of them"
        )
    is_given = click.get_current_context().get_parameter_source("endpoint") is click.core.ParameterSource.COMMANDLINE
    host, port = endpoint if endpoint and is_given else (defaults.HOST, defaults.TLS_PORT)
    return TlsWire(host, port, TlsFiles(files["tls"], files["cert"], files["key"]))


def _rtu_wire(path: str, unit: int, line: dict[str, Any]) -> "Wire":
    from gateway.cli.master.wires import RtuWire
    from gateway.devices.line_settings import Baud, Parity, SerialSettings
    from gateway.modbus.rtu import LARGEST_UNIT

    if not 1 <= unit <= LARGEST_UNIT:
        why = "0 is the broadcast, which nobody answers" if unit == 0 else f"{unit} is reserved"
        raise click.UsageError(f"--unit: a server on a serial line has 1 to {LARGEST_UNIT}; {why}")
    baud, bauds = defaults.RTU_BAUD if line["baud"] is None else line["baud"], get_args(Baud)
    if baud not in bauds:
        near = min(bauds, key=lambda one: abs(one - baud))
        raise click.UsageError(f"--baud: {baud} is no speed of serial lines; did you mean {near}?")
    parity = cast("Parity", line["parity"] or defaults.RTU_PARITY)
    stop_bits: Literal[1, 2] = 2 if line["stop_bits"] == "2" else 1
    return RtuWire(path, SerialSettings(baud=cast("Baud", baud), parity=parity, stop_bits=stop_bits))


@dataclass(frozen=True, slots=True)
class StateChoice:
    """Which state directory is meant. path: as --state says, None: the rig's own; named: the rig of --rig, or the one that
    runs; None where --state stands alone."""

    path: Path | None
    named: str | None

    @property
    def rig(self) -> str:
        """The rig that is meant: whose directory it is, where none was named. Asked for only by who needs its files."""
        from gateway.cli.command_line.known_rigs import choose_rig, file_of

        return file_of(self.named, self.directory) if self.named else choose_rig(None, self.path)

    @property
    def directory(self) -> Path:
        """The directory that `run` would use."""
        return state_directory(self.path, self.named)


def check_state(state: Path | None) -> None:
    """Check that the directory of --state is there: E106 where it is not."""
    if state is not None and not exists(state):
        from gateway.cli.errors import no_state_directory

        raise no_state_directory(state)


def _checked_state(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
    check_state(value)
    return value


def state_option(text: str, *, makes: bool = False) -> Callable[[Function], Function]:
    """Return --state with this help. One that cannot be read is told by E105, which ends with 77. One that is not there is a
    slip (E106): it has nothing to tell, and must not come to be by a typing error. makes: it need not be there yet."""
    callback = None if makes else _checked_state
    return click.option("--state", type=GivenPath(file_okay=False), callback=callback, help=text)


def state_options(function: Callable[..., Any] | None = None, *, makes: bool = False) -> Callable[..., Any]:
    """Add --state and --rig; the function receives both as one argument, `state`, a StateChoice. makes: see `state_option`."""
    if function is None:
        return partial(state_options, makes=makes)
    from gateway.cli.command_line.known_rigs import choose_rig
    from gateway.cli.command_line.rig_choice import rig_option, tell_rig

    @wraps(function)
    def with_choice(*, state: Path | None, rig: str | None, **options: Any) -> Any:
        choice = StateChoice(state, rig if state else choose_rig(rig, None))
        if rig is None and state is None:
            tell_rig(choice.rig, choice.directory)
        return function(state=choice, **options)

    for option in (
        rig_option(f"The rig that is meant  [default: the one that runs here, else {defaults.RIG}]", checks=False),
        state_option("State directory of the gateway  [default: the rig's]", makes=makes),
    ):
        option(with_choice)
    return with_choice


def label_name(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Return a name that stands on one line and is no number, for an option's callback."""
    if value is None:
        return None
    from gateway.recording.label import check_name

    try:
        return check_name(value)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


def name_option(function: Function) -> Function:
    """Add --name: what the user calls the calibration."""
    return click.option("--name", callback=label_name, help="What the calibration is called.")(function)


def json_option(function: Function) -> Function:
    """Add --json; the function receives it as `as_json`."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON.")(function)


def count_of(things: Sized, noun: str) -> str:
    """Return `1 file`, `3 files`."""
    return f"{len(things)} {noun}{'' if len(things) == 1 else 's'}"


def state_directory(state: Path | None, rig: str | None) -> Path:
    """Return the directory that `run` would use. rig None: the one that runs here, else demo."""
    from gateway.cli.command_line.known_rigs import directory_of

    return directory_of(state, rig)
