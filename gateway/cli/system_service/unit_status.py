"""How a unit is, in one sentence, from what `systemctl show` says of it."""

from dataclasses import dataclass
from typing import Any, Final

from gateway.cli.system_service.installation import run_command

_ASKED: Final = "LoadState,ActiveState,SubState,ActiveEnterTimestamp,NRestarts,StatusText,Result,ExecMainStatus"


@dataclass(frozen=True, slots=True)
class UnitStatus:
    """unit: its name; properties: as systemd names them (org.freedesktop.systemd1(5))."""

    unit: str
    properties: dict[str, str]

    @property
    def is_running(self) -> bool:
        """Decide whether it runs."""
        return self.properties.get("ActiveState") == "active"

    @property
    def facts(self) -> dict[str, Any]:
        """The same for programs; properties that systemd has not told are empty."""
        known = self.properties
        return {
            "unit": self.unit,
            "running": self.is_running,
            "state": known.get("ActiveState", ""),
            "since": known.get("ActiveEnterTimestamp", ""),
            "restarts": int(known.get("NRestarts") or 0),
            "status": known.get("StatusText", ""),
            "result": known.get("Result", ""),
            "exit_code": int(known.get("ExecMainStatus") or 0),
        }

    @property
    def sentence(self) -> str:
        """The line for people."""
        known = self.properties
        if known.get("LoadState") == "not-found":
            return f"{self.unit}: there is no such unit; force-gateway service install RIG writes it"
        restarts = int(known.get("NRestarts") or 0)
        again = f", started again {restarts} time{'' if restarts == 1 else 's'}" if restarts else ""
        if self.is_running:
            return f"{self.unit}: runs since {known.get('ActiveEnterTimestamp')}{again}; {known.get('StatusText')}"
        why = known.get("Result", "")
        ended = f", exit code {known['ExecMainStatus']}" if why == "exit-code" else ""
        return f"{self.unit}: {known.get('ActiveState')} ({why}{ended}){again}; force-gateway service logs shows why"


def parse_status(unit: str, text: str) -> UnitStatus:
    """Return the status in what `systemctl show` has printed: NAME=VALUE lines."""
    return UnitStatus(unit, dict(line.split("=", 1) for line in text.splitlines() if "=" in line))


def read_status(unit: str) -> UnitStatus:
    """Ask systemd. CliError E108 where it does not answer."""
    return parse_status(unit, run_command(("systemctl", "show", unit, f"--property={_ASKED}")))
