"""The response of a plant, from the rows of a calibration run: dead time and lags, or why there are none.

Fitted in linearized volts to the recorded force, through the static model. The voltage that has arrived is the command's,
delayed and lagged; what stands in the recording is taken as written when its row was, so the time that wire, device and
cell take is part of the dead time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from gateway.bsfm.model import Bsfm, Response
from gateway.bsfm.response.lag_fit import LagFit, choose_shapes, fit_lags, interval
from gateway.bsfm.response.response_model import SHORTEST_LAG_S, StepResponse
from gateway.bsfm.response.step_responses import LEAST_STEP_N, LONGEST_S, RecordedRun, step_responses_of

FEWEST_STEPS: Final = 6
NOT_MEASURED: Final = "the response was not measured: "


@dataclass(frozen=True, slots=True)
class MeasuredResponse:
    """The response of a plant, where it could be measured. response: None where it could not be measured; why_not: then the
    sentence.
    """

    response: Response | None
    why_not: str = ""

    @property
    def description(self) -> str:
        """The response with its source, or why it was not measured."""
        return f"response: {self.response.source}" if self.response else self.why_not


def measure_response(run: RecordedRun, model: Bsfm, when: str = "") -> MeasuredResponse:
    """Measure dead time and lags in the rows of a run. when: of the run, such as ` on 2026-05-01`, for the source."""
    steps = step_responses_of(run, model)
    if len(steps) < FEWEST_STEPS:
        why_not = f"{len(steps)} steps of {LEAST_STEP_N:g} N or more with enough readings, {FEWEST_STEPS} are needed"
        return MeasuredResponse(None, NOT_MEASURED + why_not)
    shapes = choose_shapes(steps)
    steps = step_responses_of(run, model, fit_lags(steps, shapes).lags)  # again: the ends had not quite settled
    fit = fit_lags(steps, shapes)
    if not (0.0 <= fit.dead_time_s < LONGEST_S and SHORTEST_LAG_S < fit.lags_s < LONGEST_S):
        times = f"dead time {fit.dead_time_s * 1e3:.0f} ms and lags of {fit.lags_s * 1e3:.0f} ms in sum"
        return MeasuredResponse(None, f"{NOT_MEASURED}the steps give {times}, which no plant of this kind has")
    return MeasuredResponse(_response_of(fit, steps, when))


def _response_of(fit: LagFit, steps: Sequence[StepResponse], when: str) -> Response:
    low_s, high_s = interval(fit, steps)
    sizes = [abs(float(step.path_n[-1] - step.path_n[0])) for step in steps]
    lags = fit.lags
    both = f" and {lags.second_lag_s * 1e3:.0f}" if lags.second_lag_s else ""
    rings = f", ringing with damping {lags.damping:.2f}" if lags.damping else ""
    source = (
        f"{len(steps)} steps of {min(sizes):.0f}-{max(sizes):.0f} N{when}: dead time {fit.dead_time_s * 1e3:.0f} ms "
        f"[{low_s[0] * 1e3:.0f}, {high_s[0] * 1e3:.0f}], {'lags' if both else 'lag'} {lags.lag_s * 1e3:.0f}{both} ms, in sum "
        f"{fit.lags_s * 1e3:.0f} [{low_s[1] * 1e3:.0f}, {high_s[1] * 1e3:.0f}]{rings}, {fit.rms_n:.2f} N RMS on the way"
    )
    return Response(
        dead_time_s=round(max(0.0, fit.dead_time_s), 5),
        lag_s=round(lags.lag_s, 5),
        second_lag_s=round(lags.second_lag_s, 5),
        damping=round(lags.damping, 3),
        source=source,
    )
