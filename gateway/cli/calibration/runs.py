"""The two ways to run a calibration: on this machine through the control socket, elsewhere by Modbus.

Both answer `preview`, `begin`, `look` and `stop`; `look` is a RunStatus. By Modbus the master decides: bit 5 starts the
gateway's own plan, and clearing it ends the run.
"""

from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any, Final

from gateway import defaults
from gateway.cli.control_socket import ask
from gateway.cli.errors import CliError
from gateway.cli.master.client import GatewayClient
from gateway.cli.master.refusal_text import explain_refusals
from gateway.cli.master.wires import Wire
from gateway.profiles import load_register_map
from gateway.registers.words import CalibrationPhase, ControlBit

ENDED: Final = ("stored", "refused", "stopped", "recorded")
_WORDS: Final = ("calibration_phase", "calibration_progress", "calibration_stored", "force_measured", "output_voltage")


@dataclass(frozen=True, slots=True)
class RunStatus:
    """One look at a run. eta_s: nan where nobody knows; detail: such as ` 2 of 5`."""

    phase: str
    progress: float
    eta_s: float
    force_n: float
    voltage_v: float
    detail: str = ""


class LocalRun:
    """A run on the gateway of this machine, by its control socket. plan: fields of CalibrationPlan or ExperimentPlan;
    earlier: recordings that it goes on from; name: of the calibration.
    """

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


class RemoteRun:
    """A gateway elsewhere; the recording and the report are there, too."""

    def __init__(self, wire: Wire, unit: int) -> None:
        self._map = load_register_map(defaults.REGISTER_MAP)
        self._client = GatewayClient(wire, unit, self._map)
        self._registers = [self._map.find(name) for name in _WORDS]
        self._values: list[float] = []
        self._before = ""

    def preview(self) -> dict[str, Any]:
        """Return nothing: by Modbus nobody says beforehand what will happen."""
        return {}

    def begin(self) -> None:
        """Start the run by the control word."""
        self._before = self.look().phase
        self._command(int(ControlBit.START_CALIBRATION))

    def look(self) -> RunStatus:
        """Read from the registers how far the run is."""
        with explain_refusals(self._client):
            self._values = [reading.value for reading in self._client.read_values(self._registers)]
        phase, progress, _, force_n, output_mv = self._values
        name = CalibrationPhase(int(phase)).name.lower()
        if name == self._before and name in ENDED:
            name = "idle"  # what the run before left
        elif name != self._before:
            self._before = ""
        return RunStatus(name, progress / 1000.0, nan, force_n, output_mv / 1000.0)

    def stop(self) -> None:
        """Stop the run; the force goes to 0."""
        self._command(0)

    def end(self) -> dict[str, Any]:
        """Return how it ended: phase and number of the stored calibration."""
        phase = CalibrationPhase(int(self._values[0])).name.lower()
        return {"phase": phase, "stored": int(self._values[2])}

    def _command(self, word: int) -> None:
        register = self._map.find("control_word")
        try:
            for frame in self._client.frames([_assignment(register, word)]):
                with explain_refusals(self._client, [frame]):
                    self._client.write(frame)
        except CliError:  # the run ends with it, or is looked at by a new connection
            self._client.close()
            raise


def _assignment(register: Any, word: int) -> Any:
    from gateway.cli.master.client import Assignment

    return Assignment(register, register.encode(word))
