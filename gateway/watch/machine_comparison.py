"""Compare windows with the machine as its reference recording shows it: its own nature is no finding, a change of it is.

A look puts the window beside the reference, whose model and common error were fitted once. Only what it leaves beyond what the
reference leaves, by more than matters to whoever holds the force, is searched for, among the changes of the machine's numbers.
"""

from dataclasses import replace
from math import sqrt
from typing import Final

from gateway.diagnosis import Diagnosis
from gateway.diagnosis.changes.compare_recordings import compare_with_machine
from gateway.diagnosis.changes.machine import MachineModel, join_recordings
from gateway.diagnosis.diagnose import Options
from gateway.diagnosis.result import Cause
from gateway.registers.residual_cause import ResidualCause
from gateway.twin.plant import Plant
from gateway.watch.warning_filter import WindowVerdict
from gateway.watch.window import Window
from gateway.watch.window_verdict import EXCESS_WITHOUT_A_NAME, describe_leftover, plausible_name

_OPTIONS: Final = Options(is_own=True)


class MachineComparison:
    """machine: described by the reference, called `name`; plant: the rig's; least_n: what a change must do to the force."""

    def __init__(self, machine: MachineModel, name: str, plant: Plant, least_n: float) -> None:
        self._machine = machine
        self._name = name
        self._plant = plant
        self._least_n = least_n

    def why_unsuitable(self, window: Window) -> str:
        """Return nothing: every window may be the first, for the reference is there."""
        return ""

    def rms_n(self, window: Window) -> float:
        """Return what the machine's model and its common error leave of the window, N."""
        joint = join_recordings([window.measurement], self._machine, self._plant, _OPTIONS)
        return joint.bench.rms_n(joint.fitted.residual_n)

    def floor_n(self, window: Window) -> float:
        """Return what they leave of the reference, N."""
        return self._machine.error.left_n

    def is_exceeded(self, window: Window, rms_n: float) -> bool:
        """Return whether more is off than disturbs nobody."""
        return self._excess_n(rms_n) >= self._least_n

    def judge(self, window: Window) -> WindowVerdict | None:
        """Search for what has changed; the change that does most to the force. None where something is off, but too little to
        be told without a name."""
        found = compare_with_machine([window.measurement], self._machine, self._plant, _OPTIONS)
        best = max(found.causes, key=_saved_n, default=None)
        if best is not None and _saved_n(best) >= self._least_n:
            best = replace(best, name=plausible_name(best.name, best.group))
            cause, sentence = ResidualCause.of_effect(best.name), self._sentence(best, found)
            return WindowVerdict(cause, sentence, window.excitation_v, best.group)
        excess_n = self._excess_n(found.baseline.rms_n)
        if excess_n >= EXCESS_WITHOUT_A_NAME * self._least_n:
            sentence = f"{self._differs(excess_n)}: {describe_leftover(found)}"
            return WindowVerdict(ResidualCause.UNKNOWN, sentence, window.excitation_v)
        return None if excess_n >= self._least_n else WindowVerdict(excitation_v=window.excitation_v)

    def _excess_n(self, rms_n: float) -> float:
        return sqrt(max(rms_n**2 - self._machine.error.left_n**2, 0.0))

    def _differs(self, by_n: float) -> str:
        return f"the force differs from the reference {self._name} by {by_n:.2f} N (rms)"

    def _sentence(self, cause: Cause, found: Diagnosis) -> str:
        """`the force differs from the reference 0003.fgr by 0.31 N (rms): leak, leak_per_s 0 -> 0.014 1/s`."""
        values = ", ".join(
            f"{name} {getattr(getattr(found.base, each.section), name):.4g} -> {each.value:.4g} {each.unit}"
            for name, each in cause.parameters.items()
        )
        others = [name for name in cause.group if name != cause.name]
        group = f"; this run cannot tell it from {', '.join(others)}" if others else ""
        return f"{self._differs(_saved_n(cause))}: {cause.name}, {values}{group}"


def _saved_n(cause: Cause) -> float:
    """What it does to the force, N: what it saves in rows that its fit did not see."""
    return sqrt(max(cause.gain.held_out_rms_before_n**2 - cause.gain.held_out_rms_after_n**2, 0.0))
