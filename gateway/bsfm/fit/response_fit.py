"""How a plant follows a voltage, from the steps of a calibration run: dead time and one or two lags.

Fitted in linearized volts (gateway.bsfm.drive_map), because a regulator's lags carry what its command map has bent, and to the
recorded force, through the static model: of each stair the model gives the way from the settled force before to
the settled force after it, as voltages (so that neither a bent characteristic nor friction after a reversal passes for a
lag); both ends are the measured ones, so an error of the model's level does not matter. The voltage that has arrived is the
command's, delayed and lagged; what stands in the recording is taken as written when its row was, so the time that wire,
device and cell take is part of the dead time.

Two lags are taken where they predict the stairs that were held out better than one. The interval is that of the estimate
over whole stairs (a sandwich estimator), because errors within a stair are not independent.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.drive_map import DriveMap
from gateway.bsfm.ladder.settled_points import SAME_V, TAIL_SHARE
from gateway.bsfm.model import Bsfm, Response
from gateway.defaults import TICK_S

Floats = NDArray[np.float64]

LEAST_STEP_N: Final = 3.0  # smaller ones tell more of friction than of lags
NOISE_AT: Final = 12.0  # a step must be so many sigmas
FEWEST_STAIRS: Final = 6
FEWEST_ROWS: Final = 4
PATH_POINTS: Final = 25
RATIOS: Final = (0.0, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0)  # second lag over first
HUBER: Final = 1.5
LONGEST_S: Final = 2.0  # a lag or dead time beyond it is no response but drift
SHORTEST_LAG_S: Final = 1.0e-3
ROUNDS: Final = 12
MOST_MISSING: Final = 0.2  # of a step at its end, that is believed to come still
BETTER: Final = 0.985  # held-out error of two lags over one, from which the second is believed


@dataclass(frozen=True, slots=True, eq=False)
class Stair:
    """One step of the command, and what came back. changes: (seconds, volts by which the command went) of this step and of
    those before it whose effect may last; path_v, path_n: what the model makes of each voltage on the way."""

    time_s: Floats
    force_n: Floats
    changes: tuple[tuple[float, float], ...]
    end_v: float
    path_v: Floats
    path_n: Floats

    def expected_n(self, dead_time_s: float, lag_s: float, second_lag_s: float) -> Floats:
        """Return the force by the model, N, at the times of the readings."""
        arrived_v = np.full_like(self.time_s, self.end_v)
        for at_s, moved_v in self.changes:
            arrived_v -= moved_v * missing(self.time_s - at_s - dead_time_s, lag_s, second_lag_s)
        return np.interp(arrived_v, self.path_v, self.path_n)


def missing(since_s: Floats, lag_s: float, second_lag_s: float) -> Floats:
    """Share of a step that has not arrived yet behind two lags in series; 1 before it begins."""
    since_s = np.maximum(since_s, 0.0)
    if second_lag_s < SHORTEST_LAG_S:
        return np.exp(-since_s / lag_s)
    if abs(lag_s - second_lag_s) < 1.0e-4 * lag_s:
        return (1.0 + since_s / lag_s) * np.exp(-since_s / lag_s)
    slow, fast = lag_s * np.exp(-since_s / lag_s), second_lag_s * np.exp(-since_s / second_lag_s)
    return (slow - fast) / (lag_s - second_lag_s)


@dataclass(frozen=True, slots=True)
class MeasuredResponse:
    """response: None where it could not be measured; why_not: then the sentence."""

    response: Response | None
    why_not: str = ""

    @property
    def description(self) -> str:
        """What was found, or why nothing was."""
        return f"response: {self.response.source}" if self.response else self.why_not


def measure_response(
    time_s: Floats,
    command_v: Floats,
    force_n: Floats,
    model: Bsfm,
    slew_v_per_s: float = inf,
    when: str = "",
) -> MeasuredResponse:
    """Measure the response in the rows of a run. slew_v_per_s: how fast a command may rise, which the rows between do not
    show."""
    scale = DriveMap(model)
    stairs = [_linearize(stair, scale) for stair in _stairs(time_s, command_v, force_n, model, slew_v_per_s)]
    if len(stairs) < FEWEST_STAIRS:
        return MeasuredResponse(
            None,
            f"the response was not measured: {len(stairs)} steps of {LEAST_STEP_N:g} N or more with enough readings, "
            f"{FEWEST_STAIRS} are needed",
        )
    ratios = RATIOS[1:] if _is_better(stairs) else (0.0,)
    found = _fit_lags(stairs, ratios)
    again = _stairs(time_s, command_v, force_n, model, slew_v_per_s, found)  # whose ends had not quite settled
    stairs = [_linearize(stair, scale) for stair in again]
    found = _fit_lags(stairs, ratios)
    if not (0.0 <= found.dead_time_s < LONGEST_S and SHORTEST_LAG_S < found.lags_s < LONGEST_S):
        said = f"dead time {found.dead_time_s * 1e3:.0f} ms and lags of {found.lags_s * 1e3:.0f} ms in sum"
        return MeasuredResponse(
            None, f"the response was not measured: the steps give {said}, which no plant of this kind has"
        )
    return MeasuredResponse(_response_of(found, stairs, when))


def _linearize(stair: Stair, scale: DriveMap) -> Stair:
    """The same in volts that the plant's lags are linear in. Changes lead from one voltage to the next, so they are told
    from the last one backwards."""
    changes, after_v = [], stair.end_v
    for at_s, moved_v in reversed(stair.changes):
        before_v = after_v - moved_v
        changes.append((at_s, scale.linear_v(after_v) - scale.linear_v(before_v)))
        after_v = before_v
    path_v = np.array([scale.linear_v(volts) for volts in stair.path_v.tolist()])
    return replace(stair, changes=tuple(reversed(changes)), end_v=scale.linear_v(stair.end_v), path_v=path_v)


def _response_of(found: "_Fit", stairs: Sequence[Stair], when: str) -> Response:
    low_s, high_s = _interval(found, stairs)
    sizes = [abs(float(stair.path_n[-1] - stair.path_n[0])) for stair in stairs]
    both = f" and {found.second_s * 1e3:.0f}" if found.second_s else ""
    source = (
        f"{len(stairs)} steps of {min(sizes):.0f}-{max(sizes):.0f} N{when}: dead time {found.dead_time_s * 1e3:.0f} ms "
        f"[{low_s[0] * 1e3:.0f}, {high_s[0] * 1e3:.0f}], {'lags' if both else 'lag'} {found.lag_s * 1e3:.0f}{both} ms, in sum "
        f"{found.lags_s * 1e3:.0f} [{low_s[1] * 1e3:.0f}, {high_s[1] * 1e3:.0f}], {found.rms_n:.2f} N RMS on the way"
    )
    return Response(
        dead_time_s=round(max(0.0, found.dead_time_s), 5),
        lag_s=round(found.lag_s, 5),
        second_lag_s=round(found.second_s, 5),
        source=source,
    )


# -- the fit


@dataclass(frozen=True, slots=True)
class _Fit:
    dead_time_s: float
    lags_s: float
    ratio: float
    loss: float
    rms_n: float

    @property
    def lag_s(self) -> float:
        return self.lags_s / (1.0 + self.ratio)

    @property
    def second_s(self) -> float:
        return self.lags_s - self.lag_s


def _residuals(stairs: Sequence[Stair], dead_time_s: float, lags_s: float, ratio: float) -> list[Floats]:
    lag_s = lags_s / (1.0 + ratio)
    return [stair.force_n - stair.expected_n(dead_time_s, lag_s, lags_s - lag_s) for stair in stairs]


def _loss(residual_n: Floats, scale_n: float) -> float:
    size = np.abs(residual_n) / scale_n
    return float(np.sum(np.where(size < HUBER, 0.5 * size**2, HUBER * (size - 0.5 * HUBER))))


def _fit_lags(stairs: Sequence[Stair], ratios: Sequence[float]) -> _Fit:
    """The best of these ratios, refined between its neighbours."""
    scale_n = _scale_n(stairs)
    guess = _guess(stairs)
    found = []
    for ratio in ratios:
        found.append(_at_ratio(stairs, ratio, scale_n, guess))
        guess = (found[-1].dead_time_s, found[-1].lags_s)
    best = min(found, key=lambda fit: fit.loss)
    if len(ratios) > 1:
        best = _refine(stairs, ratios, best, scale_n)
    return best


def _refine(stairs: Sequence[Stair], ratios: Sequence[float], best: _Fit, scale_n: float) -> _Fit:
    at = list(ratios).index(best.ratio)
    near = (ratios[max(0, at - 1)], ratios[min(len(ratios) - 1, at + 1)])
    for ratio in (0.5 * (near[0] + best.ratio), 0.5 * (near[1] + best.ratio)):
        tried = _at_ratio(stairs, ratio, scale_n, (best.dead_time_s, best.lags_s))
        best = tried if tried.loss < best.loss else best
    return best


def _at_ratio(stairs: Sequence[Stair], ratio: float, scale_n: float, guess: tuple[float, float]) -> _Fit:
    """Dead time and sum of lags at this ratio, by damped Gauss-Newton with Huber weights."""
    place, damping = np.array(guess), 1.0e-3

    def residual(at: Floats) -> Floats:
        return np.concatenate(_residuals(stairs, float(at[0]), float(at[1]), ratio))

    error_n = residual(place)
    loss = _loss(error_n, scale_n)
    for _ in range(ROUNDS):
        slopes = _slopes(residual, place, error_n)
        weight = np.minimum(1.0, HUBER * scale_n / np.maximum(np.abs(error_n), 1.0e-12))
        normal = (slopes * weight[:, None]).T @ slopes
        step = np.linalg.solve(
            normal + damping * np.diag(np.diag(normal) + 1.0e-12), -(slopes * weight[:, None]).T @ error_n
        )
        tried = np.maximum(place + np.clip(step, -0.1, 0.1), (0.0, 2.0 * SHORTEST_LAG_S))
        tried_n = residual(tried)
        tried_loss = _loss(tried_n, scale_n)
        if tried_loss < loss:
            done = loss - tried_loss < 1.0e-5 * loss
            place, error_n, loss, damping = tried, tried_n, tried_loss, 0.3 * damping
            if done:
                break
        else:
            damping = 10.0 * max(damping, 1.0e-3)
    return _Fit(float(place[0]), float(place[1]), ratio, loss, float(np.sqrt(np.mean(error_n**2))))


def _slopes(residual: Callable[[Floats], Floats], place: Floats, error_n: Floats) -> Floats:
    by = 1.0e-3
    columns = [(residual(place + by * unit) - error_n) / by for unit in np.eye(2)]
    return np.stack(columns, axis=1)


def _scale_n(stairs: Sequence[Stair]) -> float:
    """Noise of a reading, from the settled end of the stairs; at least what a model is off on the way."""
    tails = [stair.force_n[-_tail(len(stair.force_n)) :] for stair in stairs]
    spread = [float(np.std(tail)) for tail in tails if len(tail) > 1]
    return max(0.05, float(np.median(spread)) if spread else 0.1)


def _guess(stairs: Sequence[Stair]) -> tuple[float, float]:
    """Dead time and lags by the times of 15 and 63 % of the way, medians over the stairs."""
    early: list[float] = []
    late: list[float] = []
    for stair in stairs:
        way = (stair.force_n - stair.path_n[0 if stair.changes[-1][1] > 0 else -1]) / (
            stair.path_n[-1] - stair.path_n[0]
        )
        since_s = stair.time_s - stair.changes[-1][0]
        for share, times in ((0.15, early), (0.63, late)):
            passed = np.flatnonzero(np.abs(way) >= share)
            times.append(float(since_s[passed[0]]) if len(passed) else float(since_s[-1]))
    rise_s = max(0.01, float(np.median(late)) - float(np.median(early)))
    return max(0.0, float(np.median(early)) - 0.2 * rise_s), 1.1 * rise_s


def _is_better(stairs: Sequence[Stair]) -> bool:
    """Do two lags predict stairs better that neither has seen?"""
    scale_n, single, double = _scale_n(stairs), 0.0, 0.0
    for fold in range(2):
        seen, held_out = stairs[fold::2], stairs[1 - fold :: 2]
        for ratios in ((0.0,), RATIOS[1:]):
            fit = _fit_lags(seen, ratios)
            loss = _loss(np.concatenate(_residuals(held_out, fit.dead_time_s, fit.lags_s, fit.ratio)), scale_n)
            single, double = (single + loss, double) if ratios == (0.0,) else (single, double + loss)
    return double < BETTER * single


def _interval(found: _Fit, stairs: Sequence[Stair]) -> tuple[Floats, Floats]:
    """95 % of dead time and sum of lags, the ratio held."""
    place = np.array([found.dead_time_s, found.lags_s])
    normal, spread = np.zeros((2, 2)), np.zeros((2, 2))
    for stair in stairs:

        def residual(at: Floats, one: Stair = stair) -> Floats:
            return _residuals([one], float(at[0]), float(at[1]), found.ratio)[0]

        error_n = residual(place)
        slopes = _slopes(residual, place, error_n)
        score = slopes.T @ error_n
        normal += slopes.T @ slopes
        spread += np.outer(score, score)
    inverse = np.linalg.pinv(normal)
    half = 1.96 * np.sqrt(np.maximum(0.0, np.diag(inverse @ spread @ inverse)))
    return place - half, place + half


# -- from rows to stairs


def _tail(rows: int) -> int:
    return max(2, round(TAIL_SHARE * rows))


def _stairs(
    time_s: Floats,
    command_v: Floats,
    force_n: Floats,
    model: Bsfm,
    slew_v_per_s: float,
    known: _Fit | None = None,
) -> list[Stair]:
    """known: lags by which the ends of the stairs are told that had not settled."""
    plateaus = _plateaus(time_s, command_v)
    found, memory = [], model.reversal.start()
    settled_n = [_mean_settled_n(force_n, plateau) for plateau in plateaus]
    if known:
        settled_n = _correct_ends(settled_n, plateaus, time_s, known)
    earlier: tuple[tuple[float, float], ...] = ()
    for k in range(1, len(plateaus)):
        before, now = plateaus[k - 1], plateaus[k]
        from_v, to_v = float(command_v[before.last]), float(command_v[now.last])
        changes = _changes(float(time_s[now.first]), from_v, to_v, slew_v_per_s)
        way = _way(model, memory, (from_v, to_v), (settled_n[k - 1], settled_n[k]))
        memory = model.memory_after(memory, settled_n[k - 1], settled_n[k])
        rows = slice(now.first + 1, now.end + 1)
        if way is not None and _tells(force_n[rows], settled_n[k - 1], settled_n[k]):
            kept = tuple(change for change in earlier if change[0] > time_s[now.first] - LONGEST_S)
            found.append(Stair(time_s[rows], force_n[rows], (*kept, *changes), to_v, *way))
        earlier = (*earlier, *changes)[-40:]
    return found


@dataclass(frozen=True, slots=True)
class _Plateau:
    """Rows first .. last of one command; end: the row at which the next begins, which still reads this one's force."""

    first: int
    last: int
    end: int


def _plateaus(time_s: Floats, command_v: Floats) -> list[_Plateau]:
    """Stretches of one command, the slew up to it taken with it."""
    starts = np.concatenate([[0], 1 + np.flatnonzero(np.abs(np.diff(command_v)) > SAME_V)])
    lasts = np.concatenate([starts[1:] - 1, [len(command_v) - 1]])
    found: list[_Plateau] = []
    first = None
    for start, last in zip(starts.tolist(), lasts.tolist(), strict=True):
        first = start if first is None else first
        if time_s[last] - time_s[start] < 0.1 and last < len(command_v) - 1:
            continue  # on its way
        found.append(_Plateau(first, last, min(last + 1, len(command_v) - 1)))
        first = None
    return found


def _mean_settled_n(force_n: Floats, plateau: _Plateau) -> float:
    rows = force_n[plateau.first + 1 : plateau.end + 1]
    return float(np.mean(rows[-_tail(len(rows)) :])) if len(rows) else float(force_n[plateau.last])


def _correct_ends(settled_n: list[float], plateaus: list[_Plateau], time_s: Floats, known: _Fit) -> list[float]:
    """Where each stair would have ended: its tail, and what was missing then."""
    found = settled_n[:1]
    for k in range(1, len(plateaus)):
        now = plateaus[k]
        since_s = time_s[now.first + 1 : now.end + 1] - time_s[now.first] - known.dead_time_s
        tail_s = since_s[-_tail(len(since_s)) :]
        share = float(np.mean(missing(tail_s, known.lag_s, known.second_s))) if len(tail_s) else 0.0
        found.append(found[-1] + (settled_n[k] - found[-1]) / (1.0 - min(share, MOST_MISSING)))
    return found


def _tells(force_n: Floats, from_n: float, to_n: float) -> bool:
    noise_n = float(np.std(force_n[-_tail(len(force_n)) :])) if len(force_n) >= FEWEST_ROWS else inf
    return abs(to_n - from_n) >= max(LEAST_STEP_N, NOISE_AT * noise_n) and len(force_n) >= FEWEST_ROWS


def _changes(at_s: float, from_v: float, to_v: float, slew_v_per_s: float) -> tuple[tuple[float, float], ...]:
    """The step as it was put out: at once, or tick by tick where it had to rise slowly."""
    if to_v <= from_v or to_v - from_v <= slew_v_per_s * TICK_S:
        return ((at_s, to_v - from_v),)
    by_v = slew_v_per_s * TICK_S
    whole = int((to_v - from_v) / by_v)
    steps = [(at_s + TICK_S * k, by_v) for k in range(whole)]
    rest_v = to_v - from_v - whole * by_v
    return (*steps, (at_s + TICK_S * whole, rest_v)) if rest_v > SAME_V else tuple(steps)


def _way(
    model: Bsfm, memory: object, volts: tuple[float, float], forces_n: tuple[float, float]
) -> tuple[Floats, Floats] | None:
    """(V, N) on the way by the model, stretched so that it goes through both settled readings, by rising voltage; None where
    the model sees no way."""
    (from_v, to_v), (from_n, to_n) = volts, forces_n
    if abs(to_n - from_n) < LEAST_STEP_N or (to_n - from_n) * (to_v - from_v) <= 0.0:
        return None
    path_n = np.linspace(from_n, to_n, PATH_POINTS)
    path_v = []
    for force_n in path_n.tolist():
        share = model.branch_share(model.memory_after(memory, from_n, force_n))  # type: ignore[arg-type]
        path_v.append(model.voltage_v(force_n, share)[0])
    way_v = np.maximum.accumulate((np.array(path_v) - path_v[0]) / (path_v[-1] - path_v[0] or 1.0))
    way_v = way_v / way_v[-1] if way_v[-1] > 0.5 else np.linspace(0.0, 1.0, PATH_POINTS)
    stretched_v = from_v + way_v * (to_v - from_v)
    return (stretched_v, path_n) if to_v > from_v else (stretched_v[::-1].copy(), path_n[::-1].copy())
