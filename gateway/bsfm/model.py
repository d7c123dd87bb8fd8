"""The model that control asks: force and branch share in, volts and status out; and the calibration that it is made from.

The branch share s in [-1, 1] says where between the branches the plant is; the reversal's memory gives it.
A calibration names its reversal by its fields: slip stops where `slip_radii_v` has any, else the linear blend over
`blend_span_n`, which is kept beside stops too: it is what is left of the set for a master that cannot carry them.
"""

from dataclasses import dataclass
from math import isfinite
from typing import Final

from gateway.bsfm.branches import Branches
from gateway.bsfm.curve import RationalBezier
from gateway.bsfm.inverse import OK, InverseStatus
from gateway.bsfm.slip.reversal import LinearBlend, Memory, Reversal
from gateway.bsfm.slip.slip_stops import SlipStops

_ROUNDS: Final = 100
_CLOSE_V: Final = 1.0e-14


@dataclass(frozen=True, slots=True)
class Bsfm:
    """Two increasing branches and what happens between them. ValueError if a branch has no inverse, or no voltage is unique.

    limits_n: forces that whoever made the set allows, None for all that the rig allows. Control holds to them.
    """

    branches: Branches
    reversal: Reversal
    limits_n: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not (self.branches.rising.is_increasing() and self.branches.falling.is_increasing()):
            raise ValueError("both branches must increase: force could not be inverted to voltage")
        self.reversal.check(self.branches)

    def memory_after(self, memory: Memory, from_n: float, to_n: float) -> Memory:
        """Return the reversal's memory after the force has gone from one value to another in one direction."""
        return self.reversal.memory_after(self.branches, memory, from_n, to_n)

    def branch_share(self, memory: Memory) -> float:
        """Return s of this memory, for the functions below."""
        return self.reversal.branch_share(memory)

    def voltage_v(self, force_n: float, branch_share: float) -> tuple[float, InverseStatus]:
        """Return the feedforward voltage, V = (1+s)/2 V_rise(f) + (1-s)/2 V_fall(f) for the branch share s in [-1, 1].

        The status is that of the branches that take part; LOW or HIGH if either is clamped. ValueError for NaN.
        """
        rising_share = 0.5 + 0.5 * _check_share(branch_share)
        if rising_share == 1.0:
            return self.branches.rising.inverse(force_n)
        falling_v, falling_status = self.branches.falling.inverse(force_n)
        if rising_share == 0.0:
            return falling_v, falling_status
        rising_v, rising_status = self.branches.rising.inverse(force_n)
        status = falling_status if rising_status is OK else rising_status
        return falling_v + rising_share * (rising_v - falling_v), status

    def force_n(self, voltage_v: float, branch_share: float) -> float:
        """Return the expected force, N: the branches' forces at this voltage, mixed by the branch share.

        Exactly the inverse of `voltage_v` at s = -1 and 1 only. Between, the voltages are blended there and the forces
        here, which differ by a fraction of the loop's width: enough for a residual, and it needs no iteration. The exact
        inverse is `settled_n`.
        """
        rising_share = 0.5 + 0.5 * _check_share(branch_share)
        rising_n, falling_n = self.branches.rising.value(voltage_v), self.branches.falling.value(voltage_v)
        return falling_n + rising_share * (rising_n - falling_n)

    def branch_forces_n(self, voltage_v: float) -> tuple[float, float]:
        """Return `force_n` at the branch shares 1 and -1, N."""
        rising_n, falling_n = self.branches.rising.value(voltage_v), self.branches.falling.value(voltage_v)
        return falling_n + (rising_n - falling_n), falling_n

    def branch_slopes_n_per_v(self, voltage_v: float) -> tuple[float, float]:
        """Return how steep the rising and the falling branch are at this voltage, N/V."""
        return self.branches.rising.slope(voltage_v), self.branches.falling.slope(voltage_v)

    def settled_n(self, voltage_v: float, branch_share: float) -> float:
        """Return the force whose `voltage_v` at this branch share is this voltage: bracketed Newton between the branches."""
        rising, falling = self.branches.rising, self.branches.falling
        share = 0.5 + 0.5 * _check_share(branch_share)
        low_n, high_n = sorted((rising.value(voltage_v), falling.value(voltage_v)))
        force_n = self.force_n(voltage_v, branch_share)
        for _ in range(_ROUNDS):
            rising_v, falling_v = rising.inverse(force_n)[0], falling.inverse(force_n)[0]
            gap_v = falling_v + share * (rising_v - falling_v) - voltage_v
            low_n, high_n = (low_n, force_n) if gap_v > 0.0 else (force_n, high_n)
            steepness = min(rising.slope(rising_v), falling.slope(falling_v))
            next_n = 0.5 * (low_n + high_n)
            if steepness > 0.0:
                newton_n = force_n - gap_v / (share / rising.slope(rising_v) + (1.0 - share) / falling.slope(falling_v))
                next_n = newton_n if low_n < newton_n < high_n else next_n
            if abs(gap_v) <= _CLOSE_V or next_n == force_n:
                break
            force_n = next_n
        return force_n

    @property
    def force_range_n(self) -> tuple[float, float]:
        """Forces that both branches reach."""
        rising, falling = self.branches.rising.handles, self.branches.falling.handles
        return max(rising[0], falling[0]), min(rising[-1], falling[-1])

    @property
    def voltage_range_v(self) -> tuple[float, float]:
        """Lowest and highest voltage of the branches."""
        return self.branches.rising.x0, self.branches.rising.x1


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """How the plant follows a voltage, as a calibration measured it: dead time, then two first-order lags in series, in
    seconds; second_lag_s 0 where one lag explains it. damping: below 1 where the plant rings, of a pair of complex poles whose
    mean delay is the sum of both lags (gateway.bsfm.response.second_order); 0 where it does not. source: from which data, with
    what spread."""

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012  read by pydantic in gateway.profiles
    dead_time_s: float
    lag_s: float
    second_lag_s: float = 0.0
    damping: float = 0.0
    source: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """An immutable numbered calibration, as stored: plain values, so that YAML and registers can carry it.

    slip_radii_v, slip_shares: empty for the linear blend over blend_span_n. force_limits_n: lowest and highest force that
    the set may be used for, as uploaded; empty where nothing but the branches' reach and the rig bounds it. response: None
    where it was not measured. rms_n, max_n: on all measured points, partial reversals included. noise_n: standard deviation
    of one reading while the command rests, 0 where it was not measured. rejected: why it is not offered for use, empty where
    it is.
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012  read by pydantic in gateway.profiles
    number: int
    name: str
    order: int
    x0_v: float
    x1_v: float
    rising_handles_n: tuple[float, ...]
    rising_weights: tuple[float, ...]
    falling_handles_n: tuple[float, ...]
    falling_weights: tuple[float, ...]
    blend_span_n: float
    rms_n: float
    max_n: float
    date_utc: str
    source: str
    rig: str
    data_sha256: str
    slip_radii_v: tuple[float, ...] = ()
    slip_shares: tuple[float, ...] = ()
    force_limits_n: tuple[float, ...] = ()
    response: Response | None = None
    rejected: str = ""
    noise_n: float = 0.0

    @property
    def reversal(self) -> Reversal:
        """The policy between the branches: slip stops where the set has them, else the linear blend."""
        if self.slip_radii_v or self.slip_shares:
            return SlipStops(self.slip_radii_v, self.slip_shares)
        return LinearBlend(self.blend_span_n)

    @property
    def kind(self) -> str:
        """Which of the four models its coefficients are, and the order: `bsfm n=2`."""
        one_curve = (self.rising_handles_n, self.rising_weights) == (self.falling_handles_n, self.falling_weights)
        polynomial = len({*self.rising_weights, *self.falling_weights}) == 1
        return f"{'p' if polynomial else 'b'}{'' if one_curve else 's'}fm n={self.order}"

    @property
    def reversal_kind(self) -> str:
        """`slip, 8 stops` or `blend 12.7 N`."""
        return f"slip, {len(self.slip_radii_v)} stops" if self.slip_radii_v else f"blend {self.blend_span_n:.3g} N"

    @property
    def allowed_n(self) -> tuple[float, float]:
        """The set's own force limits, else what both branches reach."""
        if self.force_limits_n:
            return self.force_limits_n[0], self.force_limits_n[-1]
        rising, falling = self.rising_handles_n, self.falling_handles_n
        return max(rising[0], falling[0]), min(rising[-1], falling[-1])

    def model(self) -> Bsfm:
        """Return the model of these coefficients. ValueError with a sentence if they are none."""
        arrays = (self.rising_handles_n, self.rising_weights, self.falling_handles_n, self.falling_weights)
        if any(len(array) != self.order + 1 for array in arrays):
            raise ValueError(
                f"calibration {self.name}: order {self.order} needs {self.order + 1} handles and weights per branch"
            )
        rising = RationalBezier(self.x0_v, self.x1_v, self.rising_handles_n, self.rising_weights)
        falling = RationalBezier(self.x0_v, self.x1_v, self.falling_handles_n, self.falling_weights)
        return Bsfm(Branches(rising, falling), self.reversal, self._limits_n())

    def _limits_n(self) -> tuple[float, float] | None:
        if not self.force_limits_n:
            return None
        if len(self.force_limits_n) != 2 or not all(map(isfinite, self.force_limits_n)):
            raise ValueError(f"force limits {self.force_limits_n}: none, or lowest and highest force in N")
        low_n, high_n = self.force_limits_n
        if low_n >= high_n:
            raise ValueError(f"force limits {low_n:g} .. {high_n:g} N: the highest must be above the lowest")
        return low_n, high_n


def _check_share(branch_share: float) -> float:
    if not -1.0 <= branch_share <= 1.0:
        raise ValueError(f"branch share {branch_share!r}: -1 .. 1 is allowed")
    return branch_share
