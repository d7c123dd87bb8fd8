"""The two ways to run a calibration: on this machine through the control socket, elsewhere by Modbus (remote_run.py).

Both answer `preview`, `begin`, `look` and `stop`; `look` is a RunStatus; `close` lets go of what is open.
"""

from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any, Final, Protocol

from gateway.cli.control_socket import ask

ENDED: Final = ("stored", "refused", "stopped", "recorded")


@dataclass(frozen=True, slots=True)
class RunStatus:
    """One look at a run. eta_s: nan where nobody knows; detail: such as ` 2 of 5`."""

    phase: str
    progress: float
    eta_s: float
    force_n: float
    voltage_v: float
    detail: str = ""


class Run(Protocol):
    """A run that can be followed to its end. lost_words: what becomes of it where its gateway does not answer any more."""

    lost_words: str

    def begin(self) -> None:
        """Start the run."""

    def look(self) -> RunStatus:
        """Return how far the run is."""

    def stop(self) -> None:
        """Stop the run; the force goes to 0."""

    def end(self) -> dict[str, Any]:
        """Return how it ended: phase and what there is to say of it."""

    def close(self) -> None:
        """Let go of what is open."""


class LocalRun:
    """A run on the gateway of this machine, by its control socket. plan: fields of CalibrationPlan or ExperimentPlan;
    earlier: recordings that it goes on from; name: of the calibration.
    """

    lost_words = (
        "the run has ended with it, at the safe voltage; what was recorded is kept: force-gateway calibrate --resume"
    )

    def __init__(self, state: Path, plan: dict[str, Any], earlier: list[int], name: str = "") -> None:
        self._state = state
        self._plan = plan
        self._earlier = earlier
        self._name = name
        self._last: dict[str, Any] = {}

    def preview(self) -> dict[str, Any]:
        """Return what the gateway would do, without a motion."""
        return ask(self._state, {"do": "calibrate", "plan": self._plan, "dry_run": True})

    def begin(self) -> None:
        """Start the run."""
        request = {"do": "calibrate", "plan": self._plan, "continues": self._earlier, "name": self._name}
        self._last = ask(self._state, request)

    def look(self) -> RunStatus:
        """Ask how far the run is."""
        self._last = last = ask(self._state, {"do": "calibrate"})
        group = f" {last['group']} of {last['groups']}" if last["phase"] == "ladder" else ""
        part = f": {last['part_name']} ({last['part']} of {last['parts']})" if last["phase"] == "experiment" else ""
        return RunStatus(
            last["phase"],
            last["progress"],
            last["eta_s"],
            nan if last["force_n"] is None else last["force_n"],
            nan if last["voltage_v"] is None else last["voltage_v"],
            group or part,
        )

    def stop(self) -> None:
        """Stop the run; the force goes to 0."""
        ask(self._state, {"do": "calibrate", "stop": True})

    def end(self) -> dict[str, Any]:
        """Return how it ended: phase, stored, report, document, recording, sentence."""
        last = self._last
        result = dict(last["result"])
        sentence = result.pop("refused", "") or last["ended"]
        return {"phase": last["phase"], "recording": last["recording"], "sentence": sentence} | result

    def close(self) -> None:
        """Pass: each question has a connection of its own."""
