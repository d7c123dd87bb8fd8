"""What a running gateway answers to `{"do": "state"}` on its control socket: everything that is slow, or has words.

What moves with every sample is in the ring (`ring_rows`). Control makes a LiveState, processes beside it read one: the types
here are the contract. None or an empty text stands where there is nothing to say.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Self


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveAlarm:
    """A fault or a warning that stands. cure: one thing to do; since_unix_s: when it rose, seconds since 1970."""

    code: str
    title: str
    cure: str
    since_unix_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveLine:
    """One serial line. asked, heard, garbled: messages since the start (asked 0: the device talks by itself); age_s: since it
    was last heard, None where it never was."""

    port: str = ""
    device: str = ""
    asked: int = 0
    heard: int = 0
    garbled: int = 0
    age_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveLoop:
    """The control loop. missed: ticks that were too late to be run; late: what half and 99 % of the ticks stayed under."""

    hz: float = 0.0
    ticks: int = 0
    missed: int = 0
    late_p50_us: int = 0
    late_p99_us: int = 0
    step_us: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveForce:
    """Forces in N: asked for by the master, accepted by control, applied at this instant, measured (None: no sample), and what
    the model expects less than that; the voltage and how it came about, V."""

    requested_n: float = 0.0
    accepted_n: float = 0.0
    applied_n: float = 0.0
    measured_n: float | None = None
    model_residual_n: float | None = None
    voltage_v: float | None = None
    feedforward_v: float = 0.0
    trim_v: float = 0.0
    pressure_kpa: float | None = None
    limited_by: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveCalibration:
    """The calibration in use. age_s: since its date, None where it has none that can be read."""

    number: int = 0
    name: str = ""
    kind: str = ""
    date_utc: str = ""
    age_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LivePlant:
    """The plant in use; number 0: the rig's own."""

    number: int = 0
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LivePeer:
    """A connected master. identity: as the owner is named."""

    identity: str
    address: str
    role: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveRecording:
    """The recording under way, if any. number: as `recordings` and `diagnose` take it."""

    on: bool = False
    number: int | None = None
    path: str = ""
    rows: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveRun:
    """A calibration, an experiment or a self-test. share: 0 .. 1; said: the sentence that the last one ended with; stored:
    number of the calibration that it gave, 0 for none; result: of its fit, as `calibrate` answers."""

    running: bool = False
    phase: str = "idle"
    share: float = 0.0
    eta_s: float = 0.0
    said: str = ""
    stored: int = 0
    result: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveLimits:
    """What a setpoint may be, N and V; tolerance_n: half the band that counts as holding; lease_s: None for none."""

    force_min_n: float = 0.0
    force_max_n: float = 0.0
    voltage_max_v: float = 0.0
    tolerance_n: float = 0.0
    lease_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveResidual:
    """What the residual watch says. effect: name of the cause, `none` where the plant explains all; why_skipped: why the newest
    window could not be judged."""

    cause: int = 0
    effect: str = "none"
    sentence: str = ""
    why_skipped: str = ""
    age_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveWriter:
    """Who wrote a register last, and how long ago."""

    peer: str
    age_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveState:
    """The whole answer. state: off, ready, ramping, holding, fault or calibrating; mode: force or voltage; status: names of the
    bits that are set in status_word; enable_block: why an enable would be refused now, empty where it would not; refusals:
    requests that were refused since the start; valve: without a device on a rig that has none."""

    rig: str
    simulated: bool
    version: str
    time_unix_s: float
    state: str
    mode: str = "force"
    status: tuple[str, ...] = ()
    owner: str | None = None
    enable_block: str = ""
    last_refusal: str = ""
    refusals: int = 0
    faults: tuple[LiveAlarm, ...] = ()
    warnings: tuple[LiveAlarm, ...] = ()
    force: LiveForce = field(default_factory=LiveForce)
    limits: LiveLimits = field(default_factory=LiveLimits)
    calibration: LiveCalibration = field(default_factory=LiveCalibration)
    plant: LivePlant = field(default_factory=LivePlant)
    peers: tuple[LivePeer, ...] = ()
    output: LiveLine = field(default_factory=LiveLine)
    load_cell: LiveLine = field(default_factory=LiveLine)
    valve: LiveLine = field(default_factory=LiveLine)
    loop: LiveLoop = field(default_factory=LiveLoop)
    recording: LiveRecording = field(default_factory=LiveRecording)
    run: LiveRun = field(default_factory=LiveRun)
    residual: LiveResidual = field(default_factory=LiveResidual)
    writers: Mapping[str, LiveWriter] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the state as the socket carries it."""
        return asdict(self)

    @classmethod
    def from_json(cls, answer: Mapping[str, Any]) -> Self:
        """Return the state that an answer carries; TypeError for what is none. Behind an update the gateway that still runs is
        of another version than who asks: what it tells beside the fields of here is left out, what it lacks is unsaid."""
        given = _known_fields(cls, answer)
        for name, kind in _PARTS.items():
            given[name] = kind(**_known_fields(kind, given.get(name, {})))
        for name, kind in _LISTS.items():
            given[name] = tuple(kind(**_known_fields(kind, one)) for one in given.get(name, ()))
        given["status"] = tuple(given.get("status", ()))
        writers = given.get("writers", {})
        given["writers"] = {name: LiveWriter(**_known_fields(LiveWriter, one)) for name, one in writers.items()}
        return cls(**given)


def _known_fields(kind: type, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of the values for which a kind of state has a field."""
    return {one.name: values[one.name] for one in fields(kind) if one.name in values}


_PARTS: dict[str, type] = {
    "force": LiveForce,
    "limits": LiveLimits,
    "calibration": LiveCalibration,
    "plant": LivePlant,
    "output": LiveLine,
    "load_cell": LiveLine,
    "valve": LiveLine,
    "loop": LiveLoop,
    "recording": LiveRecording,
    "run": LiveRun,
    "residual": LiveResidual,
}
_LISTS: dict[str, type] = {"faults": LiveAlarm, "warnings": LiveAlarm, "peers": LivePeer}
