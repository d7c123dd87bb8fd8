"""The form of a rig file. What it says about control is described by gateway.control.settings; this adds the cell around it.

Each field's comment is also its help in editors: gateway.profiles.schema carries it into the JSON schema.
"""

from dataclasses import dataclass, field
from ipaddress import IPv4Network, IPv6Network, ip_address, ip_network
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le, MinLen
from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema

from gateway import defaults
from gateway.control.settings import Defaults, LeadSettings, Limits, ResponseSource, Supervision, Trim
from gateway.defaults import STRICT
from gateway.devices.line_settings import Baud


def _address(text: str) -> str:
    try:
        return "127.0.0.1" if text == "localhost" else str(ip_address(text))
    except ValueError:
        raise ValueError(f'"{text}" is not an IP address such as 127.0.0.1 or 192.168.125.10') from None


def _network(text: Any) -> IPv4Network | IPv6Network:
    if not isinstance(text, str):
        raise ValueError(f"{text} is not a network such as 192.168.125.0/24")
    try:
        return ip_network(text)
    except ValueError:
        raise ValueError(f'"{text}" is not a network such as 192.168.125.0/24{_suggest_network(text)}') from None


def _suggest_network(text: str) -> str:
    """Return the network that the address is in, as a suggestion: host bits set are the usual slip."""
    try:
        return f"; did you mean {ip_network(text, strict=False)}?"
    except ValueError:
        return ""


Address = Annotated[str, AfterValidator(_address)]
Network4Or6 = Annotated[
    IPv4Network | IPv6Network,
    PlainValidator(_network, json_schema_input_type=str),
    WithJsonSchema({"type": "string", "examples": ["192.168.125.0/24"]}),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputFile:
    """The serial line to the DAC or regulator."""

    __pydantic_config__ = STRICT
    device: Annotated[str, MinLen(1)]  # name of a shipped device profile, or the path of one from this file
    port: Annotated[str, MinLen(1)] | None = None  # /dev/serial/by-id/...; absent in a simulated rig
    baud: Baud = defaults.OUTPUT_BAUD  # as set in the device


@dataclass(frozen=True, slots=True, kw_only=True)
class CellFile:
    """The serial line from the load-cell amplifier."""

    __pydantic_config__ = STRICT
    device: Annotated[str, MinLen(1)]  # name of a shipped device profile, or the path of one from this file
    port: Annotated[str, MinLen(1)] | None = None  # /dev/serial/by-id/...; absent in a simulated rig
    baud: Baud = defaults.CELL_BAUD  # as set in the amplifier
    sign: Literal[1, -1] = 1  # -1 where the wiring shows a push as a negative force
    unit: Literal["N", "kg", "g", "lb"] | None = None  # only where the amplifier's own text leaves the unit out
    range_n: Annotated[float, Gt(0), Le(defaults.LARGEST_CELL_N)] = defaults.CELL_RANGE_N  # the cell's rated force, N


@dataclass(frozen=True, slots=True, kw_only=True)
class Network:
    """The Modbus TCP face."""

    __pydantic_config__ = STRICT
    bind: Address = defaults.HOST  # the gateway's own address; any but loopback needs `allow`
    port: Annotated[int, Ge(0), Le(65535)] = defaults.MODBUS_PORT  # 0: any free port; below 1024 needs a privilege
    units: Annotated[tuple[Annotated[int, Ge(0), Le(255)], ...], MinLen(1)] = (
        defaults.UNIT_IDS
    )  # unit ids that are answered
    allow: tuple[Network4Or6, ...] = ()  # networks that may connect, such as 192.168.125.0/24
    owner: Address | None = None  # the one master that may command; null: the first that does
    require_byte_order_echo: bool = False  # the master must prove its word order before it may enable
    allow_plain_upload: bool = False  # coefficients may be uploaded without TLS
    connections: Annotated[int, Ge(1), Le(256)] = defaults.CONNECTIONS  # most connections at a time
    per_address: Annotated[int, Ge(1), Le(256)] = (
        defaults.PER_ADDRESS
    )  # most connections of one address; loopback is exempt
    idle_s: Annotated[float, Gt(0)] = defaults.IDLE_S  # a connection that asks nothing this long is closed
    requests_per_s: Annotated[float, Gt(0)] = (
        defaults.REQUESTS_PER_S
    )  # of a client; above it reading waits; loopback is exempt


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualWatch:
    """The process that compares what is measured with the rig's plant while the gateway works."""

    __pydantic_config__ = STRICT
    enabled: bool | None = None  # null: in a simulated rig only; a real one says true once `plant` is its own
    window_s: Annotated[float, Ge(5), Le(600)] = 60.0  # time that one judgement looks back
    every_s: Annotated[float, Ge(1), Le(600)] = 20.0  # time between looks; longer where a judgement takes longer


@dataclass(frozen=True, slots=True, kw_only=True)
class RigFile:
    """One cell: which devices on which ports, with which map, plant, calibration, limits and loop rate."""

    __pydantic_config__ = STRICT
    name: Annotated[
        str, Field(pattern=r"^[a-z0-9][a-z0-9._-]{0,62}$")
    ]  # lower case; also the name of the state directory
    description: str = ""  # one line for people
    simulated: bool = False  # true: the devices are simulated, with the plant behind them
    seed: Annotated[int, Ge(0), Le(2**63 - 1)] = 0  # of the simulation's noise
    loop_hz: Annotated[float, Ge(50), Le(250)] = (
        defaults.LOOP_HZ
    )  # rate of the control loop's tick; setpoints act on arrival
    registers: Annotated[str, MinLen(1)] = defaults.REGISTER_MAP  # the Modbus map
    plant: Annotated[str, MinLen(1)] | None = None  # what is simulated; in a real rig for `--sim` and residual_watch
    calibration: Annotated[str, MinLen(1)]  # voltage-force model to start with
    compensation: Annotated[str, MinLen(1)] | None = None  # an extended plant, of which control takes back what it can
    output: OutputFile
    load_cell: CellFile
    limits: Limits
    defaults: Defaults = field(default_factory=Defaults)
    trim: Trim = field(default_factory=Trim)
    lead: LeadSettings = field(default_factory=LeadSettings)
    response: ResponseSource = (
        ResponseSource.MEASURED
    )  # measured: trim's pace, lead and lag by the calibration, once it has measured them; rig: by this file
    supervision: Supervision = field(default_factory=Supervision)
    network: Network = field(default_factory=Network)
    residual_watch: ResidualWatch = field(default_factory=ResidualWatch)
    accept_no_device_watchdog: bool = False  # true: enable although the output device has no watchdog of its own
