"""The control process's part in `sim`: it judges what is asked, so that it is audited, before the simulated rig does it."""

from typing import Any

from gateway.profiles import Rig
from gateway.service.simulation.settings import SimulationSettings
from gateway.service.socket_requests import SimulationRequest, parse_request


class SimulationRequests:
    """Answers {"do": "sim", ...} of control.sock; the tools then ask the same of rig.sock, where the simulated rig listens."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return which rig it is. ValueError: E132, E133, and E134 for a real one."""
        query = parse_request(SimulationRequest, request)
        if not self._rig.simulated:
            raise ValueError(
                f"E134 rig {self._rig.name} is a real one: only a simulated rig can be set "
                f"(`force-gateway run {self._rig.name} --sim`)"
            )
        SimulationSettings().changed(query).check(self._rig)
        return {"rig": self._rig.name}
