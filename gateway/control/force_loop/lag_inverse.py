"""The lags of the plant as a calibration has measured them, inverted nearly as fast as range and slew allow.

As the lead of the rig file (gateway.control.force_loop.lead_compensator), this carries a model of the two lags behind the
voltage that really stood on the output, and asks for what brings the model to the wish. But how fast is not one number.
With a horizon h the law is that of a second-order system of natural frequency 1/h and damping DAMPING, whether the plant's
own poles are real or complex. The shortest horizon is used from which the push
and the brake that must follow it both stay within what the output can do: two pulses of length h that bring the model from
where it is to rest at the wish. So a small step is nearly over when the dead time is, a large one runs along the limits, and
none is pushed harder than it can be braked; a step from 0 V, where there is little to brake with, is the example.

The shortest horizon of all is a share of the lags: a shorter one gains little and asks for more than the output's wire,
which carries one setting at a time, can follow.

Where the command map bends, all that is reckoned in linearized volts (gateway.bsfm.drive_map) and asked for in volts as sent:
LinearizedLagInverse.
"""

from dataclasses import replace
from functools import lru_cache
from math import exp, inf, pi, sqrt
from typing import Final, NamedTuple

from gateway.bsfm.drive_map import DriveMap
from gateway.bsfm.model import Bsfm
from gateway.bsfm.response.second_order import SecondOrder, Transition
from gateway.control.limits import TICK_S
from gateway.control.settings import Limits

SHORTEST_S: Final = 0.02
FAST_PERIODS: Final = 0.7  # the same for short lags, which let go of what is wrong by themselves
PERIODS: Final = 1.0  # of the wire, that a horizon must have
WIRE_S: Final = 0.03  # that one setting keeps the wire, until it is known
SLOWEST_WIRE_S: Final = 0.1  # a later answer was a hitch
LATE_S: Final = 0.005  # by which a decision that waited for the wire is old
SHARE: Final = 0.12  # of the sum of the lags
DAMPING: Final = 0.9
UNKEPT_DAMPING: Final = 1.4  # on a way down, where the shorter lag lets go before the setting that brakes it ends
KEPT_DAMPING: Final = 0.5  # by which less is needed for each time of the wire that the shorter lag is long
MOST_DAMPING: Final = 1.2
FAR_V: Final = 0.6  # above the wish, from which on it is a step that is braked, and not a ramp that is followed
GROWTH: Final = 1.2  # from one horizon to the next
HORIZONS: Final = 20
SLEW_SHARE: Final = 0.7  # of h: how far the slew takes the output in a pulse that it has to fill
BRAKE_S: Final = 0.03  # of slew: as far from the wish as a brake may take the output, which has to come back
SLOW_S: Final = 0.02  # and SLOW_WIRES times the wire's time, at most SLOWEST_S: of lags that are shorter in sum
SLOW_WIRES: Final = 2.5  # a push that lasts one setting is most of the way, and the linear law alone is used
SLOWEST_S: Final = 0.1
EQUAL_V: Final = 1.0e-3  # below what an output can resolve: no push, the wish itself
LEAST_LAG_S: Final = 1.0e-3
HALF_SWING_SHARE: Final = 0.6  # of half a period of a plant that rings: after a whole one two pulses do the same


class Pulses(NamedTuple):
    """Two pulses of horizon_s from a state to rest. By what the states' distances count for the first pulse and for the
    second: up = a1 e1 + a2 e2, down = b1 e1 + b2 e2, all distances to the wish."""

    horizon_s: float
    a1: float
    a2: float
    b1: float
    b2: float


class LagInverse:
    """first_v, second_v: where the model's lags are."""

    def __init__(self, lags: SecondOrder, limits: Limits) -> None:
        self._plant = lags = _sort_lags(lags)
        self._lag_s, self._second_lag_s = lags.lag_s, lags.second_lag_s if lags.second_lag_s >= LEAST_LAG_S else 0.0
        self.first_v = self.second_v = limits.safe_voltage_v
        self._limits = limits
        self._lags_s = lags_s = 2.0 * lags.natural_s if lags.is_ringing else lags.lag_s + self._second_lag_s
        self._is_slow, self._damping, self._falling_damping = True, DAMPING, DAMPING
        longest_s = _longest_horizon_s(lags)
        self._horizons = [
            SHORTEST_S * GROWTH**k for k in range(HORIZONS) if k == 0 or SHORTEST_S * GROWTH**k < longest_s
        ]
        if self._second_lag_s:
            self._later = _transitions(lags, lags_s)
            self._pulses = _pulses_of(lags, tuple(self._horizons))
        self._wire_s = inf
        self.set_wire_time(WIRE_S)

    def set_wire_time(self, wire_s: float) -> None:
        """Set how long one setting keeps the wire, s: what is decided meanwhile waits. nan: not known."""
        if not abs(wire_s - self._wire_s) > LATE_S:
            return
        self._wire_s = wire_s = min(wire_s, SLOWEST_WIRE_S)
        self._is_slow = self._lags_s >= min(SLOWEST_S, SLOW_S + SLOW_WIRES * wire_s)
        self._damping = DAMPING if self._is_slow else 1.0
        self._falling_damping = max(DAMPING, self._braking_damping(wire_s)) if self._is_slow else self._damping
        least_s = max(SHARE * self._lags_s, PERIODS * wire_s + LATE_S) if self._is_slow else FAST_PERIODS * wire_s
        if not self._second_lag_s:  # it follows at once: a setting that outlasts its horizon goes beyond the wish
            least_s = wire_s + LATE_S + TICK_S
        self._first = next((k for k, at_s in enumerate(self._horizons) if at_s >= least_s), len(self._horizons) - 1)
        self.horizon_s = self._horizons[self._first]
        self._decay = exp(-self.horizon_s / self._lag_s)

    def _braking_damping(self, wire_s: float) -> float:
        """What a way down needs: its brake goes up, late by the slew, and is kept for a whole setting."""
        kept = self._second_lag_s / wire_s if wire_s > 0.0 else 1.0
        return min(MOST_DAMPING, UNKEPT_DAMPING - KEPT_DAMPING * kept)

    @property
    def landing_s(self) -> float:
        """Delay of the model behind the wish where no limit acts, s."""
        return 2.0 * self._damping * self.horizon_s if self._second_lag_s else self.horizon_s

    def advance(self, voltage_v: float, dt_s: float) -> None:
        """Advance the model of the lags: voltage_v stood on the output for the last dt_s. Exact for a held voltage."""
        first_v, second_v = self.first_v - voltage_v, self.second_v - voltage_v
        if not first_v and not second_v:
            return  # at rest, as most of the time
        if not self._second_lag_s:
            self.first_v = self.second_v = voltage_v + exp(-dt_s / self._lag_s) * first_v
            return
        first_v, second_v = _move(self._plant.after(dt_s), first_v, second_v)
        self.first_v, self.second_v = voltage_v + first_v, voltage_v + second_v

    def compensated_v(self, wanted_v: float, standing_v: float) -> float:
        """Return the voltage to ask for now, V. standing_v: on the output. A wish outside the range passes."""
        lowest_v = min(self._limits.voltage_min_v, wanted_v)
        highest_v = max(self._limits.voltage_max_v, wanted_v)
        first_v, second_v = self.first_v - wanted_v, self.second_v - wanted_v
        if self._second_lag_s:
            asked_v = self._two(first_v, second_v, wanted_v, (lowest_v, highest_v, standing_v))
        else:
            asked_v = wanted_v - first_v * self._decay / (1.0 - self._decay)
        return wanted_v if abs(asked_v - wanted_v) < EQUAL_V else max(lowest_v, min(highest_v, asked_v))

    def _two(self, first_v: float, second_v: float, wanted_v: float, room: tuple[float, float, float]) -> float:
        """Two lags: the linear law where its pulses stay within the room, else along the limits and back."""
        if not self._is_slow:
            return wanted_v + self._linear(first_v, second_v)
        lowest_v, highest_v, standing_v = room
        reach_v = BRAKE_S * self._limits.voltage_slew_v_per_s
        deepest_v, steepest_v = max(lowest_v, wanted_v - reach_v), min(highest_v, wanted_v + reach_v)
        asked_v = wanted_v
        for k, pulses in enumerate(self._pulses[self._first :]):
            up_v = pulses.a1 * first_v + pulses.a2 * second_v
            brake_v = wanted_v + pulses.b1 * first_v + pulses.b2 * second_v
            asked_v = wanted_v + (self._linear(first_v, second_v) if k == 0 else up_v)
            rise_v = SLEW_SHARE * pulses.horizon_s * self._limits.voltage_slew_v_per_s
            is_rising, pushed_v = up_v > 0.0, wanted_v + up_v
            if is_rising:
                low_v, high_v = deepest_v, highest_v
            else:
                low_v, high_v = lowest_v, min(steepest_v, max(lowest_v, pushed_v) + rise_v)
            if lowest_v <= pushed_v <= min(highest_v, standing_v + rise_v) and low_v <= brake_v <= high_v:
                return asked_v
            if k == 0:
                push_v, stop_v = (highest_v, deepest_v) if is_rising else (lowest_v, steepest_v)
                if self._may_push(first_v, second_v, push_v - wanted_v, stop_v - wanted_v):
                    return push_v
        return asked_v

    def _may_push(self, first_v: float, second_v: float, push_v: float, brake_v: float) -> bool:
        """Whether after one more tick along the limit the brake still stops it short of the wish. All as distances to the wish.
        A brake upwards comes as late as the slew makes its middle."""
        way = 1.0 if push_v > 0.0 else -1.0
        if way * second_v >= 0.0:
            return False
        rises_s = 0.0 if way > 0.0 else 0.5 * (brake_v - push_v) / self._limits.voltage_slew_v_per_s
        first_v, second_v = _move(
            self._plant.after(self._wire_s + LATE_S + rises_s), first_v - push_v, second_v - push_v
        )
        first_v, second_v = first_v + push_v - brake_v, second_v + push_v - brake_v
        later = (brake_v + moved.ss * second_v + moved.sf * first_v for moved in self._later)
        return way * (second_v + brake_v) < 0.0 and all(way * at_v < 0.0 for at_v in later)

    def _linear(self, first_v: float, second_v: float) -> float:
        """The second-order law of the shortest horizon, as a distance to the wish."""
        speed = (first_v - second_v) / self._second_lag_s
        far = min(1.0, max(0.0, second_v / FAR_V))
        damping = self._damping + far * (self._falling_damping - self._damping)
        bend = -(second_v / self.horizon_s + 2.0 * damping * speed) / self.horizon_s
        return second_v + self._plant.delay_s * speed + self._plant.bend_s2 * bend


def _sort_lags(lags: SecondOrder) -> SecondOrder:
    """The longer first, and equal ones a little apart: the general form is 0/0 for them."""
    if lags.is_ringing:
        return replace(lags, lag_s=0.5 * lags.delay_s, second_lag_s=0.5 * lags.delay_s)
    longer_s, shorter_s = sorted((lags.lag_s, lags.second_lag_s), reverse=True)
    if shorter_s > (1.0 - 1.0e-3) * longer_s:
        longer_s, shorter_s = 1.0005 * longer_s, 0.9995 * shorter_s
    return SecondOrder(longer_s, shorter_s)


def _longest_horizon_s(lags: SecondOrder) -> float:
    return HALF_SWING_SHARE * pi * lags.natural_s / sqrt(1.0 - lags.damping**2) if lags.is_ringing else inf


def _move(by: Transition, first_v: float, second_v: float) -> tuple[float, float]:
    return by.ff * first_v + by.fs * second_v, by.sf * first_v + by.ss * second_v


@lru_cache(maxsize=16)  # a controller makes three of the same lags, and one more with each calibration that it takes
def _transitions(lags: SecondOrder, lags_s: float) -> tuple[Transition, ...]:
    """Return where what has been pushed goes by itself, at moments that are the rarer the later they are."""
    return tuple(lags.after(0.06 * lags_s * 1.35**k) for k in range(12))


@lru_cache(maxsize=16)
def _pulses_of(lags: SecondOrder, horizons_s: tuple[float, ...]) -> tuple[Pulses, ...]:
    return tuple(_pulses(lags, horizon_s) for horizon_s in horizons_s)


def _pulses(lags: SecondOrder, horizon_s: float) -> Pulses:
    """Both states at rest after 2 horizons: two equations, linear in the two pulses."""
    once, twice = lags.after(horizon_s), lags.after(2.0 * horizon_s)
    late = 1.0 - once.ff - once.fs, 1.0 - once.sf - once.ss  # what the second pulse has done by the end
    early = _move(once, *late)  # and the first
    by = 1.0 / (early[0] * late[1] - early[1] * late[0])
    return Pulses(
        horizon_s,
        by * (late[0] * twice.sf - late[1] * twice.ff),
        by * (late[0] * twice.ss - late[1] * twice.fs),
        by * (early[1] * twice.ff - early[0] * twice.sf),
        by * (early[1] * twice.fs - early[0] * twice.ss),
    )


class LinearizedLagInverse:
    """The same for a bent command map. The range is bent like the volts; the slew is taken as it is, for it is the same on
    average. first_v, second_v: where the model's lags are, in volts that would keep them there."""

    def __init__(self, lags: SecondOrder, limits: Limits, model: Bsfm | None = None) -> None:
        self._limits = limits
        self._map = scale = DriveMap(model)
        self._held = (0.0, scale.linear_v(0.0))  # the last voltage, as sent and linearized
        self._inverse = LagInverse(
            lags,
            replace(
                limits,
                voltage_min_v=scale.linear_v(limits.voltage_min_v),
                voltage_max_v=scale.linear_v(limits.voltage_max_v),
                safe_voltage_v=scale.linear_v(limits.safe_voltage_v),
            ),
        )

    @property
    def first_v(self) -> float:
        """State of the first lag, V."""
        return self._map.volts(self._inverse.first_v)

    @property
    def second_v(self) -> float:
        """State of the second lag, V."""
        return self._map.volts(self._inverse.second_v)

    def away_n(self, wanted_v: float) -> float:
        """Return by how much the thrust of the model's lags is short of the wish's, N."""
        return (self._map.linear_v(wanted_v) - self._inverse.second_v) * self._map.n_per_v

    def go_on_from(self, first_v: float, second_v: float) -> None:
        """Take over from another model of the lags."""
        self._inverse.first_v, self._inverse.second_v = self._map.linear_v(first_v), self._map.linear_v(second_v)

    def set_wire_time(self, wire_s: float) -> None:
        """Set how long one setting keeps the wire, s; nan: not known."""
        self._inverse.set_wire_time(wire_s)

    def advance(self, voltage_v: float, dt_s: float) -> None:
        """Advance the model of the lags: voltage_v stood on the output for the last dt_s."""
        if voltage_v != self._held[0]:
            self._held = (voltage_v, self._map.linear_v(voltage_v))
        self._inverse.advance(self._held[1], dt_s)

    def compensated_v(self, wanted_v: float, standing_v: float) -> float:
        """Return the voltage to ask for now, V. standing_v: on the output. A wish outside the range passes."""
        linear_v = self._map.linear_v(wanted_v)
        asked_v = self._inverse.compensated_v(linear_v, self._map.linear_v(standing_v))
        return wanted_v if asked_v == linear_v else self._map.volts(asked_v)
