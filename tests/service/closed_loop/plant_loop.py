"""A machine that is not the plant of its rig, driven by the whole gateway in virtual time, and recorded as the gateway does."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gateway.plants.in_use import with_plant_in_use
from gateway.plants.store import NumberedPlant
from gateway.profiles import Rig
from gateway.recording import Recording, list_recordings, read_recording
from gateway.registers.words import State
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.twin.plant import with_value
from tests.disk.at_once import AtOnce
from tests.service.rigs import demo
from tests.service.wired import ENABLE, Wired

LEVELS_N = (10.0, 25.0, 15.0, 35.0, 20.0, 8.0, 30.0)
HOLD_S = 1.5


@dataclass(frozen=True)
class Machine:
    """hidden: numbers of the real plant that the rig's file does not know, by section__field."""

    state: Path
    hidden: dict[str, float]
    seed: int = 7

    def wired(self, plant: NumberedPlant | None) -> Wired:
        """The gateway with this plant in use, before the machine as it really is; not yet enabled."""
        rig = with_plant_in_use(demo(), plant)
        wired = Wired(rig, seed=self.seed)
        really = self.really(rig)
        wired.world._change_plant(really)
        wired.twin = wired.world.twin
        return wired

    def really(self, rig: Rig):
        assert rig.plant
        plant = rig.plant
        for path, value in self.hidden.items():
            plant = with_value(plant, *path.split("__"), value)
        return plant

    def record(self, plant: NumberedPlant | None, rounds: int = 1) -> Recording:
        """Work for some rounds under command and record it in the state directory."""
        wired = self.wired(plant).ready()
        recordings = Recordings(self.state / "recordings", wired.rig, _Log(), AtOnce())
        recordings.start()
        wired.loop.recordings = recordings
        work(wired, rounds)
        recordings.flush(1e9)
        recordings.stop()
        return read_recording(list_recordings(self.state)[-1].path)


def work(wired: Wired, rounds: int = 1, seed: int = 1) -> None:
    """Hold the levels in another order in each round."""
    rng = np.random.default_rng(seed)
    for _ in range(rounds):
        for level_n in rng.permutation(LEVELS_N):
            wired.write(0, ENABLE, round(100 * level_n))
            wired.run(HOLD_S)
    assert wired.state in (State.HOLDING, State.RAMPING), wired.show()


def numbered(profile, number: int, provenance) -> NumberedPlant:
    return NumberedPlant(number=number, profile=replace(profile, name=f"plant-{number}"), provenance=provenance)


class _Log:
    def __call__(self, cause: str, sentence: str) -> None: ...
