"""The response of the plant from the recording of a calibration run: whose rows, which rig's slew, and how it is told."""

from math import inf

from gateway.bsfm.fit.evaluation import Evaluation
from gateway.bsfm.ladder.ladder_error import LadderError
from gateway.bsfm.ladder.rows import usable_rows
from gateway.bsfm.response.identification import MeasuredResponse, measure_response
from gateway.bsfm.response.step_responses import RecordedRun
from gateway.recording import Recording
from gateway.service.fitting.ladder_source import find_rig

NOT_OURS = (
    "the response was not measured: this table is no run of the gateway, so nobody knows when its commands went out"
)


def measure_recorded_response(recording: Recording, evaluation: Evaluation) -> MeasuredResponse:
    """Return dead time and lags by the steps of a run.
    Without a response, and with the reason, where they do not show: a calibration is as good without."""
    header = recording.header
    if "ladder" not in header:
        return MeasuredResponse(None, NOT_OURS)
    rig, _ = find_rig(str(header.get("rig", "")), str(header.get("rig_file", "")))
    slew_v_per_s = rig.control.limits.voltage_slew_v_per_s if rig else inf
    try:
        rows = usable_rows(recording.columns, header)
    except LadderError as error:
        return MeasuredResponse(None, f"the response was not measured: {error}")
    day = str(header.get("started_utc", ""))[:10]
    when = f" on {day}" if day else ""
    run = RecordedRun(rows.time_s, rows.command_v, rows.force_n, slew_v_per_s)
    return measure_response(run, evaluation.model, when)
