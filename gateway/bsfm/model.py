"""The model that control asks: force and blend state in, volts and status out; and the calibration that it is made from."""

from dataclasses import dataclass

from gateway.bsfm.branches import Branches
from gateway.bsfm.curve import RationalBezier
from gateway.bsfm.inverse import Status
from gateway.bsfm.reversal import LinearBlend


@dataclass(frozen=True, slots=True)
class Bsfm:
    """Two increasing branches and what happens between them. ValueError if a branch has no inverse."""

    branches: Branches
    reversal: LinearBlend

    def __post_init__(self) -> None:
        if not (self.branches.rising.is_increasing() and self.branches.falling.is_increasing()):
            raise ValueError("both branches must increase: force could not be inverted to voltage")

    def voltage_v(self, force_n: float, state: float) -> tuple[float, Status]:
        """Feedforward V = (1+s)/2 V_rise(f) + (1-s)/2 V_fall(f) for the blend state s in [-1, 1].

        The status is that of the branches that take part; LOW or HIGH if either is clamped. ValueError for NaN.
        """
        rising_share = 0.5 + 0.5 * _checked(state)
        if rising_share == 1.0:
            return self.branches.rising.inverse(force_n)
        falling_v, falling_status = self.branches.falling.inverse(force_n)
        if rising_share == 0.0:
            return falling_v, falling_status
        rising_v, rising_status = self.branches.rising.inverse(force_n)
        status = falling_status if rising_status is Status.OK else rising_status
        return falling_v + rising_share * (rising_v - falling_v), status

    def force_n(self, voltage_v: float, state: float) -> float:
        """Expected force: the branches' forces at this voltage, shared by the blend state.

        Exactly the inverse of `voltage_v` at s = -1 and 1 only. Between, the voltages are blended there and the forces
        here, which differ by a fraction of the loop's width: enough for a residual, and it needs no iteration.
        """
        rising_share = 0.5 + 0.5 * _checked(state)
        rising_n, falling_n = self.branches.rising.value(voltage_v), self.branches.falling.value(voltage_v)
        return falling_n + rising_share * (rising_n - falling_n)

    @property
    def force_range_n(self) -> tuple[float, float]:
        """Forces that both branches reach."""
        rising, falling = self.branches.rising.handles, self.branches.falling.handles
        return max(rising[0], falling[0]), min(rising[-1], falling[-1])

    @property
    def voltage_range_v(self) -> tuple[float, float]:
        return self.branches.rising.x0, self.branches.rising.x1


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """An immutable numbered calibration, as stored: plain values, so that YAML and registers can carry it."""

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

    def model(self) -> Bsfm:
        """The model of these coefficients. ValueError with a sentence if they are none."""
        arrays = (self.rising_handles_n, self.rising_weights, self.falling_handles_n, self.falling_weights)
        if any(len(array) != self.order + 1 for array in arrays):
            raise ValueError(
                f"calibration {self.name}: order {self.order} needs {self.order + 1} handles and weights per branch"
            )
        rising = RationalBezier(self.x0_v, self.x1_v, self.rising_handles_n, self.rising_weights)
        falling = RationalBezier(self.x0_v, self.x1_v, self.falling_handles_n, self.falling_weights)
        return Bsfm(Branches(rising, falling), LinearBlend(self.blend_span_n))


def _checked(state: float) -> float:
    if not -1.0 <= state <= 1.0:
        raise ValueError(f"blend state {state!r}: -1 .. 1 is allowed")
    return state
