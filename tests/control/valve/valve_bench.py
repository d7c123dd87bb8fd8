"""A rig with a directional valve, for the tests of bit 4."""

from dataclasses import replace

from gateway.control import Controller
from gateway.control.inputs import CalibrationInUse, Output, ValveStatus
from gateway.control.settings import ValveControl
from gateway.devices.valve_profile import ValveDirection
from gateway.registers.words import ControlBit, StatusBit
from tests.control.bench import Bench, bsfm, settings

PUSH, PULL = ValveDirection
ENABLE, BIT_4, NONE = ControlBit.ENABLE, ControlBit.VALVE_PULL, ControlBit(0)
SHARE = 0.75
MOVES_S = 0.05  # of the valve and its relay


class ValveBench(Bench):
    """A rig with a valve. stands: of the relay; obeys: whether it follows; switched: (s, contact force, voltage) of each
    move."""

    def __init__(self, stands: ValveDirection = PUSH, **valve: object) -> None:
        control = replace(settings(), valve=ValveControl(**{"pull_area_share": SHARE, **valve}))  # type: ignore[arg-type]
        super().__init__(control)
        self.controller = Controller(control, CalibrationInUse(bsfm(), 1))
        self.stands, self.obeys, self.is_silent = stands, True, False
        self.told: ValveDirection | None = stands
        self.told_s = self.silent_s = 0.0
        self.kept_v: float | None = None  # what a silent output is known to keep
        self.switched: list[tuple[float, float, float]] = []
        self.turn(stands)

    def turn(self, stands: ValveDirection) -> None:
        self.stands = stands
        self.plant.sign = -1.0 if stands is PULL else 1.0
        self.plant.gain_n_per_v = 7.4 * (SHARE if stands is PULL else 1.0)

    def step(self) -> Output:
        if self.obeys and self.told not in (None, self.stands) and self.now_s - self.told_s >= MOVES_S:
            self.switched.append((self.now_s, self.plant.force_n, self.voltage_v))
            self.turn(self.told)  # type: ignore[arg-type]
        since_s = self.silent_s if self.is_silent else None
        standing_v = self.kept_v if self.output_silent else self.voltage_v
        self.line = self.line._replace(valve=ValveStatus(self.stands, since_s), standing_v=standing_v)
        output = super().step()
        if output.valve is not self.told:
            self.told, self.told_s = output.valve, self.now_s
        return output

    def status(self) -> StatusBit:
        return self.last.status

    def pulling(self, force_n: float = 12.0) -> "ValveBench":
        self.run(1.0)
        self.write(control_word=ENABLE | BIT_4, force_setpoint_n=force_n)
        self.run(3.0)
        return self
