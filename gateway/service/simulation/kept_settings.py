"""What is set on a simulated rig, kept in the state directory for the time that one gateway runs."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gateway.processes.durable_file import read_object
from gateway.service.simulation.settings import SimulationSettings, restore_settings

_FILE: Final = "simulation.json"


@dataclass(frozen=True, slots=True)
class KeptSettings:
    """run: of the gateway that runs now; what another one has left counts for nothing."""

    state: Path
    run: str

    def read(self) -> SimulationSettings:
        """Return what this run has set; nothing where it is not there or makes no sense."""
        try:
            document = read_object(self.state / _FILE)
            return restore_settings(document["set"]) if document["run"] == self.run else SimulationSettings()
        except (OSError, ValueError, KeyError, TypeError):
            return SimulationSettings()

    def write(self, settings: SimulationSettings) -> None:
        """Keep these, all or nothing. OSError where the directory takes none."""
        part = self.state / f"{_FILE}.part"
        part.write_text(json.dumps({"run": self.run, "set": dict(settings.values)}), encoding="utf-8")
        part.replace(self.state / _FILE)
