"""The plants of the rig that runs: which one it starts with, and taking another one into use while it runs.

What is compensated changes the reading and the voltage at once, which under force would be a step. So a change waits for the
output to be disabled, and is told then; it is on the disk before, so that a restart finds it. Reading and writing happen in
a thread: the loop waits for no disk.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gateway.numbered_documents.store import StoreError
from gateway.plain_file import tell_place_and_refusal
from gateway.plants.in_use import with_plant_in_use
from gateway.plants.store import PlantStore
from gateway.processes.disk_worker import DiskWorker, Done, Work, keep_end
from gateway.profiles import Rig
from gateway.profiles.rigs.compensated_effects import compensation_words
from gateway.service.socket_requests import PlantRequest, parse_request

Log = Callable[[str, str], None]
_WAITS: Final = "from the moment the output is disabled: under force the change would be a step"


@dataclass(frozen=True, slots=True)
class PlantEdges:
    """How a change reaches the control. is_free: whether it may now; on_use: takes the rig as it is from now on; on_failure:
    told what was accepted and came to nothing, and why."""

    is_free: Callable[[], bool]
    on_use: Callable[[Rig], None]
    clock: Callable[[], float]
    log: Log
    on_failure: Log = lambda what, sentence: None


class RigPlants:
    """rig: with the plant in use; notes: what was passed over to find it."""

    def __init__(self, rig: Rig, state: Path) -> None:
        self._own = rig
        self._store = PlantStore(state)
        selected = self._store.find_selected()
        self.rig = with_plant_in_use(rig, selected.document)
        self.notes = selected.notes
        self._thread = DiskWorker()
        self.run_in_background: Callable[[Work, Done], None] = self._thread
        self._waiting: Rig | None = None
        self._doing, self._outcome, self._has_failed, self._jobs = "", "", False, 0
        self._ends: dict[str, dict[str, Any]] = {}
        self._since_s = 0.0

    def serve(self, edges: PlantEdges) -> None:
        """Take changes from now on."""
        self._edges = edges
        self._since_s = edges.clock()

    def close(self) -> None:
        """Begin nothing more; what is under way ends on the disk as it would have."""
        self._thread.close()

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """Answer a request: {"use": number} (0: the rig's own) or {"rollback": true} begin a change; neither tells what is in
        use and how the last change went. ValueError while another is under way."""
        query = parse_request(PlantRequest, request)
        if query.rollback or query.use is not None:
            if self._doing:
                raise ValueError(f"{self._doing} is under way: try again when it has ended")
            self._jobs += 1
            self._doing = "plant rollback" if query.rollback else f"plant use {query.use}"
            self.run_in_background(lambda: self._select(query), self._on_selected)
        return self.status()

    def status(self) -> dict[str, Any]:
        """Return number and name of the plant in use, since when (monotonic s), which one waits, and how the last job went.
        ends: of the jobs before as well."""
        in_use, waiting = self.rig.plant_in_use, self._waiting
        return {
            "active": in_use.number if in_use else 0,
            "name": in_use.profile.name if in_use else "",
            "since_s": self._since_s,
            "waiting": None if waiting is None else waiting.plant_in_use.number if waiting.plant_in_use else 0,
            "job": self._jobs,
            "busy": bool(self._doing),
            "said": self._outcome,
            "failed": self._has_failed,
            "ends": self._ends,
        }

    def take_waiting(self) -> None:
        """Put into effect what waits, once nothing presses any more; called every tick."""
        if self._waiting is not None and self._edges.is_free():
            rig, self._waiting = self._waiting, None
            self._take(rig)

    def _select(self, query: PlantRequest) -> Rig:
        number = self._store.previous().number if query.rollback else query.use
        plant = self._store.load(number) if number else None
        self._store.use(number or None, last_one_waits=self._waiting is not None)
        return with_plant_in_use(self._own, plant)

    def _on_selected(self, result: Any) -> None:
        doing, self._doing = self._doing, ""
        self._has_failed = isinstance(result, Exception)
        if isinstance(result, StoreError):
            self._outcome = f"{result}; {_plant(self.rig)} stays in use"
        elif isinstance(result, OSError):
            self._outcome = f"E431 {tell_place_and_refusal(result)}; {_plant(self.rig)} stays in use"
        elif isinstance(result, Exception):
            self._outcome = f"A499 internal error, please report it: {result!r}; {_plant(self.rig)} stays in use"
        else:
            self._waiting = result
            self.take_waiting()
            when = f"will be in use {_WAITS}" if self._waiting else "is in use"
            doubts = result.plant_in_use.doubts if result.plant_in_use else ""
            words = (f"{_plant(result)} {when}", *compensation_words(result.compensation), doubts)
            self._outcome = "; ".join(filter(None, words))
        keep_end(self._ends, self._jobs, said=self._outcome, failed=self._has_failed)
        if self._has_failed:
            self._edges.on_failure(doing, self._outcome)
        self._edges.log("plant", f"{doing}: {self._outcome}")

    def _take(self, rig: Rig) -> None:
        self.rig, self._since_s = rig, self._edges.clock()
        self._edges.on_use(rig)
        self._edges.log("plant", f"{_plant(rig)} in use")


def _plant(rig: Rig) -> str:
    in_use = rig.plant_in_use
    return f"plant {in_use.number} ({in_use.profile.name})" if in_use else "the rig's own plant"
