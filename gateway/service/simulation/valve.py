"""The simulated relay and the 5/2 valve behind it."""

from math import inf
from typing import Final

from gateway.devices import ValveDevice, ValveDirection
from gateway.devices.messages import Garbage
from gateway.profiles import Rig
from gateway.twin import Plant
from gateway.twin.plant import with_value

_VALVE_MOVES_S: Final = 0.03  # of a small solenoid valve with its relay
_FROM_OUTSIDE: Final = ("tilt_n", "feed_drag_n_s_per_mm", "feed_drag_n", "feed_drag_abs_n_s_per_mm")
_OF_THE_CELL: Final = (
    "zero_n",
    "zero_n_per_k",
    "warm_up_n",
    "drift_n_per_s",
    "quadratic_per_n",
    "hum_n",
    "crosstalk_n_per_v",
    "outlier_n",
)
"""What adds to a reading, or bends it, whichever way the tool acts; `sign` turns the whole reading round."""


class SimulatedValve:
    """The relay and the 5/2 valve behind it. is_cut: the wire is; is_stuck: the relay answers and nothing moves."""

    def __init__(self, rig: Rig) -> None:
        self._device = ValveDevice(rig.valve.device) if rig.valve else None
        self._share = rig.control.valve.pull_area_share if rig.control.valve else 1.0
        self._stands = self._told = ValveDirection.PUSH
        self._moves_s = inf
        self.is_cut = self.is_stuck = False

    @property
    def sign(self) -> float:
        """Sign of the force on the load cell: a pull is negative."""
        return -1.0 if self._stands is ValveDirection.PULL else 1.0

    def plant_of(self, plant: Plant) -> Plant:
        """Return the plant with the chamber that has the pressure: the rod takes a part of the other one's area, what presses
        from outside is against a pull, and the cell's own defects stay as they are."""
        if self._stands is ValveDirection.PUSH:
            return plant
        pulling = with_value(plant, "cylinder", "area_m2", plant.cylinder.area_m2 * self._share)
        for name in _FROM_OUTSIDE:
            pulling = with_value(pulling, "contact", name, -getattr(plant.contact, name))
        for name in _OF_THE_CELL:
            pulling = with_value(pulling, "cell", name, -getattr(plant.cell, name))
        return with_value(pulling, "contact", "tilt_deg", 180.0 - plant.contact.tilt_deg)

    def receive(self, chunk: bytes, now_s: float) -> bytes:
        """Return the answers to what these bytes ask."""
        answers = []
        for question in self._device.receive(chunk) if self._device else ():
            if isinstance(question, Garbage):
                continue
            if question is not None:
                self._told, self._moves_s = question, now_s + _VALVE_MOVES_S
            answers.append(self._device.reply(question, self._stands))  # type: ignore[union-attr]
        return b"" if self.is_cut else b"".join(answers)

    def move(self, now_s: float) -> bool:
        """Let time pass; return whether the valve has moved to the other direction now."""
        if self.is_stuck or now_s < self._moves_s:
            return False
        self._moves_s = inf
        has_moved, self._stands = self._stands is not self._told, self._told
        return has_moved
