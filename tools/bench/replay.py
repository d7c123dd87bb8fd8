"""How long a replay of a recording takes, against running the real-time twin, and how far coarse steps are from fine ones.

    .venv/bin/python tools/bench/replay.py

The recording: a rich minute at 200 Hz (a command that steps, ramps and swings), 12000 rows. Lanes differ in the fields that
are named; "jitter": the same recording with rows up to 1.5 ms too early or late. A new recording each time, so that nothing
is known from before; then "again", with one new plant among known ones, which is what a search asks for mostly. At last the
largest difference at a row from a replay in steps of 0.05 ms, over steps of 5 V, a single lag of 30 to 120 ms and several
delays: with rigid friction, with presliding, and with drag besides.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from gateway.cli.diagnosis.progress_line import show_progress
from gateway.profiles import load_plant
from gateway.progress import report, reported
from gateway.twin import Drive, Plant, Replay, Twin
from gateway.twin.experiment import Floats
from gateway.twin.plant import with_value

ROWS, RATE_HZ = 12_000, 200.0
LANES = (1, 8, 64)
JITTER_S = 0.0015


def rich_drive(jitter_s: float = 0.0) -> Drive:
    """Return steps, ramps and swings between 0.5 and 7 V."""
    time_s = np.arange(ROWS) / RATE_HZ
    steps = np.repeat(np.random.default_rng(1).uniform(0.5, 7.0, ROWS // 300), 300)
    swing = 3.5 + 2.0 * np.sin(time_s * (0.5 + 0.05 * time_s)) + np.sin(2.7 * time_s)
    command_v = np.where(time_s % 20.0 < 10.0, steps, swing)
    return Drive(time_s=jittered_times(time_s, jitter_s), command_v=command_v)


def jittered_times(time_s: Floats, jitter_s: float) -> Floats:
    """Return rows that are too early or too late by up to this much."""
    times_s: Floats = time_s + np.random.default_rng(2).uniform(-jitter_s, jitter_s, time_s.size)
    times_s -= times_s[0]
    return times_s


def stepping_drive(jitter_s: float) -> Drive:
    """Return ten seconds of steps of 5 V."""
    time_s = jittered_times(np.arange(2_000) / RATE_HZ, jitter_s)
    return Drive(time_s=time_s, command_v=np.where(time_s % 2.4 < 1.2, 6.0, 1.0))


def vary_plants(base: Plant, section: str, name: str, lanes: int) -> list[Plant]:
    """Return plants whose field grows by 0.1 % of itself (or of 0.01) from lane to lane."""
    value = getattr(getattr(base, section), name)
    return [with_value(base, section, name, value + (value or 0.01) * 0.001 * lane) for lane in range(lanes)]


def rigid(base: Plant) -> Plant:
    """Return the plant with dry friction alone: it neither gives way before it slides nor drags."""
    return replace(base, friction=replace(base.friction, presliding_m=0.0, viscous_n_s_per_m=0.0))


def dragging(base: Plant) -> Plant:
    """Return the plant with dry friction and drag, which does not give way before it slides."""
    return replace(base, friction=replace(base.friction, presliding_m=0.0))


def friction_and_lag(base: Plant, lanes: int) -> list[Plant]:
    """Return plants whose friction and lag grow from lane to lane."""
    plants = vary_plants(base, "friction", "coulomb_n", lanes)
    return [with_value(plant, "regulator", "lag_s", 0.05 + 0.0005 * lane) for lane, plant in enumerate(plants)]


CASES: dict[str, Callable[[Plant, int], list[Plant]]] = {
    "rigid friction": lambda base, lanes: vary_plants(rigid(base), "friction", "coulomb_n", lanes),
    "rigid friction, drag": lambda base, lanes: vary_plants(dragging(base), "friction", "coulomb_n", lanes),
    "rigid friction and lag": lambda base, lanes: friction_and_lag(rigid(base), lanes),
    "presliding": lambda base, lanes: vary_plants(base, "friction", "coulomb_n", lanes),
    "presliding and lag": friction_and_lag,
    "lag only, no friction": lambda base, lanes: vary_plants(
        replace(base, friction=Plant().friction), "regulator", "lag_s", lanes
    ),
    "delay": lambda base, lanes: vary_plants(base, "regulator", "delay_s", lanes),
    "Stribeck": lambda base, lanes: vary_plants(base, "friction", "stribeck_n", lanes),
    "slew limit": lambda base, lanes: [
        with_value(rigid(base), "regulator", "slew_pa_per_s", 2.0e6 + 1.0e4 * lane) for lane in range(lanes)
    ],
    "cell only": lambda base, lanes: vary_plants(base, "cell", "quadratic_per_n", lanes),
    "creep": lambda base, lanes: vary_plants(base, "contact", "creep_share", lanes),
}


def worst_n(plant: Plant, drive: Drive) -> float:
    """Return the largest difference at a row from steps of 0.05 ms, over lags and delays, N."""
    worst = 0.0
    for lag_s, delay_s in product((0.03, 0.045, 0.12), (0.0, 0.0071, 0.0233)):
        plants = [with_value(with_value(plant, "regulator", "lag_s", lag_s), "regulator", "delay_s", delay_s)]
        coarse, fine = (Replay(drive, step_s).run(plants).force_n for step_s in (None, 5.0e-5))
        worst = max(worst, float(np.abs(coarse - fine).max()))
    return worst


def spent_s(work: Callable[[], object]) -> float:
    """Return the seconds that a call takes."""
    began_s = time.process_time()
    work()
    return time.process_time() - began_s


def best_ms(make: Callable[[], Replay], plants: list[Plant], repeats: int = 3) -> float:
    """Return the shortest of a few runs, ms, each on a replay that knows nothing yet."""
    runs = [partial(make().run, plants) for _ in range(repeats)]
    return min(map(spent_s, runs)) * 1.0e3


def twin_us_per_step(plant: Plant) -> float:
    """Return what a step of the real-time twin takes, us."""
    twin = Twin(plant, 1)
    twin.command(4.0)
    return min(spent_s(lambda: twin.advance(5.0)) for _ in range(5)) / 5000.0 * 1.0e6


def print_accuracy(base: Plant) -> None:
    """Print the largest differences from fine steps."""
    print(f"\n{'N from fine steps, rows:':28}{'even':>9}{'jitter':>9}")
    base = with_value(base, "regulator", "second_lag_s", 0.0)
    still = with_value(base, "friction", "viscous_n_s_per_m", 0.0)
    for name, plant in (("rigid friction", rigid(base)), ("presliding", still), ("presliding, drag", base)):
        errors_n = [worst_n(plant, stepping_drive(jitter_s)) for jitter_s in (0.0, JITTER_S)]
        print(f"{name:28}" + "".join(f"{worst:9.4f}" for worst in errors_n))


def print_all() -> None:
    """Print times of replays, and how exact they are."""
    base, even, uneven = load_plant("paper-slide").plant, rich_drive(), rich_drive(JITTER_S)
    Replay(even).run([base])  # imports scipy
    step_us = twin_us_per_step(base)
    print(f"real-time twin: {step_us:.2f} us per step of 1 ms, {step_us * 60.0:.0f} ms for the minute\n")
    print(f"{'ms for one call, lanes:':28}" + "".join(f"{n:>9}" for n in LANES) + f"{'us/lane':>10}{'jitter':>9}")
    for name, make in reported("cases of friction", list(CASES.items())):
        best = [best_ms(lambda: Replay(even), make(base, lanes)) for lanes in LANES]
        jittered = best_ms(lambda: Replay(uneven), make(base, LANES[-1]))
        us_per_lane = best[-1] / LANES[-1] * 1.0e3
        print(f"{name:28}" + "".join(f"{ms:9.1f}" for ms in best) + f"{us_per_lane:10.0f}{jittered:9.1f}")
    plants = CASES["presliding and lag"](base, LANES[-1])
    for name, drive in (("even", even), ("jitter", uneven)):
        replay = Replay(drive)
        replay.run(plants)
        fresh = with_value(base, "friction", "coulomb_n", 1.2345)
        again_ms, new_ms = (spent_s(partial(replay.run, some)) * 1.0e3 for some in (plants, [*plants[1:], fresh]))
        print(f"{'again, ' + name:28}{'':18}{again_ms:9.1f} all known{new_ms:9.1f} one new")
    report("fine steps, to compare with")
    print_accuracy(base)


def main() -> None:
    """Print it all, shown meanwhile."""
    with show_progress("replays"):
        print_all()


if __name__ == "__main__":
    main()
