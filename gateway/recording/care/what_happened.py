"""What happened in a recording, in a few words and in numbers: the same for the page and the terminal."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from gateway.codes.faults import FaultCode
from gateway.recording.calibrations_used import tell_changes
from gateway.recording.reader import Recording

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_LEAST_ROWS: Final = 2  # to say something of


@dataclass(frozen=True, slots=True)
class Happened:
    """ran: a run, a ladder or a plan; force_n: lowest and highest measured; residual_n: measured less what the model expects,
    root of the mean square; None where the recording does not tell; pulled_s: how long the tool pulled;
    calibrations: what was used of them beside the first."""

    ran: str
    setpoint_changes: int = 0
    most_setpoint_n: float = 0.0
    force_n: tuple[float, float] | None = None
    residual_n: float | None = None
    pulled_s: float = 0.0
    faults: tuple[str, ...] = ()
    calibrations: str = ""

    def as_words(self) -> str:
        """Return it in one line."""
        words = [self.ran]
        if changes := self.setpoint_changes:
            what = "change" if changes == 1 else "changes"
            words.append(f"{changes} {what} of setpoint, up to {self.most_setpoint_n:.4g} N")
        if self.force_n:
            words.append(f"{self.force_n[0]:.1f} to {self.force_n[1]:.1f} N measured")
        if self.pulled_s:
            words.append(f"pulled for {self.pulled_s:.3g} s")
        if self.residual_n is not None:
            words.append(f"residual {self.residual_n:.2g} N RMS, steps included")
        if self.calibrations:
            words.append(self.calibrations)
        return ", ".join([*words, *(f"fault {name}" for name in self.faults)])

    def as_facts(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "ran": self.ran,
            "setpoint_changes": self.setpoint_changes,
            "force_range_n": self.force_n and list(self.force_n),
            "residual_rms_n": self.residual_n,
            **({"pulled_s": round(self.pulled_s, 3)} if self.pulled_s else {}),
            "faults": list(self.faults),
        }


def tell_happened(recording: Recording) -> Happened | None:
    """Return what happened in a recording; None where it has no rows to tell it."""
    if recording.rows < _LEAST_ROWS:
        return None
    setpoints, force_n = (_known(recording, name) for name in ("setpoint_n", "force_n"))
    changes = int((setpoints[1:] != setpoints[:-1]).sum())
    faults = sorted({int(code) for code in _known(recording, "fault_code") if code})
    return Happened(
        ran=_what_ran(recording),
        setpoint_changes=changes,
        most_setpoint_n=float(setpoints.max()) if changes else 0.0,
        force_n=(float(force_n.min()), float(force_n.max())) if len(force_n) else None,
        residual_n=_residual_n(recording),
        pulled_s=_pulled_s(recording),
        faults=tuple(_name_of_fault(code) for code in faults),
        calibrations=tell_changes(recording),
    )


def _known(recording: Recording, name: str) -> "NDArray[np.float64]":
    import numpy as np

    values = recording.columns.get(name, np.empty(0))
    return values[np.isfinite(values)]


def _pulled_s(recording: Recording) -> float:
    """Return how long the tool pulled: each such row until the next one."""
    import numpy as np

    from gateway.recording.tables.row_validity import pulled_rows

    if "time_s" not in recording.columns:
        return 0.0
    time_s = recording.columns["time_s"]
    time_s = np.where(np.isfinite(time_s), time_s, np.nan)  # of another program: JSON has no infinity
    return float(np.nansum(np.diff(time_s)[pulled_rows(recording.columns)[:-1]]))


def _residual_n(recording: Recording) -> float | None:
    """Return the residual while a force was asked for; without one, control expects nothing."""
    import numpy as np

    columns = recording.columns
    if not {"model_residual_n", "applied_n"} <= set(columns):
        return None
    residual_n = columns["model_residual_n"][columns["applied_n"] > 0.0]
    residual_n = residual_n[np.isfinite(residual_n)]
    return float(np.sqrt(np.mean(residual_n**2))) if len(residual_n) else None


def _what_ran(recording: Recording) -> str:
    from gateway.bsfm.ladder.labels import Labels  # numpy

    header = recording.header
    if ladder := header.get("ladder"):
        labels = Labels.of(recording.columns)
        is_cut = labels is not None and not labels.is_finished and "stairs" in ladder
        climbed = f", {labels.last_stair} of {ladder['stairs']} stairs climbed" if labels and is_cut else ""
        step_v = ladder.get("step_v", 0.0)
        stairs = f"{step_v:g} V stairs" if isinstance(step_v, (int, float)) else "stairs"
        groups = ladder.get("groups", "?")
        return f"calibration ladder of {groups} {'group' if groups == 1 else 'groups'} of {stairs}{climbed}"
    if experiment := header.get("experiment"):
        return f"experiment {experiment.get('name', '')}".strip()
    return "run"


def _name_of_fault(code: int) -> str:
    try:
        return FaultCode(code).explanation.code
    except ValueError:
        return str(code)
