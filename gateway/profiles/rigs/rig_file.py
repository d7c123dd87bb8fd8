"""The form of a rig file. What it says about control is described by gateway.control.settings; this adds the cell around it.

Each field's comment is also its help in editors: gateway.profiles.schema carries it into the JSON schema.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, ClassVar, Final, Literal

from annotated_types import Ge, Gt, Le, MinLen
from pydantic import Field

from gateway import defaults
from gateway.control.settings import (
    Defaults,
    LeadSettings,
    Limits,
    ResponseSource,
    SelfTestSettings,
    Supervision,
    Trim,
    ValveControl,
)
from gateway.defaults import STRICT
from gateway.devices.checksum import ChecksumName
from gateway.devices.line_settings import Baud
from gateway.profiles.http_sections import Metrics, OpcUa, Web
from gateway.profiles.recordings_section import RecordingsSection
from gateway.profiles.rigs.addresses import BindAddress, Network4Or6, Owner
from gateway.profiles.rigs.faces import Face
from gateway.profiles.telemetry_sections import Mqtt

_FRAME_OF_A_DEVICE: Final = dict.fromkeys(
    ("data_bits", "parity", "stop_bits"), "under `serial` in the device's profile: copy a shipped one beside the rig"
)
"""What a rig does not say of a device's line, and where it stands."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputFile:
    """The serial line to the DAC or regulator."""

    KEPT_ELSEWHERE: ClassVar[Mapping[str, str]] = _FRAME_OF_A_DEVICE

    __pydantic_config__ = STRICT
    device: Annotated[str, MinLen(1)]  # name of a shipped device profile, or the path of one from this file
    port: Annotated[str, MinLen(1)] | None = None  # /dev/serial/by-id/...; absent in a simulated rig
    baud: Baud | None = None  # as set in the device; null: as its profile says
    address: int | str | None = None  # of the device on its bus, its Modbus unit; null: the profile's
    channel: Annotated[int, Ge(0), Le(15)] | None = None  # of a device with several outputs; null: the profile's
    checksum: ChecksumName | None = None  # as set in a device that can have one; null: the profile's
    watchdog_s: Annotated[float, Gt(0), Le(60)] | None = (
        None  # silence that trips the device's watchdog; null: the profile's
    )
    watchdog_tick_s: Annotated[float, Gt(0), Le(1)] | None = None  # one count of its time, where firmware differs


@dataclass(frozen=True, slots=True, kw_only=True)
class CellFile:
    """The serial line from the load-cell amplifier."""

    KEPT_ELSEWHERE: ClassVar[Mapping[str, str]] = _FRAME_OF_A_DEVICE

    __pydantic_config__ = STRICT
    device: Annotated[str, MinLen(1)]  # name of a shipped device profile, or the path of one from this file
    port: Annotated[str, MinLen(1)] | None = None  # /dev/serial/by-id/...; absent in a simulated rig
    baud: Baud | None = None  # as set in the amplifier; null: as its profile says
    address: int | str | None = None  # of the device on its bus, its Modbus unit; null: the profile's
    checksum: ChecksumName | None = None  # as set in a device that can have one; null: the profile's
    sign: Literal[1, -1] = 1  # -1 where the wiring shows a push as a negative force
    unit: Literal["N", "kg", "g", "lb"] | None = None  # only where the amplifier's own text leaves the unit out
    newton_per_count: Annotated[float, Gt(0)] | None = None  # of raw counts: one count in newtons, as you measured it
    zero_count: float | None = None  # of raw counts: the reading without a force
    range_n: Annotated[float, Gt(0), Le(defaults.LARGEST_CELL_N)] = defaults.CELL_RANGE_N  # the cell's rated force, N


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveFile(ValveControl):
    """The directional valve that control_word bit 4 switches, and the serial line to its relay."""

    KEPT_ELSEWHERE: ClassVar[Mapping[str, str]] = _FRAME_OF_A_DEVICE

    __pydantic_config__ = STRICT
    device: Annotated[
        str, MinLen(1)
    ]  # name of a shipped device profile of role valve, or the path of one from this file
    port: Annotated[str, MinLen(1)] | None = None  # /dev/serial/by-id/...; absent in a simulated rig
    baud: Baud | None = None  # as set in the device; null: as its profile says
    address: int | str | None = None  # of the device on its bus, its Modbus unit; null: the profile's
    calibration: Annotated[str, MinLen(1)] | None = None  # measured pulling; null: that of pushing by pull_area_share

    @property
    def control(self) -> ValveControl:
        """Return what control knows of it."""
        return ValveControl(**{one.name: getattr(self, one.name) for one in fields(ValveControl)})


@dataclass(frozen=True, slots=True, kw_only=True)
class Network:
    """The Modbus TCP face."""

    __pydantic_config__ = STRICT
    bind: BindAddress = defaults.HOST  # the gateway's own address; any but loopback needs `allow`
    port: Annotated[int, Ge(0), Le(65535)] = defaults.MODBUS_PORT  # 0: any free port; below 1024 needs a privilege
    units: Annotated[tuple[Annotated[int, Ge(0), Le(255)], ...], MinLen(1)] = (
        defaults.UNIT_IDS
    )  # unit ids that are answered
    allow: tuple[Network4Or6, ...] = ()  # networks that may connect, such as 192.168.125.0/24
    owner: Owner | None = (
        None  # the one master that may command: address, serial:N (the Nth of `fieldbus`) or certificate NAME; null: the first
    )
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
    plain: bool = True  # false: no plain Modbus TCP, the faces of `fieldbus` only


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
    valve: ValveFile | None = None  # switches push and pull; null: there is none, and bit 4 is refused
    limits: Limits
    defaults: Defaults = field(default_factory=Defaults)
    trim: Trim = field(default_factory=Trim)
    lead: LeadSettings = field(default_factory=LeadSettings)
    response: ResponseSource = (
        ResponseSource.MEASURED
    )  # measured: trim's pace, lead and lag by the calibration, once it has measured them; rig: by this file
    supervision: Supervision = field(default_factory=Supervision)
    self_test: SelfTestSettings | None = (
        None  # what a master's self-test (control_word bit 6) may do; null: there is none
    )
    network: Network = field(default_factory=Network)
    fieldbus: tuple[Face, ...] = ()  # faces beside plain Modbus TCP: serial ports with Modbus RTU, Modbus TCP by TLS
    residual_watch: ResidualWatch = field(default_factory=ResidualWatch)
    recordings: RecordingsSection = field(default_factory=RecordingsSection)
    web: Web | None = None  # the page in the browser; null: there is none, unless `run --web` asks for it
    metrics: Metrics | None = None  # figures for Prometheus; null: there are none, unless `run --metrics` asks for them
    mqtt: Mqtt | None = None  # figures for an MQTT broker; null: none
    opcua: OpcUa | None = None  # an OPC UA server, read only; null: none
    accept_no_device_watchdog: bool = False  # true: enable although the output device has no watchdog of its own
