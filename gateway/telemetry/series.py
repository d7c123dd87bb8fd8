"""The table of series: what Prometheus, the verb `metrics`, the dashboards and MQTT may know of a running gateway, by name.

Names and units follow Prometheus' custom: base units, `_total` for counters, labels for what there is several of. A figure
that is not known yields nothing: an old or an invented value would be worse than a gap.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from gateway.live.live_state import LiveAlarm, LiveLine, LiveState
from gateway.registers.words import State
from gateway.units import PASCAL_PER_KILOPASCAL

PREFIX: Final = "force_gateway_"
UP: Final = f"{PREFIX}up"
STATES: Final = tuple(state.name.lower() for state in State)

Labels = dict[str, str]
Sample = tuple[Labels, float]


@dataclass(frozen=True, slots=True)
class GatewayReading:
    """What control answered to `state` and to `health` at one time."""

    state: LiveState
    health: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Series:
    """kind: gauge or counter; unit: of its values, empty for a number; read: its samples, none where it is not known."""

    name: str
    kind: str
    unit: str
    help: str
    read: Callable[[GatewayReading], Iterable[Sample]]


def _gauge(name: str, unit: str, help_text: str, value: Callable[[LiveState], float | None]) -> Series:
    return Series(PREFIX + name, "gauge", unit, help_text, lambda reading: _known(value(reading.state)))


def _known(value: float | None) -> Iterator[Sample]:
    if value is not None:
        yield {}, float(value)


def _error_n(state: LiveState) -> float | None:
    """Setpoints are positive where the tool pulls, too, and the measured force is negative there."""
    measured_n = state.force.measured_n
    if measured_n is None:
        return None
    return state.force.applied_n - (-measured_n if "pulling" in state.status else measured_n)


def _pressure_pa(state: LiveState) -> float | None:
    kilopascal = state.force.pressure_kpa
    return None if kilopascal is None else kilopascal * PASCAL_PER_KILOPASCAL


def _per_line(name: str, kind: str, unit: str, help_text: str, value: Callable[[LiveLine], Iterable[Sample]]) -> Series:
    def read(reading: GatewayReading) -> Iterator[Sample]:
        state = reading.state
        lines = {"output": state.output, "load_cell": state.load_cell} | (
            {"valve": state.valve} if state.valve.device else {}
        )
        for line, found in lines.items():
            yield from (({"line": line} | labels, number) for labels, number in value(found))

    return Series(PREFIX + name, kind, unit, help_text, read)


def _alarms(name: str, help_text: str, which: Callable[[LiveState], tuple[LiveAlarm, ...]]) -> Series:
    def read(reading: GatewayReading) -> Iterator[Sample]:
        for alarm in which(reading.state):
            yield {"code": alarm.code, "title": alarm.title}, 1.0

    return Series(PREFIX + name, "gauge", "", help_text, read)


def _health(part: str, key: str, name: str, unit: str, help_text: str) -> Series:
    """A figure of `health`, or of a part of it; microseconds become seconds."""
    scale = 1e-6 if key.endswith("_us") else 1.0

    def read(reading: GatewayReading) -> Iterator[Sample]:
        figures = (reading.health.get(part) or {}) if part else reading.health
        value = figures.get(key)
        if isinstance(value, (int, float)):
            labels = {"name": str(figures["name"])} if key == "cause" and "name" in figures else {}
            yield labels, value * scale

    return Series(PREFIX + name, "counter" if name.endswith("_total") else "gauge", unit, help_text, read)


def _info(reading: GatewayReading) -> Iterator[Sample]:
    state = reading.state
    yield {"rig": state.rig, "version": state.version, "simulated": str(state.simulated).lower()}, 1.0


def _refusals(reading: GatewayReading) -> Iterator[Sample]:
    yield {}, float(reading.state.refusals)


def _states(reading: GatewayReading) -> Iterator[Sample]:
    return (({"state": name}, float(reading.state.state == name)) for name in STATES)


_FORCE: Final = (
    _gauge("force_newtons", "N", "Force that the load cell measures.", lambda s: s.force.measured_n),
    _gauge("setpoint_requested_newtons", "N", "Force that the master asks for.", lambda s: s.force.requested_n),
    _gauge("setpoint_accepted_newtons", "N", "Force that control has accepted.", lambda s: s.force.accepted_n),
    _gauge("setpoint_applied_newtons", "N", "Force that control aims at now (ramped).", lambda s: s.force.applied_n),
    _gauge("force_error_newtons", "N", "Applied setpoint less measured force, in the tool's direction.", _error_n),
    _gauge("tolerance_newtons", "N", "Half the band that counts as holding.", lambda s: s.limits.tolerance_n),
    _gauge("force_max_newtons", "N", "Largest setpoint that is allowed.", lambda s: s.limits.force_max_n),
    _gauge(
        "model_residual_newtons", "N", "Measured force less what the model expects.", lambda s: s.force.model_residual_n
    ),
    _gauge("voltage_volts", "V", "Voltage at the output.", lambda s: s.force.voltage_v),
    _gauge("feedforward_volts", "V", "The model's share of it.", lambda s: s.force.feedforward_v),
    _gauge("trim_volts", "V", "The trim's share of it.", lambda s: s.force.trim_v),
    _gauge("pressure_pascals", "Pa", "Pressure that the device reports.", _pressure_pa),
)
_STATE: Final = (
    Series(PREFIX + "info", "gauge", "", "Always 1; labels say rig and version.", _info),
    Series(PREFIX + "state", "gauge", "", "1 for the state that the gateway is in, 0 for each other.", _states),
    _alarms("fault", "1 for the fault that stands; nothing without one.", lambda s: s.faults),
    _alarms("warning", "1 for each warning that stands; nothing without one.", lambda s: s.warnings),
    _gauge("faults", "", "Faults that stand.", lambda s: len(s.faults)),
    _gauge("warnings", "", "Warnings that stand.", lambda s: len(s.warnings)),
    Series(PREFIX + "refusals_total", "counter", "", "Requests of masters that were refused.", _refusals),
    _gauge("clients", "", "Connected masters.", lambda s: len(s.peers)),
    _gauge("owned", "", "1 while a master owns the gateway.", lambda s: s.owner is not None),
    _gauge("recording", "", "1 while a recording is under way.", lambda s: s.recording.on),
    _gauge("recording_rows", "", "Rows of it so far.", lambda s: s.recording.rows if s.recording.on else None),
    _gauge("run_active", "", "1 while a calibration or self-test runs.", lambda s: s.run.running),
    _gauge("calibration_number", "", "Calibration in use; 0: the rig's own.", lambda s: s.calibration.number),
    _gauge("calibration_age_seconds", "s", "Since that calibration's date.", lambda s: s.calibration.age_s),
    _gauge("plant_number", "", "Plant in use; 0: the rig's own.", lambda s: s.plant.number),
)
_LINES: Final = (
    _gauge("sample_age_seconds", "s", "Since the load cell's last sample.", lambda s: s.load_cell.age_s),
    _per_line(
        "serial_frames_total",
        "counter",
        "",
        "Messages on a serial line: asked for, and heard.",
        lambda line: (({"kind": "asked"}, line.asked), ({"kind": "heard"}, line.heard)),
    ),
    _per_line("serial_errors_total", "counter", "", "Messages that were garbled.", lambda line: _known(line.garbled)),
    _per_line("serial_age_seconds", "gauge", "s", "Since a line was last heard.", lambda line: _known(line.age_s)),
)
_LOOP: Final = (
    _health("", "ticks", "loop_ticks_total", "", "Periods of the control loop."),
    _health("", "missed_ticks", "loop_missed_ticks_total", "", "Periods that passed without a step."),
    _health("", "loop_time_us", "loop_step_seconds", "s", "Work of the last step."),
    _health("", "late_p50_us", "loop_late_p50_seconds", "s", "Half of all steps began no later than this."),
    _health("", "late_p99_us", "loop_late_p99_seconds", "s", "99 of 100 steps began no later than this."),
)
_CAUSE_HELP: Final = "What the model differs by: 0 nothing, 99 unknown, else the register's."
_RESIDUAL: Final = (
    _health("residual", "cause", "residual_cause", "", _CAUSE_HELP),
    _health("residual", "warnings", "residual_warnings_total", "", "How often that warning rose."),
    _health("residual", "age_s", "residual_age_seconds", "s", "Since the watch last spoke."),
    _health("residual", "looks", "residual_looks_total", "", "Windows that the watch looked at."),
    _health("residual", "judged", "residual_judged_total", "", "Windows that it could judge."),
    _health("residual", "skipped", "residual_skipped_total", "", "Windows that held too little."),
    _health("residual", "cpu_s", "residual_cpu_seconds_total", "s", "Processor time of the watch."),
    _health("residual", "rms_n", "residual_rms_newtons", "N", "Model less cell in the last window, RMS."),
    _health("residual", "floor_n", "residual_floor_newtons", "N", "The noise in it."),
    _health("residual", "pause_s", "residual_pause_seconds", "s", "Until the watch looks again."),
)
UP_SERIES: Final = Series(UP, "gauge", "", "1 while control answers, 0 while it does not.", lambda _: (({}, 1.0),))
SERIES: Final = (UP_SERIES, *_STATE, *_FORCE, *_LINES, *_LOOP, *_RESIDUAL)


def samples_of(reading: GatewayReading | None) -> Iterator[tuple[Series, list[Sample]]]:
    """Yield each series that is known with its samples; None, where control does not answer, gives `up` 0 and no old values."""
    if reading is None:
        yield UP_SERIES, [({}, 0.0)]
        return
    for series in SERIES:
        samples = list(series.read(reading))
        if samples:
            yield series, samples
