"""The twin: regulator, slide and load cell in series, advanced in fixed steps of 1 ms.

Pressure does not feel the slide: the regulator's own loop (tens of ms) holds it against the volume change of a pad that
gives 1 mm, and no figure of the paper shows otherwise. Time and chance are arguments: `advance(dt_s)` and `seed`.
"""

import math
from typing import Final

from numpy.random import default_rng

from gateway.twin.contact import ContactState
from gateway.twin.friction import place_asymmetry_n, place_limit_n, side_load_n, side_share
from gateway.twin.load_cell import LoadCellState
from gateway.twin.moving_slide import MovingSlide
from gateway.twin.plant import Plant, plain
from gateway.twin.regulator import RegulatorState
from gateway.twin.surroundings import Surroundings, TwinConditions

STEP_S: Final = 1.0e-3
_ROUNDING: Final = 1.0e-6  # of a step: ten times 0.001 s are ten steps
_FROM_TIME_0: Final = ("drift_n_per_s", "warm_up_n", "warm_up_s", "clock_offset_s", "clock_skew")
"""Of the load cell: what acts by the time that it has been there."""
_STROKE_SHARE: Final = 0.5  # of the full scale: presses every friction element over, whatever the plant


class Twin:
    """A simulated rig."""

    def __init__(self, plant: Plant, seed: int) -> None:
        """Start at rest, without air pressure, at time 0."""
        self.plant = plain(plant)
        self._seed = seed
        self.reset()

    def reset(self) -> None:
        """Go back to the start: state, time, faults and noise."""
        self._conditions = TwinConditions(command_v=0.0)
        self._regulator = RegulatorState(self.plant.regulator, STEP_S)
        self._slide = MovingSlide(self.plant, STEP_S)
        self._contact = ContactState(self.plant.contact, STEP_S, self._conditions)
        self._cell = LoadCellState(self.plant.cell, STEP_S)
        self._cell.select_active_effects(self._conditions)
        self._rng = default_rng(self._seed)
        self._steps = self._began = 0
        self._owed_steps = 0.0
        self._reading: float | None = None

    def press_and_vent(self) -> None:
        """Move on to a machine that has worked before: pressed once and vented, time and noise as they were.

        A new machine's friction holds nothing yet; one that was vented keeps its pad pressed by what friction holds, and
        needs less for the next force. A pad that hangs above the workpiece has nothing to keep.
        """
        if self.plant.contact.gap_m <= 0.0:
            self._slide.press_and_vent(_STROKE_SHARE * self.plant.regulator.full_scale_pa)

    def change_plant(self, plant: Plant) -> None:
        """Go on as another plant from now on: what moves goes on from where it is, and remembers what it did.

        Friction that grows does not push, a pad that begins to creep has not crept yet, and where a drift, the warm-up or the
        cell's clock is changed, these three begin now.
        """
        before, self.plant = self.plant.cell, plain(plant)
        begins = any(getattr(before, name) != getattr(self.plant.cell, name) for name in _FROM_TIME_0)
        if begins:
            self._began = self._steps
        self._conditions.time_s = (self._steps - self._began) * STEP_S
        self._regulator.change_regulator(self.plant.regulator)
        self._slide.change_plant(self.plant)
        self._contact.change_contact(self.plant.contact, self._slide.force_n)
        self._cell.change_cell(self.plant.cell, begins=begins)
        self._feel_surroundings()
        self._slide.hold_friction()
        self._reading = None

    def go_on_from(self, before: "Twin") -> None:
        """Take over, at the start, the cell's time of the twin whose place this one takes: its drift and warm-up go on."""
        passed = before._steps - before._began
        self._began = self._steps - passed
        self._conditions.time_s = passed * STEP_S
        self._cell.begin_at(passed)

    def command(self, voltage_v: float) -> None:
        """Apply a command voltage, V; it holds until the next one. ValueError when it is not finite."""
        if not math.isfinite(voltage_v):
            raise ValueError(f"command {voltage_v} V is not finite")
        self._regulator.command(voltage_v)
        self._conditions.command_v = voltage_v

    def advance(self, dt_s: float) -> None:
        """Let time pass. Parts of a step are kept for the next call, so that only the sum counts."""
        if not 0.0 <= dt_s < math.inf:
            raise ValueError(f"time advances by a finite dt_s >= 0, not by {dt_s}")
        self._owed_steps += dt_s / STEP_S
        steps = int(self._owed_steps + _ROUNDING)
        if not steps:
            return
        self._owed_steps -= steps
        regulator, slide, cell = self._regulator.step, self._slide.step, self._cell.step
        if self._contact.is_on:
            self._advance_contact(steps)
        else:
            for _ in range(steps):
                cell(slide(regulator()))
        self._steps += steps
        self._reading = None

    def _advance_contact(self, steps: int) -> None:
        """The same with effects of contact and tool, which look at the time and at the surroundings."""
        regulator, slide, contact, cell = self._regulator.step, self._slide.step, self._contact.step, self._cell.step
        conditions = self._conditions
        turn_rad = 0.0 if conditions.spindle_rpm is None else conditions.spindle_rpm * (2.0 * math.pi / 60.0 * STEP_S)
        passed = self._steps - self._began
        for step in range(passed + 1, passed + steps + 1):
            conditions.time_s = step * STEP_S
            conditions.spindle_rad = conditions.spindle_rad + turn_rad
            cell(contact(slide(regulator())))

    def read(self) -> float:
        """Return a reading of the load cell now, N: each call draws new noise."""
        self._conditions.time_s = (self._steps - self._began) * STEP_S
        self._reading = reading = self._cell.read(self._rng, self._conditions)
        return reading

    @property
    def measured_n(self) -> float:
        """The reading of this moment, N: the last `read`, or a new one when time has passed since."""
        return self.read() if self._reading is None else self._reading

    @property
    def time_s(self) -> float:
        """Time since the start."""
        return (self._steps + self._owed_steps) * STEP_S

    @property
    def pressure_pa(self) -> float:
        """Gauge pressure in the cylinder."""
        return self._regulator.pressure_pa

    @property
    def force_n(self) -> float:
        """True contact force, without cell, noise or sign."""
        return self._contact.force_n if self._contact.is_on else self._slide.force_n

    @property
    def friction_n(self) -> float:
        """Friction on the slide, positive against motion outward."""
        return self._slide.state.friction_n

    @property
    def position_m(self) -> float:
        """Travel of the slide from its back stop."""
        return self._slide.state.position_m

    @property
    def speed_m_per_s(self) -> float:
        """Speed of the slide, positive outward."""
        return self._slide.speed_m_per_s

    def set_surface(self, height_m: float) -> None:
        """Set the height of the workpiece under the pad, m towards the tool; 0 is null.

        Feed under the tool is a series of heights. ValueError when not finite.
        """
        if not math.isfinite(height_m):
            raise ValueError(f"surface height {height_m} m is not finite")
        self._slide.set_surface(height_m)

    def set_surroundings(self, around: Surroundings) -> None:
        """Set temperature, supply, spindle, feed, tilt and place, which hold until the next ones. None: not known.

        The position is taken from where its effects are nothing. ValueError when a value is not finite.
        """
        self._conditions.update(around)
        self._feel_surroundings()

    def _feel_surroundings(self) -> None:
        self._regulator.supply_kpa = self._conditions.supply_kpa
        friction = self.plant.friction
        load_n = side_load_n(friction, self._conditions) + place_limit_n(friction, self._conditions)
        share, more_out_n = side_share(friction, self._conditions), place_asymmetry_n(friction, self._conditions)
        self._slide.set_side_load(load_n, share, more_out_n)
        self._contact.select_active_effects(self._slide.force_n)
        self._cell.select_active_effects(self._conditions)

    def set_disturbance(self, force_n: float) -> None:
        """Set an outside force on the slide, N towards the workpiece (a spindle's vibration); 0 is null.

        It holds until the next one. ValueError when not finite.
        """
        if not math.isfinite(force_n):
            raise ValueError(f"disturbance {force_n} N is not finite")
        self._slide.set_disturbance(force_n)

    def set_air(self, on: bool) -> None:
        """Switch the air supply on or off, which is a fault: the pressure falls with the regulator's lag."""
        self._regulator.air = on

    def set_contact(self, on: bool) -> None:
        """Take the workpiece away, or bring it back: a fault."""
        self._slide.set_contact(on)

    def set_sign(self, sign: int) -> None:
        """Set the wires of the load cell swapped (-1), a fault, or right (+1). ValueError for another sign."""
        if sign not in (-1, 1):
            raise ValueError(f"sign is -1 or +1, not {sign}")
        self._cell.sign = float(sign)
