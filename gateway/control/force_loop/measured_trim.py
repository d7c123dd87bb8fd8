"""The trim of a rig whose response is measured: an integral of the force error that cannot hurt.

It learns once the transient of the last movement is nearly over, by the model of dead time and lags, from the error that is
left when what is on its way has come. It corrects the target, in newtons, at the pace of
gateway.control.force_loop.response_timing; volts are
made of that by the model, whose slide turns round with target and correction together: behind a turn friction has to be
overcome first, and a correction needs more volts than along a branch. Within the dead zone it rests, and having begun to
correct it goes on to a third of it, so that an error is not left at the zone's edge. The zone is a share of the rig's, for
the stiction that a rig's zone is for is in the model here, but never less than what the noise of the cell makes of a
smoothed error.

What was learned belongs to the force and to the direction in which it was reached: friction is off the other way after a turn.
So it fades within SAME_WAY_N of travel on and within OTHER_WAY_N of travel back, but no faster than the target goes back: a
force that is lowered would rise first. It comes back with the target. Only what was
learned with the same sign in both directions, an offset of that range of forces, outlives a turn.

A supervisor watches for hunting: corrections that change sign again and again at one target are friction's (or the
world's), not the model's. Each makes the zone wider and the pace slower; after MOST_TURNS the trim stands still until the
target has moved by more than NEW_TARGET_N, and says so. A correction that has stood at its limit was not friction's, but that
of air that failed and came back, or the like: the count begins anew. One that only touched it counts, for a trim may swing
from limit to limit. The same behind a turn that has come later than a trim of that pace takes to go round: supply air that
comes and goes once a minute, or the warmth of a day. And where the trim turned round it may stand wrong: an error of one sign
for STOOD_S, wider than the zone has become, is corrected again. Fewer turns may have been disturbances that came and went:
behind them an error of one sign for STOOD_S need only be wider than the zone was at first. Either takes twice as long each
further time at one target, until it takes LONGEST_PATIENCE_S.
"""

from math import exp, sqrt
from typing import Final

from gateway.control.force_loop.response_timing import HELD_S
from gateway.control.limits import trim_limited
from gateway.control.settings import LoopTiming, Trim
from gateway.registers.words import LimitedBy

SMOOTHING_S: Final = 0.10
LEAST_SEEN_S: Final = 0.04  # of an error, before it is believed
SIGMAS: Final = 3.5  # of the smoothed error's noise: the least zone
ZONE_SHARE: Final = 0.5  # of the rig's dead zone
LEFT_SHARE: Final = 0.33  # of the zone, at which a correction ends
NOISE_S: Final = 2.0  # over which the noise is estimated
NOISY_N: Final = (
    0.6  # from here on a noise that has ceased is forgotten at once: its zone would keep the force out of band
)
LATELY_SAMPLES: Final = 10.0
CEASED: Final = 3.0  # times what the last samples had, squared
WIDER: Final = 1.5  # zone after each turn
SLOWER: Final = 0.6  # pace after each turn
MOST_TURNS: Final = 5
HUNTS_S: Final = 10.0  # at full pace: between two turns of what hunts
STOOD_S: Final = 2.0
LONGEST_PATIENCE_S: Final = 30.0  # a constant force is one target for hours, and much disturbs it meanwhile
AT_LIMIT_S: Final = (
    0.5  # and AT_LIMIT_PACES times what the trim takes for a correction: longer than a swing stays there
)
AT_LIMIT_PACES: Final = 2.0
NEW_TARGET_N: Final = 1.0
SAME_WAY_N: Final = 10.0  # steps the same way err alike: friction yields more to a fast slide than to a ladder's stairs
OTHER_WAY_N: Final = 1.0


class MeasuredTrim:
    """value_n: the correction of the target, N; value_v: what that has come to in volts, told by whoever asked the model;
    limited_by: whether it stands at its limit; hunted: it stands still because its corrections kept changing sign;
    blocked_way: as gateway.control.force_loop.trim says."""

    def __init__(self, settings: Trim, timing: LoopTiming) -> None:
        self._settings, self.blocked_way = settings, 0
        self._timing = timing
        self._noise_n2 = self._lately_n2 = self._known_s = 0.0
        self._same_way_n = min(SAME_WAY_N, settings.memory_n)
        self._before_n: float | None = None
        self._smooth_n = self._seen_s = self._interval_s = 0.0
        self._way = self._last_way = self._turns = 0
        self._at_limit_s, self._stood_s, self._patience_s = 0.0, 0.0, STOOD_S  # at_limit_s: since it turned last
        self._since_turn_s = 0.0
        self.reset()

    @property
    def is_off(self) -> bool:
        """Decide whether the trim has no gain."""
        return self._settings.gain_v_per_n_s <= 0.0

    @property
    def limit_v(self) -> float:
        """Largest correction, V; 0 where there is none."""
        return 0.0 if self.is_off else self._settings.limit_v

    @property
    def has_hunted(self) -> bool:
        """Decide whether the trim has turned round too often."""
        return self._turns >= MOST_TURNS

    @property
    def noise_n(self) -> float:
        """Noise of one sample as it has shown so far, N."""
        return sqrt(self._noise_n2)

    def reset(self) -> None:
        """Forget the correction and what was smoothed, and the turns."""
        self._at_n = self._turned_n = 0.0  # of the target: now, and where it was furthest on its way
        self._going = self._going_then = 1
        self.forget()
        self._calm()

    def forget(self) -> None:
        """Forget the correction, for contact is lost: it was of a force that has gone. The turns are remembered."""
        self.value_n = self.value_v = 0.0
        self.limited_by = LimitedBy.NONE
        self._learned_n = self._learned_at_n = self._own_n = 0.0
        self._common_n = self._common_at_n = 0.0
        self._by_way_n = {1: 0.0, -1: 0.0}
        self._rest()

    def resume(self, value_n: float) -> None:
        """Go on from a correction that another trim has learned."""
        self.value_n = self._own_n = self._learned_n = value_n

    def retime(self, settings: Trim, timing: LoopTiming) -> None:
        """Go on with another rig's settings and pace: correction and noise are newtons, whatever model and lags are."""
        self._settings, self._timing = settings, timing
        self._same_way_n = min(SAME_WAY_N, settings.memory_n)

    def take_volts(self, value_v: float) -> float:
        """Return what the correction asks for, within the limit of the rig."""
        self.value_v, limited_by = trim_limited(value_v, self._settings.limit_v)
        if limited_by or not self.value_v:  # newtons at their limit that make no volts are not what limits the output
            self.limited_by = limited_by
        return self.value_v

    def travel(self, moved_n: float) -> None:
        """Fade what was learned: the applied target moved by so much, N."""
        if not moved_n:
            return
        self._at_n += moved_n
        if self._going * (self._at_n - self._turned_n) > 0.0:
            self._turned_n = self._at_n
        elif abs(self._at_n - self._turned_n) > NEW_TARGET_N:
            self._keep_common()
            self._going, self._turned_n = -self._going, self._at_n
        if abs(self._at_n - self._calm_at_n) > NEW_TARGET_N:
            self._calm()
        self._recall()

    def _keep_common(self) -> None:
        """At a turn: what both directions agree on."""
        self._by_way_n[self._going] = self.value_n
        up_n, down_n = self._by_way_n[1], self._by_way_n[-1]
        agreed_n = min(abs(up_n), abs(down_n)) if up_n * down_n > 0.0 else 0.0
        self._common_n, self._common_at_n = agreed_n if up_n > 0.0 else -agreed_n, self._learned_at_n
        self._own_n = self._learned_n - self._common_n

    def _common_here_n(self) -> float:
        return self._common_n * exp(-abs(self._at_n - self._common_at_n) / self._same_way_n)

    def _recall(self) -> None:
        """What is left of the correction here."""
        if not (self._own_n or self._common_n):
            return
        away_n = self._going_then * (self._at_n - self._learned_at_n)
        reach_n = self._same_way_n if away_n >= 0.0 else max(OTHER_WAY_N, abs(self._own_n))
        self.value_n = self._common_here_n() + self._own_n * exp(-abs(away_n) / reach_n)
        self.limited_by = LimitedBy.NONE

    def rest(self) -> None:
        """Forget what was smoothed, for nothing may be learned now: it belongs to another moment."""
        self._rest()

    def integrate(self, error_n: float, slope_n_per_v: float, interval_s: float) -> None:
        """Learn from one new sample. error_n: wanted minus what is measured and still comes; slope_n_per_v:
        of the model at the working point, which tells the limit in newtons."""
        if self.is_off:
            return
        self._smooth(error_n, interval_s)
        self._since_turn_s += interval_s
        zone_n = self._zone_n()
        if self.has_hunted:
            self._stand(zone_n, interval_s)
            return
        if self._turns and not self._way:
            self._stand(zone_n / WIDER**self._turns, interval_s)
        if self._smooth_n * self.blocked_way > 0.0:
            self._way = 0
        elif abs(self._smooth_n) > zone_n and self._seen_s >= LEAST_SEEN_S:
            self._turn(1 if self._smooth_n > 0.0 else -1)
        elif self._way * self._smooth_n < LEFT_SHARE * zone_n:
            self._way = 0
        if not self._way:
            return
        self._at_limit_s += interval_s if self.limited_by is not LimitedBy.NONE else 0.0
        pace_per_s = self._pace_per_s(interval_s) * SLOWER**self._turns
        wanted_n = self.value_n + pace_per_s * error_n * interval_s
        self.value_n, self.limited_by = trim_limited(wanted_n, self._settings.limit_v * slope_n_per_v)
        self._learned_n, self._learned_at_n, self._going_then = self.value_n, self._at_n, self._going
        self._own_n = self.value_n - self._common_here_n()

    def _pace_per_s(self, interval_s: float) -> float:
        """What is learned from one sample shows in the next: samples that are far apart slow the integral down."""
        return 1.0 / (1.0 / self._timing.integral_per_s + max(0.0, interval_s - HELD_S))

    def _turn(self, way: int) -> None:
        if way != self._last_way:
            is_slow = self._since_turn_s > HUNTS_S / SLOWER**self._turns
            is_first = not self._last_way or is_slow or self._has_stood_at_limit()
            self._turns = 0 if is_first else self._turns + 1
            self._at_limit_s = self._since_turn_s = 0.0
        self._way = self._last_way = way

    def _has_stood_at_limit(self) -> bool:
        return self._at_limit_s > max(AT_LIMIT_S, AT_LIMIT_PACES / self._timing.integral_per_s)

    def _stand(self, zone_n: float, interval_s: float) -> None:
        """Stand still behind turns, unless what is left is an offset: then they are forgotten."""
        way = 1 if self._smooth_n > 0.0 else -1
        is_offset = abs(self._smooth_n) > WIDER * zone_n and way * self._stood_s >= 0.0
        self._stood_s = self._stood_s + way * interval_s if is_offset else 0.0
        if abs(self._stood_s) > self._patience_s:
            patience_s = min(LONGEST_PATIENCE_S, 2.0 * self._patience_s)
            self._calm()
            self._patience_s = patience_s

    def _smooth(self, error_n: float, interval_s: float) -> None:
        if self._before_n is not None:
            self._known_s = min(NOISE_S, self._known_s + interval_s)  # the mean at first, then forgetting
            self._estimate_noise(0.5 * (error_n - self._before_n) ** 2, interval_s / self._known_s)
            behind_s = min(SMOOTHING_S, self._seen_s)  # the mean at first, then forgetting
            self._smooth_n += (error_n - self._smooth_n) * interval_s / (behind_s + interval_s)
        else:
            self._smooth_n = error_n
        self._interval_s, self._before_n = interval_s, error_n
        self._seen_s += interval_s

    def _estimate_noise(self, now_n2: float, share: float) -> None:
        self._noise_n2 += share * (now_n2 - self._noise_n2)
        self._lately_n2 += max(share, 1.0 / LATELY_SAMPLES) * (now_n2 - self._lately_n2)
        self._noise_n2 = min(self._noise_n2, max(NOISY_N**2, CEASED * self._lately_n2))

    def _zone_n(self) -> float:
        smoothed = sqrt(self._noise_n2 * min(1.0, self._interval_s / min(2.0 * SMOOTHING_S, self._seen_s)))
        return float(max(ZONE_SHARE * self._settings.dead_zone_n, SIGMAS * smoothed) * WIDER**self._turns)

    def _rest(self) -> None:
        self._way, self._seen_s, self._before_n = 0, 0.0, None

    def _calm(self) -> None:
        self._turns = self._last_way = 0
        self._at_limit_s = 0.0
        self._stood_s, self._patience_s = 0.0, STOOD_S
        self._calm_at_n = self._at_n
