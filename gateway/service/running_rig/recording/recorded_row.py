"""What a run records: one row per load-cell sample, in the columns of the recording contract.

`command_v` is what is wanted from this row on; `force_n` was read before it acts. A wire at 9600 baud takes 20 ms for a
setting and its echo, so not every command is sent, and none at once: `sent_v` is the last one that was, `sent_age_s` before
this row.
"""

from gateway.control.inputs import Output
from gateway.devices.messages import ForceSample, Quality
from gateway.recording.tables.column_names import DERIVED, PULLING, SENT
from gateway.registers.words import StatusBit
from gateway.service.running_rig.lines.output_line import LineState
from gateway.units import kilopascal_from_pascal

COLUMNS = ("time_s", "command_v", "force_n", "pressure_kpa", "quality", *DERIVED, *SENT, PULLING)

_PULLING = int(StatusBit.PULLING)
_QUALITY_NUMBER = {Quality.OK: 0.0, Quality.UNSTABLE: 1.0, Quality.OVERLOAD: 2.0}


def row_of(time_s: float, sample: ForceSample, decision: Output, line: LineState) -> tuple[float, ...]:
    """Return one row in the order of COLUMNS; time_s counts from wherever the taker's begins."""
    return (
        time_s,
        decision.voltage_v,
        decision.force_measured_n,
        kilopascal_from_pascal(line.pressure_pa),
        _QUALITY_NUMBER[sample.quality],
        decision.force_requested_n,
        decision.force_applied_n,
        decision.feedforward_v,
        decision.trim_v,
        float(decision.state),
        float(decision.fault),
        float(decision.limited_by),
        decision.model_residual_n,
        line.sent_v,
        sample.time_s - line.sent_s,
        float(bool(int(decision.status) & _PULLING)),
    )
