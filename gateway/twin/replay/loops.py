"""The compiled loops of a replay: the steps of the twin, one after another, over the points of a recording.

Every loop fills its last argument. Series are contiguous, (points,); steps_s[i] leads from point i to point i + 1.
"""

from gateway.compiled import loop
from gateway.twin.friction import age_stiction, relax_strain
from gateway.twin.play_and_lags import apply_play, follow_ramp, ramp_shares
from gateway.twin.regulator import (
    HeldTarget,
    PressureLags,
    PressureState,
    follow_target,
    lag_shares,
    leaked_share,
    notice_target,
)
from gateway.twin.replay.drive import Floats
from gateway.twin.slide import Slide, SlideState, advance_slide

_ALIKE = 1.0e-9  # lengths of time, by their share, that lags need not tell apart


@loop
def hold_targets(
    asked_pa: Floats, row_s: Floats, lasts_s: Floats, shape: tuple[float, float, float, float], held_pa: Floats
) -> None:
    """Fill in the mean target over each row, Pa, behind the one before all rows: (1 + rows,), as asked_pa.

    shape: dead band, play and supply, Pa, and leak, 1/s. lasts_s: of each row.
    """
    dead_band_pa, play_pa, supply_pa, leak_per_s = shape
    target = notice_target(HeldTarget(0.0, 0.0, 0.0), asked_pa[0], dead_band_pa, play_pa, supply_pa)
    held_pa[0] = target.held_pa
    since_s = row_s[0]
    for row in range(row_s.size):
        before_pa = target.noticed_pa
        target = notice_target(target, asked_pa[row + 1], dead_band_pa, play_pa, supply_pa)
        held_pa[row + 1] = target.held_pa
        if leak_per_s != 0.0:
            if target.noticed_pa != before_pa:
                since_s = row_s[row]
            held_pa[row + 1] *= leaked_share(leak_per_s, row_s[row] - since_s, lasts_s[row])


@loop
def march_pressure(
    lags: PressureLags,
    jumps: bool,
    start_pa: tuple[float, float],
    series: tuple[Floats, Floats, Floats],
    pressure_pa: Floats,
) -> None:
    """Fill in the pressure at each point. A target that arrives just then is not seen yet.

    start_pa: at the first point, behind the first lag and behind the second. series: targets, Pa, one more than the times at
    which they arrive, s, from before the first; those times; the points, s. jumps: whether there is no lag at all.
    """
    target_pa, arrives_s, point_s = series
    seen_pa = target_pa[0]
    state = PressureState(start_pa[0], start_pa[1], start_pa[1])
    step_s = part_s = -1.0
    step = part = lag_shares(lags, 1.0)
    at_s, row = point_s[0], 0
    pressure_pa[0] = start_pa[1]
    for point in range(1, point_s.size):
        begin_s, end_s, total = at_s, point_s[point], 0.0
        while row < arrives_s.size and arrives_s[row] < end_s:
            held_s = arrives_s[row] - at_s
            if held_s > 0.0:
                if abs(held_s - part_s) > _ALIKE * held_s:
                    part_s, part = held_s, lag_shares(lags, held_s)
                state = follow_target(state, seen_pa, part)
                total += held_s * seen_pa
                at_s = arrives_s[row]
            row += 1
            seen_pa = target_pa[row]
        held_s = end_s - at_s
        if abs(held_s - step_s) > _ALIKE * held_s:
            step_s, step = held_s, lag_shares(lags, held_s)
        state = follow_target(state, seen_pa, step)
        pressure_pa[point] = (total + held_s * seen_pa) / (end_s - begin_s) if jumps else state.slewed_pa
        at_s = end_s


@loop
def march_slide(
    slides: tuple[Slide, Slide],
    start: SlideState,
    loads_n: tuple[Floats, Floats, Floats],
    steps_s: Floats,
    force_n: Floats,
) -> None:
    """Fill in the force at each point.

    loads_n: thrust, what surroundings add to the friction's limit, and what of it moving out has more.
    slides: as it moves, and as it comes to rest. start: the state at the first point where its force is above 0; else the
    slide comes to rest there, from that state.
    """
    slide, resting = slides
    thrust_n, side_n, more_out_n = loads_n
    state = start
    if not start.force_n > 0.0:
        loads = (thrust_n[0], side_n[0], more_out_n[0], 0.0)
        rest = advance_slide(resting, start, loads, steps_s[0], steps_s[0])
        state = SlideState(rest.position_m, 0.0, 0.0, rest.strains, rest.force_n, rest.friction_n)
    force_n[0] = state.force_n
    last_s = steps_s[0]
    for point in range(1, thrust_n.size):
        step_s = steps_s[point - 1]
        loads = (thrust_n[point], side_n[point], more_out_n[point], 0.0)
        state = advance_slide(slide, state, loads, step_s, last_s)
        force_n[point] = state.force_n
        last_s = step_s


@loop
def march_stiction(full_n: float, rest_s: float, travels: Floats, steps_s: Floats, stiction_n: Floats) -> None:
    """Fill in the stiction at each point behind the first. travels: of each step, as multiples of the breakaway."""
    for point in range(1, stiction_n.size):
        _, stiction_n[point] = age_stiction(
            stiction_n[point - 1], full_n, steps_s[point - 1] / rest_s, travels[point - 1]
        )


@loop
def march_strain(towards: Floats, travels: Floats, strain: Floats) -> None:
    """Fill in the strain at each point, from sliding. travels: of each step, as multiples of the yield travel."""
    strain[0] = towards[0]
    for point in range(1, strain.size):
        strain[point] = relax_strain(strain[point - 1], towards[point], travels[point - 1])


@loop
def march_lag(lag_s: float, start: float, series: Floats, steps_s: Floats, late: Floats) -> None:
    """Fill in a first-order lag behind a series that is straight between its points, from `start`."""
    late[0] = start
    step_s = steps_s[0]
    shares = ramp_shares(lag_s, step_s)
    for point in range(1, series.size):
        if abs(steps_s[point - 1] - step_s) > _ALIKE * step_s:
            step_s = steps_s[point - 1]
            shares = ramp_shares(lag_s, step_s)
        late[point] = follow_ramp(late[point - 1], shares, series[point - 1], series[point])


@loop
def march_play(width: float, start: float, series: Floats, behind: Floats) -> None:
    """Fill in a play of full width `width` behind a series."""
    state = start
    for point in range(series.size):
        state = apply_play(state, series[point], width)
        behind[point] = state
