"""Straighten the command map: what must be sent so that a bent regulator does what a straight one would.

A bent regulator acts as if it heard  u + bow 4 u (1 - u) + s 8 u (1 - u) (2 u - 1), u = v / full scale (the twin's
command-nonlinearity). A model that was calibrated on a straight map keeps its volts; `sent_v` bends them on their way out.
"""

from dataclasses import dataclass
from typing import Final

from gateway.bsfm import Bsfm, InverseStatus

_ROUNDS: Final = 30
_CLOSE_V: Final = 1.0e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandMap:
    """bow, s: shares of the full scale, as in a plant's `regulator`."""

    bow: float
    s: float
    full_scale_v: float = 10.0

    def straight_v(self, sent_v: float) -> float:
        """Return what the regulator makes of a voltage; outside 0 .. full scale the voltage itself."""
        share = sent_v / self.full_scale_v
        if not 0.0 < share < 1.0:
            return sent_v
        middle = 4.0 * share * (1.0 - share)
        return sent_v + self.full_scale_v * middle * (self.bow + self.s * 2.0 * (2.0 * share - 1.0))

    def sent_v(self, straight_v: float) -> float:
        """Return what to send for it: bracketed secant steps, as the bent map may be flat at an end."""
        if not 0.0 < straight_v < self.full_scale_v:
            return straight_v
        low_v, high_v, sent_v = 0.0, self.full_scale_v, straight_v
        for _ in range(_ROUNDS):
            off_v = self.straight_v(sent_v) - straight_v
            if abs(off_v) < _CLOSE_V:
                break
            low_v, high_v = (low_v, sent_v) if off_v > 0.0 else (sent_v, high_v)
            stepped_v = sent_v - off_v / max(0.2, self.slope(sent_v))
            sent_v = stepped_v if low_v < stepped_v < high_v else 0.5 * (low_v + high_v)
        return sent_v

    def slope(self, sent_v: float) -> float:
        """Return by how much more the regulator makes of one volt more."""
        share = sent_v / self.full_scale_v
        if not 0.0 < share < 1.0:
            return 1.0
        bowed = 4.0 * self.bow * (1.0 - 2.0 * share)
        return 1.0 + bowed + 8.0 * self.s * (-1.0 + 6.0 * share - 6.0 * share * share)


@dataclass(frozen=True, slots=True)
class SentBsfm(Bsfm):
    """A model of straight volts as control needs it: volts as they are sent. command None: the model itself."""

    command: CommandMap | None = None

    def __post_init__(self) -> None:
        """The inner model was proven when it was made; the loop has no time to prove it again."""

    def voltage_v(self, force_n: float, branch_share: float) -> tuple[float, InverseStatus]:
        """Return the voltage to send for a force, V, through the command map, and how it was found."""
        voltage_v, status = Bsfm.voltage_v(self, force_n, branch_share)
        return self.command.sent_v(voltage_v) if self.command else voltage_v, status

    def force_n(self, voltage_v: float, branch_share: float) -> float:
        """Return the force at a voltage that was sent, N."""
        return Bsfm.force_n(self, self._straight_v(voltage_v), branch_share)

    def branch_forces_n(self, voltage_v: float) -> tuple[float, float]:
        """Return `force_n` at the branch shares 1 and -1, N."""
        return Bsfm.branch_forces_n(self, self._straight_v(voltage_v))

    def branch_slopes_n_per_v(self, voltage_v: float) -> tuple[float, float]:
        """Return how steep the branches are at a voltage that was sent, N/V."""
        rising, falling = Bsfm.branch_slopes_n_per_v(self, self._straight_v(voltage_v))
        bend = self.command.slope(voltage_v) if self.command else 1.0
        return bend * rising, bend * falling

    def settled_n(self, voltage_v: float, branch_share: float) -> float:
        """Return the force that comes to rest at a voltage that was sent, N."""
        straight = Bsfm(self.branches, self.reversal)
        return straight.settled_n(self._straight_v(voltage_v), branch_share)

    @property
    def voltage_range_v(self) -> tuple[float, float]:
        """Voltages on the wire, V, between which the model's rising branch lies."""
        low_v, high_v = self.branches.rising.x0, self.branches.rising.x1
        return (self.command.sent_v(low_v), self.command.sent_v(high_v)) if self.command else (low_v, high_v)

    def _straight_v(self, voltage_v: float) -> float:
        return self.command.straight_v(voltage_v) if self.command else voltage_v


def apply_command_map(model: Bsfm, command: CommandMap | None) -> Bsfm:
    """Return the model with its volts as they are sent; the same object where the map is straight."""
    if command is None:
        return model
    return SentBsfm(model.branches, model.reversal, model.limits_n, command)
