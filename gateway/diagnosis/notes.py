"""What a reader of an answer has to know beside it: sentences about the recordings and about what was asked."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.recording_drive import rows_after_unseen_settings
from gateway.diagnosis.measurement import Flags, Measurement
from gateway.diagnosis.noise.whitening import fast_noise_n
from gateway.diagnosis.result import Diagnosis, Verdict

_MOVING_RATIO: Final = 30.0  # times the noise, from which a force moves
_RESTING_RATIO: Final = 8.0  # times the noise, below which nearly all readings of a force lie that stands
_IMPLAUSIBLE_RATIO: Final = 30.0  # times larger or smaller than the start: a unit, more likely than a machine
_OFFSETS_APART_RATIO: Final = 10.0  # times the floor, from which offsets are told
_IMPOSSIBLE_RATIO: Final = 10.0  # times the largest reading: no amplifier shows one with such a zero
_NO_AREA_M2: Final = 5.0e-6
"""What is left of the model's area where no force answers; a small signal leaves it whole."""


def recording_notes(measurements: Sequence[Measurement], offsets_n: Sequence[float], floor_n: float) -> Iterator[str]:
    """Yield each recording's own notes, then what only all of them together show."""
    for each in measurements:
        yield from each.notes
        yield from _dead_drive_notes(each)
        yield from _unseen_setting_notes(each)
    impossible = [pair for pair in zip(measurements, offsets_n, strict=True) if _is_impossible(*pair)]
    for each, offset_n in impossible:
        yield (
            f"{each.name}: the model needs a zero of {offset_n:.3g} N for it, far beyond its readings, so nothing found here "
            "holds: is it of the same machine, and are its columns what they say?"
        )
    if not impossible and max(offsets_n) - min(offsets_n) > _OFFSETS_APART_RATIO * floor_n:
        offsets = ", ".join(
            f"{each.name} {offset_n:.3g} N" for each, offset_n in zip(measurements, offsets_n, strict=True)
        )
        yield (
            f"the recordings have offsets of their own ({offsets}); the extended plant has their mean: "
            "a simulation of one of them is off by the difference"
        )


def _is_impossible(measurement: Measurement, offset_n: float) -> bool:
    readings_n = np.abs(measurement.force_n[measurement.usable])
    return bool(0.0 < _IMPOSSIBLE_RATIO * np.max(readings_n, initial=0.0) < abs(offset_n))


def uninformative_force(measurements: Sequence[Measurement]) -> str:
    """Return why these recordings say nothing of the machine, as a sentence; empty where one of them does: its force moves."""
    whys = [_why_uninformative(each) for each in measurements]
    return whys[0] if whys and all(whys) else ""


def why_blind(diagnosis: Diagnosis) -> str:
    """Return why the recordings say nothing, where they do not and nothing else was found. What is found in a force whose
    readings are all the same is the base model's, which is nowhere quite still."""
    measurements = [trace.measurement for trace in diagnosis.traces]
    has_findings = (
        diagnosis.suspects or diagnosis.causes or diagnosis.leftover or diagnosis.base.cylinder.area_m2 > _NO_AREA_M2
    )
    if has_findings and not _is_frozen(measurements):
        return ""
    return uninformative_force(measurements)


def withhold_all_clear(diagnosis: Diagnosis) -> Diagnosis:
    """Return the answer, as unknown where the recordings say nothing: nothing is found in the force of a dead cell."""
    return replace(diagnosis, verdict=Verdict.UNKNOWN) if why_blind(diagnosis) else diagnosis


def _is_frozen(measurements: Sequence[Measurement]) -> bool:
    """Decide whether each of these recordings has one force in every row: a cell that is dead or repeats itself."""
    still = [each.usable.any() and np.ptp(each.force_n[each.usable]) == 0.0 for each in measurements]
    return bool(still) and all(still)


def _why_uninformative(measurement: Measurement) -> str:
    moved = _movement(measurement)
    if not moved or _is_moving(measurement):
        return ""
    return (
        f"{measurement.name}: the force stands at {np.mean(measurement.force_n[measurement.usable]):.3g} N while {moved}: a "
        "cell that is not connected, or a tool that touches nothing? As it is, nothing of the machine can be told from it"
    )


def _is_moving(measurement: Measurement) -> bool:
    """Does the force move beyond its noise?"""
    force_n = measurement.force_n[measurement.usable]
    low_n, high_n = np.quantile(force_n, (0.01, 0.99))
    return bool(high_n - low_n > _RESTING_RATIO * fast_noise_n(force_n))


def _movement(measurement: Measurement) -> str:
    """What moves the slide, and by how much; empty where nothing does."""
    volts, pressure_pa = measurement.command_v, measurement.pressure_pa
    if volts is not None and np.ptp(volts) > 0.0:
        return f"command_v moves by {np.ptp(volts):.3g} V"
    if volts is None and pressure_pa is not None and np.ptp(pressure_pa) > _RESTING_RATIO * fast_noise_n(pressure_pa):
        return f"pressure_kpa moves by {np.ptp(pressure_pa) / 1.0e3:.3g} kPa"
    return ""


def implausible_area(area_m2: float, start_m2: float) -> str:
    """Return a sentence where the force is of another size than the piston can give; empty else."""
    times = area_m2 / start_m2
    if 1.0 / _IMPLAUSIBLE_RATIO < times < _IMPLAUSIBLE_RATIO:
        return ""
    return (
        f"the force is {times:.3g} times what the start plant's piston of {start_m2 * 1.0e4:.3g} cm2 gives: if that is no "
        "machine of another size, force_n or the command is in another unit; --columns force_n=HEADER:mn takes it for mN"
    )


def nothing_to_switch_off(name: str) -> str:
    """Return the note for --without of an effect that the base model does not have."""
    return (
        f"--without {name}: the base model has no {name} that could be switched off, so nothing was; it competes like "
        "every other effect"
    )


def too_high_a_floor(given_n: float, rms_n: float) -> str:
    """Return the note for a noise floor that confirms nothing."""
    return (
        f"the noise floor of {given_n:.3g} N that was given is more than the base model leaves ({rms_n:.3g} N), so it "
        "confirms nothing and was not used: it is the noise of the readings at rest, in newtons"
    )


def _dead_drive_notes(measurement: Measurement) -> Iterator[str]:
    volts = measurement.command_v
    if volts is None or measurement.pressure_pa is not None or np.ptp(volts) > 0.0:
        return
    force_n = measurement.force_n[measurement.usable]
    if not _is_moving(measurement):
        yield (
            f"{measurement.name}: command_v stands at {volts[0]:g} V throughout: the model's area and offset cannot be "
            "told apart"
        )
    elif np.ptp(force_n) > _MOVING_RATIO * fast_noise_n(force_n):
        yield (
            f"{measurement.name}: command_v stands at {volts[0]:g} V throughout while the force moves by "
            f"{np.ptp(force_n):.3g} N: is it the right column? Without a command that moves, no cause can be told"
        )


def _unseen_setting_notes(measurement: Measurement) -> Iterator[str]:
    unseen = rows_after_unseen_settings(measurement)
    if count := int((unseen & measurement.usable).sum()):
        first_s, last_s = measurement.time_s[np.flatnonzero(unseen)[[0, -1]]]
        yield (
            f"{measurement.name}: {count} of {int(measurement.usable.sum())} readings are not judged, between {first_s:.1f} "
            f"and {last_s:.1f} s: the gateway's loop was late while the voltage moved (A342), and a setting may be missing"
        )


def set_aside_notes(bench: Bench, aside: Flags) -> Iterator[str]:
    """Yield a sentence for each recording that has readings which are no witness. aside: these, (rows,)."""
    for channel in bench.channels:
        rows = np.flatnonzero(aside[channel.rows]) if channel.is_force else np.zeros(0, dtype=int)
        if rows.size:
            measurement, first = bench.measurements[channel.recording], int(rows[0])
            yield (
                f"{measurement.name}: {rows.size} reading{'s stand' if rows.size > 1 else ' stands'} far apart from those "
                f"around and {'are' if rows.size > 1 else 'is'} not judged: {measurement.force_n[first]:.5g} N at "
                f"{measurement.time_s[first]:.3f} s"
            )
