"""The whole control process in virtual time, with a force held, while it is asked for all that is stored: on any disk."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from gateway.calibrations.store import CalibrationStore
from gateway.plants.store import PlantStore
from gateway.profiles import load_calibration
from gateway.service.running_rig.running_rig import RunningRig
from tests.disk.watched_disk import WatchedDisk, watching
from tests.plants.test_plant_store import numbered
from tests.simulation.healing import HELD_N, heal
from tests.simulation.kernel.edges import NotedRunningRig, SimulatedDisk, simulated_edges
from tests.simulation.schedule import Simulation

STEP_S = 0.2
ASKED: tuple[dict[str, Any], ...] = (
    {"do": "record", "on": True, "name": "a day"},
    {"do": "calibration", "use": 1001},
    {"do": "record", "on": False},
    {"do": "record", "on": True},
    {"do": "calibration", "use": 1002},
    {"do": "calibration", "rollback": True},
    {"do": "plant", "use": 1},
    {"do": "record", "on": False},
)


def prepare(state: Path) -> None:
    """Two calibrations and a plant that can be taken into use."""
    demo = load_calibration("demo")
    store = CalibrationStore(state, replace(demo, number=1000))
    for share in (1.01, 1.02):
        low_n, middle_n, high_n = demo.rising_handles_n
        store.add(replace(demo, rising_handles_n=(low_n, share * middle_n, high_n)))
    PlantStore(state).add(numbered())


class Day:
    """One day of a gateway on a state directory. answers: what was said to each request, "error" where it was refused."""

    def __init__(self, state: Path, seed: int = 5) -> None:
        self.state = state
        self.simulation = Simulation(seed, state)
        SimulatedDisk.delay_s = staticmethod(lambda: 0.005)
        self._holder = "worker"
        self.answers: list[dict[str, Any]] = []
        self.outcomes: list[dict[str, Any]] = []

    @property
    def running(self) -> RunningRig:
        return NotedRunningRig.of[-1]

    @property
    def said(self) -> list[str]:
        """All that it has told people."""
        return [text for _, text in self.simulation.log.lines]

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """As the control socket does it."""
        handler = self.running._control_socket._handlers[request["do"]]
        inside = self.simulation.service.inside
        assert inside is not None
        answers: list[dict[str, Any]] = []

        def take(read: Callable[[], dict[str, Any]]) -> None:
            try:
                answers.append(read())
            except (ValueError, OSError) as error:
                answers.append({"error": str(error)})

        def answer() -> None:
            try:
                given = handler({key: value for key, value in request.items() if key != "do"})
            except (ValueError, OSError) as error:
                answers.append({"error": str(error)})
                return
            if isinstance(given, Future):
                given.add_done_callback(lambda done: take(done.result))
            else:
                answers.append(given)

        inside.call_soon(answer)
        self.simulation._run_for(STEP_S)
        return answers[0]

    def begin(self) -> None:
        """Start, and hold a force."""
        self.simulation._run_for(1.5)
        self.simulation.masters["worker"].hold(HELD_N)
        self.simulation._run_for(1.0)

    def work(self) -> None:
        """Ask for one thing after the other."""
        for request in ASKED:
            if request["do"] == "plant":  # a change of it waits until nothing presses
                self.simulation.masters[self._holder].let_go()
                self.simulation._run_for(1.5)
            self.answers.append(self.ask(request))
            self.outcomes.append(self.ask({"do": request["do"]}))

    def end(self) -> list[str]:
        """Hold a force once more, and say what was broken."""
        heal(self.simulation)
        self._holder = "healer"
        service = self.simulation.service
        broken = [*self.simulation.observer.broken, *self.simulation.masters["worker"].complaints]
        broken += [f"{service.births - 1} deaths of control"] if service.births > 1 else []
        return broken + self.simulation.log.internal_errors


@contextmanager
def a_day(state: Path, disk: WatchedDisk, *, from_the_start: bool) -> Iterator[Day]:
    """A day on this disk; from_the_start: it is so already when control starts, else from the first request on."""
    with simulated_edges():
        day = Day(state)
        with day.simulation.clock.as_the_kernels():
            try:
                if from_the_start:
                    with watching(disk):
                        day.begin()
                        day.work()
                else:
                    day.begin()
                    with watching(disk):
                        day.work()
                yield day
            finally:
                day.simulation.close()
