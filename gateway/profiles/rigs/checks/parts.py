"""The parts of a rig that checks look at, and the form of a check.

Each check is a generator of (path, sentence) and looks at the parts that were read; a part with a fault of its own is None,
and its checks wait until it is fixed. FAULTS keep a rig from starting, WARNINGS do not.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from gateway.bsfm.model import Calibration
from gateway.control.compensation.compensation import Compensation
from gateway.control.settings import Defaults, LeadSettings, Limits, SelfTestSettings, Supervision, Trim
from gateway.devices import DeviceProfile
from gateway.profiles.http_sections import Metrics, OpcUa, Web
from gateway.profiles.kinds.plants import PlantProfile
from gateway.profiles.rigs.faces import Face
from gateway.profiles.rigs.rig_file import CellFile, Network, OutputFile, ValveFile
from gateway.profiles.telemetry_sections import Mqtt
from gateway.registers.map.register_map import RegisterMap

Found = Iterator[tuple[str, str]]
"""(dotted path of the file, sentence)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """A rig file's parts and the profiles that it names, each None when it is absent or has faults."""

    name: str
    simulated: bool
    names_plant: bool
    accept_no_device_watchdog: bool
    loop_hz: float | None = None
    output: OutputFile | None = None
    load_cell: CellFile | None = None
    limits: Limits | None = None
    defaults: Defaults | None = None
    trim: Trim | None = None
    lead: LeadSettings | None = None
    measures_response: bool = True
    supervision: Supervision | None = None
    self_test: SelfTestSettings | None = None
    valve: ValveFile | None = None
    valve_device: DeviceProfile | None = None
    valve_calibration: Calibration | None = None
    network: Network | None = None
    fieldbus: tuple[Face | None, ...] = ()
    output_device: DeviceProfile | None = None
    cell_device: DeviceProfile | None = None
    plant: PlantProfile | None = None
    calibration: Calibration | None = None
    extended: PlantProfile | None = None
    compensation: Compensation | None = None
    web: Web | None = None
    metrics: Metrics | None = None
    opcua: OpcUa | None = None
    mqtt: Mqtt | None = None
    register_map: RegisterMap | None = None


Check = Callable[[Parts], Found]
