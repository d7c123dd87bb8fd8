"""What no effect explains, in words and numbers: its form, how large it is, whose it is, and what would show its nature."""

import re
from collections.abc import Mapping
from typing import Final

import numpy as np

from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.residuals.regressors import Regressors
from gateway.diagnosis.result import Leftover

_NUMBER: Final = re.compile(r"[-+.e0-9]+")
_TAILS: Final = (0.02, 0.98)  # of a contribution, between which its amplitude is half the way
_SAME: Final = 0.7  # correlation from which two forms are one thing
_SAME_LINE: Final = 0.05  # relative
_OF_ONE_FILE: Final = 0.8  # of what is explained
_EXPERIMENTS: Final[Mapping[str, str]] = {
    "line": (
        "hold one force for a minute and switch what turns or pumps off and on, one after another: what the line of "
        "{hertz:.3g} Hz goes with makes it"
    ),
    "slow": (
        "hold one force for {long_s:.0f} s and log temperature_c and supply_kpa beside it: what wanders with the force "
        "makes it, and at a second force it shows whether it is a change of gain"
    ),
    "jump": "run the same cycle twice without touching anything: what comes again at {at_s:.0f} s belongs to the machine",
    "columns": "hold one force and move {names} alone, up and down, slowly and fast",
    "product": "hold one force and step {names}: the first at two values of the second",
    "force": "a staircase up and down over the whole range, each stair 3 s",
    "direction": "one ramp up and down over the whole range, five times, slowly and fast",
    "speed": "the same ramp up and down at three speeds",
    "command": "a staircase of the command up and down over the whole range, pressure_kpa beside it",
    "loud": "repeat the recording with the same command: what is loud again at the same command belongs to the machine",
}


def describe_leftover(bench: Bench, regressors: Regressors, sizes: Floats, share: float) -> Leftover:
    """Return a dependence in words and numbers. sizes: of its columns, N; share: of what is left."""
    contribution_n = sizes @ regressors.columns
    amplitude_n = _amplitude_n(bench, regressors, contribution_n)
    period_s = _period_s(bench, regressors, sizes)
    file = find_file(bench, contribution_n**2)
    slow = f" over about {period_s:.0f} s" if period_s is not None else ""
    sized = f"{amplitude_n:.2g} N" if regressors.frequency_hz else f"{amplitude_n:.2g} N to either side"
    return Leftover(
        depends_on=regressors.depends_on,
        shape=f"{regressors.shape}{slow}, {sized}",
        share=min(share, 1.0),
        columns=regressors.names,
        frequency_hz=regressors.frequency_hz,
        amplitude_n=amplitude_n,
        period_s=period_s,
        file=file,
        experiment=propose_experiment(
            regressors.kind,
            hertz=regressors.frequency_hz or 0.0,
            at_s=regressors.at_s or 0.0,
            long_s=max(3.0 * (period_s or 0.0), 60.0),
            names=" and ".join(regressors.names),
        ),
    )


def propose_experiment(kind: str, **numbers: float | str) -> str:
    """Return the experiment that would show the nature of a leftover of this kind."""
    return _EXPERIMENTS[kind].format(**numbers)


def find_file(bench: Bench, power: Floats) -> str:
    """Return the recording that has nearly all of this power (rows,); empty for one recording, or where several have it."""
    if len(bench.measurements) == 1:
        return ""
    of_each = np.zeros(len(bench.measurements))
    for channel in bench.channels:
        of_each[channel.recording] += float(np.sum(power[channel.rows]))
    best = int(np.argmax(of_each))
    return bench.measurements[best].name if of_each[best] > _OF_ONE_FILE * float(of_each.sum()) else ""


def is_one_thing(one: Regressors, other: Regressors, contributions_n: tuple[Floats, Floats], rows: np.ndarray) -> bool:
    """Return whether both tell of one thing: the same columns, the same line, slow changes of one recording, or one form.

    rows: that count.
    """
    if one.frequency_hz and other.frequency_hz:
        return abs(one.frequency_hz / other.frequency_hz - 1.0) < _SAME_LINE
    if one.depends_on == other.depends_on and not (one.frequency_hz or other.frequency_hz):
        return True
    if set(one.names) & set(other.names):
        return True
    return abs(_correlation(*(each[rows] for each in contributions_n))) > _SAME


def is_same_form(one: Leftover, other: Leftover) -> bool:
    """Return whether both are of one form, whatever their size: the same line, or the same words about the same column."""
    if one.frequency_hz and other.frequency_hz:
        return abs(one.frequency_hz / other.frequency_hz - 1.0) < _SAME_LINE
    words = [_NUMBER.sub("", each.shape) for each in (one, other)]
    return one.depends_on == other.depends_on and words[0] == words[1]


def _correlation(first: Floats, second: Floats) -> float:
    first, second = first - np.mean(first), second - np.mean(second)
    size = float(np.sqrt(np.sum(first**2) * np.sum(second**2)))
    return float(np.sum(first * second)) / size if size > 0.0 else 0.0


def _amplitude_n(bench: Bench, regressors: Regressors, contribution_n: Floats) -> float:
    """Amplitude of a line; of all else, half the way that it goes."""
    values = contribution_n[bench.judged & (np.abs(contribution_n) > 0.0)]
    if not values.size:
        return 0.0
    if regressors.frequency_hz:
        return float(np.sqrt(2.0 * np.mean(values**2)))
    return float(np.diff(np.quantile(contribution_n[bench.judged], _TAILS))[0]) / 2.0


def _period_s(bench: Bench, regressors: Regressors, sizes: Floats) -> float | None:
    """Of a slow wander, by how often it crosses its mean; None for what does not wander."""
    if regressors.slow is None:
        return None
    wander = sizes @ regressors.slow
    channel = max((each for each in bench.channels if each.is_force), key=lambda each: float(np.var(wander[each.rows])))
    values = wander[channel.rows]
    crossings = int(np.sum(np.diff(np.sign(values - np.mean(values))) != 0))
    return 2.0 * bench.measurements[channel.recording].duration_s / max(crossings, 1)
