"""A diagnosis in words and rounded numbers, for the terminal and the page alike."""

from collections.abc import Iterable
from math import floor, isfinite, log10, sqrt
from typing import Final

from gateway.diagnosis.result import Cause, Diagnosis, Estimate, FloorSource, Interval, Leftover, RefittedNumber
from gateway.twin.plant import Plant

_FLOOR_SOURCES: Final = {
    FloorSource.GIVEN: "as given",
    FloorSource.REPLICATES: "from repeated cycles",
    FloorSource.RESTS: "from rests",
    FloorSource.CALIBRATION: "from the calibration",
    FloorSource.SEARCH: "estimated",
}


def machine_sentence(diagnosis: Diagnosis) -> str:
    """Return what belongs to the machine and was there before, where its older recordings were given; empty else."""
    machine = diagnosis.machine
    if machine is None:
        return ""
    names = join_words(each.name for each in machine.effects) if machine.effects else "no effect of the catalogue"
    return (
        f"belongs to the machine, by {join_words(machine.recordings)}: {names}, and {force(machine.common_error_n)} N RMS that "
        f"its model gets wrong in the same way every time; {force(machine.left_n)} N RMS is left beside it"
    )


def others(cause: Cause) -> list[str]:
    """Return the names that the recording cannot tell from this cause."""
    return [name for name in cause.group if name != cause.name]


def number(value: float, digits: int = 3) -> str:
    """Return `0.031`, `−12.4`, `1 250 000`, `4.1e-06`: so many digits that count, none that are made up."""
    if not isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    power = floor(log10(abs(value)))
    if not -4 <= power < 7:
        return f"{value:.{digits - 1}e}".replace("-", "−", 1 if value < 0 else 0)
    text = f"{value:,.{max(0, digits - 1 - power)}f}".replace(",", " ")
    return text.replace("-", "−")


def force(value_n: float) -> str:
    """Return a force without its unit; as many decimals as tell forces of this size apart."""
    if not isfinite(value_n):
        return "–"
    return f"{value_n:.{2 if abs(value_n) >= 10.0 else 3}f}".replace("-", "−")


def confidence(value: float) -> str:
    """Return a confidence as the JSON has it, 0 to 1, with two digits that never say 1 of what is not certain."""
    if not isfinite(value):
        return "–"
    return "> 0.99" if 0.995 <= value < 1.0 else f"{value:.2f}"


def percent(share: float) -> str:
    """Return a whole percentage that never says 100 % or 0 % of what is not."""
    if not isfinite(share):
        return "–"
    if 0.0 < share < 0.01:
        return "< 1 %"
    return "> 99 %" if 0.99 < share < 1.0 else f"{100.0 * share:.0f} %"


def interval(ends: Interval) -> str:
    """Return `[0.029, 0.033]`, with so many digits that the ends differ."""
    low, high = ends
    digits = 3 if low == high or not isfinite(high - low) else _digits(max(abs(low), abs(high)), abs(high - low))
    return f"[{number(low, digits)}, {number(high, digits)}]"


def _digits(size: float, width: float) -> int:
    """So many that the two ends of an interval differ in their last two."""
    return min(8, max(3, 2 + floor(log10(size / width)))) if size > 0.0 else 3


def estimate(value: Estimate) -> str:
    """Return `0.031 N/N [0.029, 0.033]`."""
    unit = f" {value.unit}" if value.unit not in ("", "1") else ""
    low, high = value.ci95
    wide = isfinite(high - low) and high > low
    digits = _digits(max(abs(low), abs(high)), high - low) if wide else 3
    return f"{number(value.value, digits)}{unit} {interval(value.ci95)}"


def previous_value(diagnosis: Diagnosis, name: str, value: Estimate) -> str:
    """Return ` (0.08 before)`, where the plant that was given has the effect already, in another size."""
    before = getattr(getattr(diagnosis.base, value.section), name) if value.section else 0.0
    null = getattr(getattr(Plant(), value.section), name) if value.section else 0.0
    return "" if before == null else f" ({number(before)} before)"


def refitted_number(refitted: RefittedNumber) -> str:
    """Return `friction.coulomb_n is 4.63 N here, 2 N in the plant`."""
    unit = f" {refitted.unit}" if refitted.unit not in ("", "1") else ""
    here, before = number(refitted.value), number(refitted.before)
    return f"{refitted.section}.{refitted.name} is {here}{unit} here, {before}{unit} in the plant"


def gain_text(cause: Cause) -> str:
    """Return `0.830 → 0.310 N`."""
    return f"{force(cause.gain.held_out_rms_before_n)} → {force(cause.gain.held_out_rms_after_n)} N"


def explained_share(diagnosis: Diagnosis) -> float:
    """Return the share of the squared error above the noise floor that the causes take away, 0..1; nan where there is none.

    The model's share, or that of the strongest cause: spikes are taken out of the readings before any model is fitted.
    """
    floor_n2 = diagnosis.baseline.noise_floor_n**2
    excess_n2 = diagnosis.baseline.rms_n**2 - floor_n2
    left_n2 = diagnosis.extended.held_out_rms_n**2 - floor_n2
    strongest = max((cause.gain.share_of_excess for cause in diagnosis.causes), default=0.0)
    if excess_n2 <= 0.0:
        return strongest if diagnosis.causes else float("nan")
    return min(1.0, max(strongest, 1.0 - left_n2 / excess_n2))


def leftover(rest: Leftover) -> str:
    """Return what is left in a sentence: what it depends on, its form and size, whose it is, its share."""
    of_file = f" in {rest.file}" if rest.file else ""
    return f"depends on {rest.depends_on}{of_file}: {rest.shape} ({percent(rest.share)} of what is left)"


def floor_source(diagnosis: Diagnosis) -> str:
    """Return how the noise floor is known, as words behind its number."""
    return _FLOOR_SOURCES[diagnosis.baseline.noise_floor_source]


def excess_n(diagnosis: Diagnosis) -> float:
    """Return what stands above the noise in the base model's error, N RMS."""
    return sqrt(max(0.0, diagnosis.baseline.rms_n**2 - diagnosis.baseline.noise_floor_n**2))


def next_recordings(diagnosis: Diagnosis) -> list[tuple[str, tuple[str, ...]]]:
    """Return (what to record, the effects that it would show), the diagnosis' own proposals first; no proposal twice."""
    by_experiment: dict[str, list[str]] = {proposal: [] for proposal in diagnosis.experiments}
    for unseen in diagnosis.not_identifiable:
        by_experiment.setdefault(unseen.experiment, []).append(unseen.name)
    return [(proposal, tuple(names)) for proposal, names in by_experiment.items() if proposal]


def all_notes(diagnosis: Diagnosis, before: Iterable[str] = ()) -> list[str]:
    """Return every note once: those that came before, the diagnosis' own, and the reader's with their recording's name."""
    measurements = [trace.measurement for trace in diagnosis.traces]
    read = {note for measurement in measurements for note in measurement.notes}
    named = [
        f"{measurement.name}: {note}" if len(measurements) > 1 else note
        for measurement in measurements
        for note in measurement.notes
    ]
    suspected = [suspect.sentence for suspect in diagnosis.suspects]
    return list(dict.fromkeys([*suspected, *before, *(note for note in diagnosis.notes if note not in read), *named]))


def join_words(words: Iterable[str]) -> str:
    """Return `a`, `a and b`, `a, b and c`."""
    *most, last = list(words) or [""]
    return f"{', '.join(most)} and {last}" if most else last
