"""A rig, read and checked: everything that the service needs to wire one cell, frozen."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from ipaddress import ip_address
from math import floor, inf
from pathlib import Path
from shlex import quote
from typing import Any, Final, Self

from gateway import defaults
from gateway.bsfm.model import Bsfm, Calibration, Response
from gateway.control.compensation.cell_map import COMPENSATED_CELL_TERMS
from gateway.control.compensation.command_map import apply_command_map
from gateway.control.compensation.compensation import NO_COMPENSATION, Compensation
from gateway.control.inputs import CalibrationInUse
from gateway.control.settings import ControlSettings
from gateway.devices import DeviceProfile, SerialSettings
from gateway.extras import is_installed, missing_note
from gateway.profiles.find import display, shipped_file
from gateway.profiles.http_sections import Metrics, OpcUa, Web
from gateway.profiles.kinds.plants import PlantProfile
from gateway.profiles.recordings_section import Retention
from gateway.profiles.rigs.compensated_effects import in_simulation
from gateway.profiles.rigs.faces import Face, RtuFace
from gateway.profiles.rigs.rig_file import Network, ResidualWatch
from gateway.profiles.telemetry_sections import Mqtt
from gateway.registers.map.register_map import RegisterMap
from gateway.registers.words import ControlBit
from gateway.twin import Plant
from gateway.twin.plant import with_value

ALWAYS_SUPPORTED: Final = (
    ControlBit.ENABLE
    | ControlBit.RESET_FAULT
    | ControlBit.TARE
    | ControlBit.TAKE_OWNERSHIP
    | ControlBit.START_CALIBRATION
)
"""Control bits that act on every rig; a self-test and a valve act where the rig file has them, else they are refused."""

_FORCE_TO_TRY_N: Final = 12.0


def rehearsed(rig: str) -> str:
    """Return the name that a real rig has in a calibration which was measured while its devices were simulated."""
    return f"{rig} (simulated)"


def is_own(calibration: Calibration, rig: str, simulated_plant: PlantProfile | None) -> bool:
    """Decide whether the calibration was measured on this very rig, or on the twin of the plant that it simulates."""
    if simulated_plant is None:
        return calibration.rig == rig
    return calibration.rig in (rig, rehearsed(rig), f"twin of plant {simulated_plant.name}")


def map_option(register_map: RegisterMap) -> str:
    """Return the option that names this map to our own verbs; empty for the one that they take without it. No disk is asked: a
    process that is started again while another version is being installed tells it as well."""
    file, shipped = register_map.file, display(shipped_file("registers", defaults.REGISTER_MAP))
    return "" if file in ("", shipped) else f" --map {quote(file)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class _SerialLine:
    """The wire to one device; port None in a simulated rig."""

    device: DeviceProfile
    port: str | None
    baud: int

    @classmethod
    def of(cls, device: DeviceProfile, port: str | None, baud: int | None, **more: Any) -> Self:
        """Return the line at the baud of the rig's file; where that says none, as the device's profile says."""
        return cls(device=device, port=port, baud=device.serial.at(baud).baud, **more)

    @property
    def settings(self) -> SerialSettings:
        """The device's serial settings at the rig's baud."""
        return self.device.serial.at(self.baud)


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputLine(_SerialLine):
    """The wire to the DAC or regulator."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CellLine(_SerialLine):
    """The wire from the load-cell amplifier; sign and unit are the rig's, range_n is the cell's rated force."""

    sign: int
    unit: str | None
    range_n: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveLine(_SerialLine):
    """The wire to the relay of the directional valve."""


@dataclass(frozen=True, slots=True)
class PlantInUse:
    """A numbered plant that was taken into use on a rig: what control compensates comes from it. doubts: why it may be in no
    machine, empty for nothing."""

    number: int
    profile: PlantProfile
    doubts: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rig:
    """One cell. texts: every file it was read from, as it was; fingerprint: their SHA-256; notes: what was decided because
    the file leaves it open."""

    name: str
    description: str
    file: Path
    simulated: bool
    seed: int
    loop_hz: float
    register_map: RegisterMap
    output: OutputLine
    load_cell: CellLine
    plant_profile: PlantProfile | None
    fallback_plant: PlantProfile | None  # what `run --sim` simulates where the rig names no plant
    calibration: Calibration
    control: ControlSettings
    network: Network
    fieldbus: tuple[Face, ...]
    residual_watch: ResidualWatch
    supported_bits: ControlBit
    accept_no_device_watchdog: bool
    texts: Mapping[str, str]
    fingerprint: str
    notes: tuple[str, ...] = ()
    web: Web | None = None
    retention: Retention = field(default_factory=Retention)
    metrics: Metrics | None = None
    mqtt: Mqtt | None = None
    opcua: OpcUa | None = None
    valve: ValveLine | None = None
    pull_calibration: Calibration | None = None  # measured pulling, None: derived from the one of pushing
    compensation: Compensation = NO_COMPENSATION
    plant_in_use: PlantInUse | None = None

    @property
    def plant(self) -> Plant | None:
        """The simulated plant; None for a real rig that names no plant."""
        return self.plant_profile.plant if self.plant_profile else None

    @property
    def reference_plant(self) -> Plant | None:
        """The plant that a run of this rig is compared with: the one in use, with the cell as straight as control makes its
        readings, else the rig's own; None where neither is known."""
        if self.plant_in_use is None:
            return self.plant
        plant, cell = self.plant_in_use.profile.plant, self.compensation.cell
        for name in COMPENSATED_CELL_TERMS if cell else ():
            if getattr(cell, name):
                plant = with_value(plant, "cell", name, 0.0)
        return plant

    @property
    def is_watched(self) -> bool:
        """Decide whether a residual watch is wanted: the rig names a plant, and is simulated or enables the watch."""
        enabled = self.residual_watch.enabled
        return self.reference_plant is not None and (self.simulated if enabled is None else enabled)

    @property
    def why_unwatched(self) -> str:
        """Tell why the residual watch that the rig wants is off: its libraries are not installed, or its window is longer than
        what is kept of readings that come so often. Empty where it runs."""
        if not self.is_watched:
            return ""
        return self._why_never_full() if is_installed("numba") else missing_note("numba", "the residual watch")

    def _why_never_full(self) -> str:
        rate_hz, window_s = self.load_cell.device.reading.rate_hz, self.residual_watch.window_s
        kept_s = defaults.RING_ROWS / rate_hz if rate_hz else inf
        if kept_s >= defaults.WATCHED_SHARE * window_s + defaults.WATCH_SETTLED_S:
            return ""
        most_s = floor((kept_s - defaults.WATCH_SETTLED_S) / defaults.WATCHED_SHARE)
        kept = f"of {rate_hz:g} readings/s those of {kept_s:.0f} s are kept"
        return f"the residual watch is off: {kept}, residual_watch.window_s = {window_s:g} s: at most {most_s} s"

    @property
    def lacks_device_watchdog(self) -> bool:
        """Decide whether a real output device would hold its last voltage when nobody talks to it any more."""
        return not self.simulated and self.output.device.watchdog == "none"

    @property
    def map_option(self) -> str:
        """Return what `hold`, `write` and `read` need beside the address where the rig has a map of its own: by the numbers of
        another one 12 N may be 120."""
        return map_option(self.register_map)

    @property
    def force_to_try_n(self) -> float | None:
        """12 N, or a force in the middle of what the rig may press with, to whole newtons where that can be. None where its
        limits and those of the calibration share no force: one from `calibration use` or an upload may be for more."""
        limits, (least_n, most_n) = self.control.limits, self.calibration.model().force_range_n
        allowed_n = self.calibration.allowed_n
        low_n = max(limits.smallest_force_n, least_n, allowed_n[0])
        high_n = min(limits.force_max_n, most_n, allowed_n[1])
        middle_n = 0.5 * (low_n + high_n)
        tried_n = (_FORCE_TO_TRY_N, round(middle_n), round(middle_n, 2))
        return next((force_n for force_n in tried_n if low_n <= force_n <= high_n and force_n > 0.0), None)

    def model_of(self, calibration: Calibration, model: Bsfm) -> Bsfm:
        """Return the calibration's model as control uses it here: a bent command map is straightened, but for a
        calibration that was made on this very rig, for that has measured it."""
        return model if self.has_measured(calibration) else apply_command_map(model, self.compensation.command)

    def has_measured(self, calibration: Calibration) -> bool:
        """Decide whether a ladder on this very rig has measured it, bent command map and all."""
        return calibration.rig in (self.name, rehearsed(self.name) if self.simulated else self.name)

    def doubts_on(self, calibration: Calibration) -> str:
        """Return why this rig takes no force of a calibration, or why they are a guess on this real one; else empty."""
        most_n = self.control.limits.force_max_n
        if calibration.force_limits_n and (lowest_n := calibration.force_limits_n[0]) > most_n:
            own = (
                f"calibration {calibration.number} is for {lowest_n:g} N and more, {self.name} for {most_n:g} N at most"
            )
            return f"{own} (limits.force_max_n): no setpoint but 0 is taken with it"
        if self.simulated or calibration.rig == self.name:
            return ""
        origin = f'was made on "{calibration.rig}", not on {self.name}'
        return (
            f"calibration {calibration.number} {origin}: its forces are a guess until you run `force-gateway calibrate`"
        )

    def response_of(self, calibration: Calibration) -> Response | None:
        """Return how this rig follows, as the calibration measured it; None for one that another rig was measured with."""
        return calibration.response if self._has_made(calibration) else None

    def _has_made(self, calibration: Calibration) -> bool:
        return is_own(calibration, self.name, self.plant_profile if self.simulated else None)

    def calibration_in_use(self, calibration: Calibration, model: Bsfm | None = None) -> CalibrationInUse:
        """Return the calibration as control uses it here. model: its model, where that has been made already."""
        model = self.model_of(calibration, model or calibration.model())
        noise_n = calibration.noise_n if self._has_made(calibration) else 0.0
        return CalibrationInUse(model, calibration.number, self.response_of(calibration), noise_n, self._pull_model())

    def _pull_model(self) -> Bsfm | None:
        """Return the measured model of pulling as control uses it here; None where it follows from that of pushing."""
        pulling = self.pull_calibration
        return self.model_of(pulling, pulling.model()) if pulling else None

    def ports(self) -> dict[str, str]:
        """Return the serial ports of a real rig, by line; empty for a simulated one."""
        ports = {"output": self.output.port, "load_cell": self.load_cell.port}
        ports |= {"valve": self.valve.port} if self.valve else {}
        return {name: port for name, port in ports.items() if port is not None}

    def as_simulated(self) -> "Rig":
        """Return the same rig with its devices simulated, set as the rig says that the real ones are, on loopback. What
        the file leaves open, and how it was decided, is in `notes`."""
        if self.simulated:
            return self
        notes, network = self.notes, self.network
        if self.plant_profile is None and self.fallback_plant is not None:
            notes = (*notes, f"rig {self.name} names no plant: {self.fallback_plant.name} is simulated in its place")
        compensation = in_simulation(self.compensation)
        if compensation.outside is not self.compensation.outside:
            notes = (*notes, "no force from outside is simulated, so none is compensated")
        if not ip_address(network.bind).is_loopback:
            notes = (
                *notes,
                f"a simulated rig does not take the cell's address {network.bind}: --bind names another than {defaults.HOST}",
            )
            network = replace(network, bind=defaults.HOST)
        if any(isinstance(face, RtuFace) for face in self.fieldbus):
            notes = (*notes, "serial faces are pseudo-terminals: a simulated rig does not take the cell's ports")
        return replace(
            self,
            simulated=True,
            output=replace(self.output, port=None, device=_with_baud(self.output.device, self.output.baud)),
            load_cell=replace(self.load_cell, port=None, device=_with_baud(self.load_cell.device, self.load_cell.baud)),
            valve=replace(self.valve, port=None, device=_with_baud(self.valve.device, self.valve.baud))
            if self.valve
            else None,
            plant_profile=self.plant_profile or self.fallback_plant,
            network=network,
            fieldbus=tuple(_simulated_face(face) for face in self.fieldbus),
            notes=notes,
            compensation=compensation,
        )


def _simulated_face(face: Face) -> Face:
    """Return the face on this machine alone: a pseudo-terminal, or the loopback address."""
    if isinstance(face, RtuFace):
        return replace(face, port=None)
    return face if ip_address(face.bind).is_loopback else replace(face, bind=defaults.HOST)


def _with_baud(device: DeviceProfile, baud: int) -> DeviceProfile:
    """Return the device set to this speed."""
    return replace(device, serial=device.serial.at(baud))
