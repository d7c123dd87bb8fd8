"""The metrics of the Sparkplug edge node: name, type, and how each is read from the gateway's state.

A birth names all of them. What is not known, and everything while control does not answer, is null there and not an old value.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from gateway.live.live_state import LiveAlarm, LiveState
from gateway.telemetry.sparkplug_payload import DataType, Value


@dataclass(frozen=True, slots=True)
class NodeMetric:
    """read: its value, None where it is not known."""

    name: str
    datatype: DataType
    read: Callable[[LiveState], Value]


def _codes(alarms: Iterable[LiveAlarm]) -> str:
    return " ".join(alarm.code for alarm in alarms)


_DOUBLE, _COUNT, _TEXT, _FLAG = DataType.DOUBLE, DataType.UINT64, DataType.STRING, DataType.BOOLEAN
ANSWERS: Final = "Control/Answers"
NODE_METRICS: Final = (
    NodeMetric(ANSWERS, _FLAG, lambda _: True),
    NodeMetric("Properties/Rig", _TEXT, lambda state: state.rig),
    NodeMetric("Properties/Version", _TEXT, lambda state: state.version),
    NodeMetric("Properties/Simulated", _FLAG, lambda state: state.simulated),
    NodeMetric("State", _TEXT, lambda state: state.state),
    NodeMetric("Mode", _TEXT, lambda state: state.mode),
    NodeMetric("Owner", _TEXT, lambda state: state.owner or ""),
    NodeMetric("Alarms/Faults", _TEXT, lambda state: _codes(state.faults)),
    NodeMetric("Alarms/Warnings", _TEXT, lambda state: _codes(state.warnings)),
    NodeMetric("Force/Measured N", _DOUBLE, lambda state: state.force.measured_n),
    NodeMetric("Force/Requested N", _DOUBLE, lambda state: state.force.requested_n),
    NodeMetric("Force/Accepted N", _DOUBLE, lambda state: state.force.accepted_n),
    NodeMetric("Force/Applied N", _DOUBLE, lambda state: state.force.applied_n),
    NodeMetric("Output/Voltage V", _DOUBLE, lambda state: state.force.voltage_v),
    NodeMetric("Output/Errors", _COUNT, lambda state: state.output.garbled),
    NodeMetric("Load Cell/Errors", _COUNT, lambda state: state.load_cell.garbled),
    NodeMetric("Calibration/Number", _COUNT, lambda state: state.calibration.number),
    NodeMetric("Calibration/Name", _TEXT, lambda state: state.calibration.name),
    NodeMetric("Loop/Missed Ticks", _COUNT, lambda state: state.loop.missed),
    NodeMetric("Refusals", _COUNT, lambda state: state.refusals),
    NodeMetric("Clients", _COUNT, lambda state: len(state.peers)),
    NodeMetric("Recording", _FLAG, lambda state: state.recording.on),
    NodeMetric("Residual/Effect", _TEXT, lambda state: state.residual.effect),
)
TYPES: Final = {metric.name: metric.datatype for metric in NODE_METRICS}


def values_of(state: LiveState | None) -> dict[str, Value]:
    """Return the value of each metric; None: control does not answer."""
    if state is None:
        return {metric.name: False if metric.name == ANSWERS else None for metric in NODE_METRICS}
    return {metric.name: metric.read(state) for metric in NODE_METRICS}
