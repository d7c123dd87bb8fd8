"""Compare windows with the rig's plant: a replay is cheap, and only what it leaves beyond a floor is searched for."""

from gateway.registers.residual_cause import ResidualCause
from gateway.watch.reference import WatchReference
from gateway.watch.reference_recording import LEAST_EXCITATION_V, LEAST_MOVES
from gateway.watch.warning_filter import WindowVerdict
from gateway.watch.window import Window
from gateway.watch.window_verdict import Diagnose, judge_window


class PlantComparison:
    """reference: the plant and what is usual beside it; diagnose: the search; least_n: what must be off, N."""

    def __init__(self, reference: WatchReference, diagnose: Diagnose, least_n: float) -> None:
        self.reference = reference
        self._diagnose = diagnose
        self._least_n = least_n

    def why_unsuitable(self, window: Window) -> str:
        """Return why this window may not be the first; empty when it may, or when it is not."""
        enough = window.excitation_v >= LEAST_EXCITATION_V and window.moves >= LEAST_MOVES
        return "" if self.reference.is_settled or enough else "too little was commanded to begin with"

    def rms_n(self, window: Window) -> float:
        """Return what the plant leaves of the window, N."""
        return self.reference.rms_n(window)

    def floor_n(self, window: Window) -> float | None:
        """Return what is usual in such windows, N; None where that is not known yet."""
        return self.reference.floor_n(window)

    def is_exceeded(self, window: Window, rms_n: float) -> bool:
        """Return whether the search is worth its time."""
        return self.reference.is_exceeded(window, rms_n)

    def judge(self, window: Window) -> WindowVerdict:
        """Search for the cause. What nothing is found in is usual from now on."""
        diagnosis = self._diagnose([window.measurement], self.reference.plant)
        if not self.reference.is_settled:
            self.reference.take_line_delays(diagnosis)
        finding = judge_window(window, diagnosis, self.reference, self._least_n)
        if finding.cause is ResidualCause.NONE:
            self.reference.raise_floor(window, self.reference.rms_n(window))
        return finding
